//! `lgvi sweep`: a scene flown with every combination of some values, as one table and one picture.

mod picture;
mod table;
mod variation;
mod watched;

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;
use lgvi_review::check_threads;
use lgvi_review::sweep::{Combination, Table, Variation, combinations, fly_all};
use serde_json::json;

use crate::output::say;
use crate::scene_input::SceneInput;
use crate::{bars, values};
use watched::Watched;

/// The command line of `lgvi sweep`.
#[derive(Args)]
pub(crate) struct Options {
    #[command(flatten)]
    input: SceneInput,
    /// A key of the scene and its values, such as `run.steps=[100, 200, 500]`, `run.steps=[100, 1000, log:8]` for 8 values at equal
    /// ratios, or `bodies.NAME.mass=[1, 2, lin:5]` for 5 at equal distances; with several, all combinations are flown.
    #[arg(long, value_name = "KEY=[VALUES]", value_parser = variation::parse, required = true)]
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

/// Flies all combinations and writes `sweep.csv` and `sweep.svg`.
pub(crate) fn sweep(options: &Options) -> Result<ExitCode, NodeError> {
    check_threads(options.threads).map_err(NodeError::input)?;
    let shutdown = Shutdown::on_signals().map_err(NodeError::runtime)?;
    let combinations = combinations(&options.vary)
        .map_err(|error| NodeError::Input(format!("--vary: {error}")))?;
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
    let table = table_of(&combinations, &flown, options.time);
    table::write(&table, &output.join("sweep.csv"))?;
    let path = output.join("sweep.svg");
    if !options.time {
        let picture = picture::draw(&name, &combinations, &flown)?;
        fs::write(&path, picture).map_err(|error| {
            NodeError::Runtime(format!("cannot write {}: {error}", path.display()))
        })?;
    }
    if options.json {
        say(&json!({"directory": output, "flights": table::to_json(&table)}))?;
    } else {
        let failed = flown.iter().filter(|flown| flown.flight.failure.is_some());
        let mut text = format!("{name}: {} flights, {} failed", flown.len(), failed.count());
        text += &format!("\n  table     {}", output.join("sweep.csv").display());
        if !options.time {
            text += &format!("\n  picture   {}", path.display());
        }
        say(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The table of the flights, with the times that they took if it is `timed`.
fn table_of(combinations: &[Combination], flown: &[Watched], timed: bool) -> Table {
    let flights = flown.iter().map(|flown| &flown.flight);
    let mut table = Table::new(&combinations.iter().zip(flights).collect::<Vec<_>>());
    if timed {
        let times: Vec<_> = flown.iter().map(|flown| flown.wall_time).collect();
        table.add_wall_times(&times);
    }
    table
}

fn fly(
    options: &Options,
    combinations: &[Combination],
    shutdown: &Shutdown,
) -> Result<Vec<Watched>, NodeError> {
    let threads = if options.time { 1 } else { options.threads };
    let drawn = match options.time {
        true => BTreeSet::new(),
        false => picture::drawn(combinations.len()),
    };
    let bar = bars::bar("flying", combinations.len() as u64, "flights");
    let fly = |index: usize, combination: &Combination, go_on: &dyn Fn() -> bool| {
        let scene = options.input.with(combination.settings())?;
        Ok(Watched::of(scene, drawn.contains(&index), go_on))
    };
    let flown = fly_all::<_, NodeError>(combinations, threads, fly, |flown| {
        bar.set_position(flown as u64);
        !shutdown.requested()
    });
    bar.finish_and_clear();
    flown?.ok_or(NodeError::Interrupted)
}
