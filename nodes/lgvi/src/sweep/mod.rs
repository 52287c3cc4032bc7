//! `lgvi sweep`: a scene flown with every combination of some values, as one table and one picture.

mod flown;
mod picture;
mod table;
mod variation;

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use clap::Args;
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;
use serde_json::json;

use crate::output::say;
use crate::scene_input::SceneInput;
use crate::{bars, values};
use flown::Flown;
use variation::{Combination, Variation};

/// The command line of `lgvi sweep`.
#[derive(Args)]
pub(crate) struct Options {
    #[command(flatten)]
    input: SceneInput,
    /// A key of the scene and its values, such as `run.steps=[100, 200, 500]`, `run.steps=[100, 1000, log:8]` for 8 values at equal
    /// ratios, or `bodies.NAME.mass=[1, 2, lin:5]` for 5 at equal distances; with several, all combinations are flown.
    #[arg(long, value_name = "KEY=[VALUES]", value_parser = Variation::parse, required = true)]
    vary: Vec<Variation>,
    /// Directory of the results, which must not exist (default: `flights/<scene>_sweep`).
    #[arg(long, value_name = "DIRECTORY", value_parser = values::path())]
    output: Option<PathBuf>,
    /// Threads; 0 starts one per core.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Fly one after another, without a picture, and add the time that each flight took to the table.
    #[arg(long, conflicts_with = "threads")]
    time: bool,
    /// Print the table's rows as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Most combinations.
const MOST_FLIGHTS: usize = 100_000;

/// Most threads.
const MOST_THREADS: usize = 4096;

/// Flies all combinations and writes `sweep.csv` and `sweep.svg`.
pub(crate) fn sweep(options: &Options) -> Result<ExitCode, NodeError> {
    if options.threads > MOST_THREADS {
        let threads = options.threads;
        let message = format!("--threads {threads}: expected at most {MOST_THREADS}");
        return Err(NodeError::Input(message));
    }
    let shutdown = Shutdown::on_signals().map_err(NodeError::runtime)?;
    let combinations = combinations(&options.vary)?;
    // A value that the scene refuses is told before the first flight.
    for combination in &combinations {
        if shutdown.requested() {
            return Err(NodeError::Interrupted);
        }
        options.input.with(combination.settings())?;
    }
    let name = options.input.with(&[])?.name;
    let output = options.output.clone();
    let output = output.unwrap_or_else(|| PathBuf::from(format!("flights/{name}_sweep")));
    let parent = output.parent().map_or(Ok(()), fs::create_dir_all);
    parent
        .and_then(|()| fs::create_dir(&output))
        .map_err(|error| NodeError::Input(format!("cannot make {}: {error}", output.display())))?;

    let flown = fly(options, &combinations, &shutdown)?;
    let table = table::Table::new(&combinations, &flown, options.time);
    table.write(&output.join("sweep.csv"))?;
    let path = output.join("sweep.svg");
    if !options.time {
        let picture = picture::draw(&name, &combinations, &flown)?;
        fs::write(&path, picture).map_err(|error| {
            NodeError::Runtime(format!("cannot write {}: {error}", path.display()))
        })?;
    }
    if options.json {
        say(&json!({"directory": output, "flights": table.to_json()}))?;
    } else {
        let failed = flown.iter().filter(|flight| flight.failure.is_some());
        let mut text = format!("{name}: {} flights, {} failed", flown.len(), failed.count());
        text += &format!("\n  table     {}", output.join("sweep.csv").display());
        if !options.time {
            text += &format!("\n  picture   {}", path.display());
        }
        say(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// All combinations of the values, the last key varying fastest.
fn combinations(vary: &[Variation]) -> Result<Vec<Combination>, NodeError> {
    for (index, one) in vary.iter().enumerate() {
        if vary[..index].iter().any(|other| other.key == one.key) {
            let message = format!("--vary {}: expected each key once", one.key);
            return Err(NodeError::Input(message));
        }
    }
    let counts = vary.iter().map(|one| one.values.len());
    let count = counts.fold(1_usize, usize::saturating_mul);
    if count > MOST_FLIGHTS {
        let message = format!("--vary: {count} combinations, expected at most {MOST_FLIGHTS}");
        return Err(NodeError::Input(message));
    }
    let mut all = vec![Combination::default()];
    for one in vary {
        let extended = all
            .iter()
            .flat_map(|before| one.values.iter().map(|value| before.and(&one.key, value)));
        all = extended.collect();
    }
    Ok(all)
}

fn fly(
    options: &Options,
    combinations: &[Combination],
    shutdown: &Shutdown,
) -> Result<Vec<Flown>, NodeError> {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let threads = match options.threads {
        _ if options.time => 1,
        0 => cores,
        threads => threads,
    };
    let bar = bars::bar("flying", combinations.len() as u64, "flights");
    let next = AtomicUsize::new(0);
    let places: Vec<_> = combinations.iter().map(|_| Mutex::new(None)).collect();
    let drawn = match options.time {
        true => BTreeSet::new(),
        false => picture::drawn(combinations.len()),
    };
    let work = || {
        while !shutdown.requested() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(combination) = combinations.get(index) else {
                return;
            };
            let flown = options
                .input
                .with(combination.settings())
                .and_then(|scene| Flown::of(scene, drawn.contains(&index), shutdown));
            *places[index].lock().unwrap_or_else(PoisonError::into_inner) = Some(flown);
            bar.inc(1);
        }
    };
    thread::scope(|scope| {
        for _ in 0..threads.min(combinations.len()) {
            scope.spawn(work);
        }
    });
    bar.finish_and_clear();
    let flown = places.into_iter().map(|place| {
        let place = place.into_inner().unwrap_or_else(PoisonError::into_inner);
        place.unwrap_or(Err(NodeError::Interrupted))
    });
    flown.collect()
}
