//! What skipping saves in each shipped scene, and what it changes.

use std::path::Path;

use lgvi_dynamics::Accuracy;
use lgvi_dynamics::{Load, Simulation, Skip};
use lgvi_scene::{Scene, Scheme, Skipping};
use serde::Serialize;

use crate::clock::Moment;
use crate::error::{BenchError, write_json};
use crate::run::{scene, scenes};
use crate::spread::{Spread, short};
use crate::tables::Table;

/// Seconds that all repetitions of a scene may take, after the second.
const PATIENCE: f64 = 20.0;

/// A flight of a scene.
struct Flight {
    seconds: f64,
    simulation: Simulation,
}

/// What was measured of a scene.
#[derive(Serialize)]
struct Row {
    scene: String,
    /// None where only what is exact is left out.
    tolerance: Option<f64>,
    full_seconds: Vec<f64>,
    skipped_seconds: Vec<f64>,
    /// Of positions and attitudes at the end, beside the scene's size; none where every bit is the same.
    difference: Option<f64>,
    switches: u64,
}

/// The table of the scene called `name`, or of all that leave something out. Flights with and without skipping take turns;
/// times are of the thread alone.
pub(crate) fn run(name: Option<&str>, repeats: u32, directory: &Path) -> Result<(), BenchError> {
    let names = match name {
        Some(name) => vec![name.to_owned()],
        None => scenes()?,
    };
    let mut table = Table::new([
        "scene",
        "tolerance",
        "in full (ms)",
        "with skipping (ms)",
        "in full over with skipping",
        "difference at the end",
        "changes of level",
    ]);
    let mut rows = Vec::new();
    for name in names {
        let scene = scene(&name)?;
        if scene.skipping == Skipping::Nothing {
            println!("{name}: nothing is left out");
            continue;
        }
        let row = measure(&scene, repeats)?;
        table.row(cells(&row));
        rows.push(row);
    }
    write_json(&directory.join("skip.json"), &rows)?;
    table.keep(directory, "skip")
}

fn measure(scene: &Scene, repeats: u32) -> Result<Row, BenchError> {
    let skipped = scene.scheme().map_err(refused)?;
    let full = Scheme {
        skip: Skip::Nothing,
        ..skipped
    };
    let mut row = Row {
        scene: scene.name.clone(),
        tolerance: match scene.skipping {
            Skipping::Within(tolerance) => Some(tolerance),
            Skipping::Exact | Skipping::Nothing => None,
        },
        full_seconds: Vec::new(),
        skipped_seconds: Vec::new(),
        difference: None,
        switches: 0,
    };
    let begun = Moment::now();
    for repeat in 0..repeats.max(2) {
        if repeat > 1 && begun.elapsed() > PATIENCE {
            break;
        }
        let [full, skipped] = [fly(scene, full)?, fly(scene, skipped)?];
        row.full_seconds.push(full.seconds);
        row.skipped_seconds.push(skipped.seconds);
        let [full, skipped] = [full.simulation, skipped.simulation];
        row.switches = skipped.switches();
        if full.states() != skipped.states() {
            let states: Vec<_> = scene.bodies.iter().map(|body| body.state).collect();
            let accuracy = Accuracy::new(full.system().bodies(), &states);
            row.difference = Some(accuracy.error(skipped.states(), full.states()));
        }
    }
    Ok(row)
}

fn cells(row: &Row) -> [String; 7] {
    let time = |seconds: &[f64]| {
        let spread = Spread::of(seconds.iter().copied());
        spread.map_or_else(String::new, |spread| short(1e3 * spread.median))
    };
    let ratio = Spread::of_ratios(&row.full_seconds, &row.skipped_seconds);
    [
        row.scene.clone(),
        row.tolerance
            .map_or_else(|| "exact".into(), |tolerance| format!("{tolerance:.0e}")),
        time(&row.full_seconds),
        time(&row.skipped_seconds),
        ratio.map_or_else(String::new, |ratio| ratio.to_string()),
        row.difference
            .map_or_else(|| "same bits".into(), |error| format!("{error:.1e}")),
        row.switches.to_string(),
    ]
}

/// Flies the whole scene without controls.
fn fly(scene: &Scene, scheme: Scheme) -> Result<Flight, BenchError> {
    let mut simulation = scene.simulation(scheme).map_err(refused)?;
    let controls = vec![Load::default(); scene.bodies.len()];
    let begun = Moment::now();
    for _ in 0..scene.steps {
        simulation.advance(&controls)?;
    }
    Ok(Flight {
        seconds: begun.elapsed(),
        simulation,
    })
}

fn refused(error: lgvi_scene::SchemeError) -> BenchError {
    BenchError::Body(error.to_string())
}
