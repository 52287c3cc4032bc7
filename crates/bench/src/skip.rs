//! What skipping saves in each shipped scene, and what it changes, as a table.

use lgvi_dynamics::auto::Accuracy;
use lgvi_dynamics::{Load, Simulation, Skip};
use lgvi_scene::{Scene, Scheme, Skipping};

use crate::clock::Moment;
use crate::error::BenchError;
use crate::run::{scene, scenes};

/// Seconds that all repetitions of a scene may take, after the second.
const PATIENCE: f64 = 20.0;

/// A flight of a scene.
struct Flight {
    seconds: f64,
    simulation: Simulation,
}

/// Prints the table of the scene called `name`, or of all. Flights with and without skipping take turns; times are of the
/// thread alone.
pub(crate) fn run(name: Option<&str>, repeats: u32) -> Result<(), BenchError> {
    println!(
        "| scene | tolerance | full (ms) | skipped (ms) | full / skipped | spread | position and attitude | switches |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let names = match name {
        Some(name) => vec![name.to_owned()],
        None => {
            let stem = |path: std::path::PathBuf| {
                path.file_stem()
                    .unwrap_or_default()
                    .to_string_lossy()
                    .into_owned()
            };
            scenes()?.into_iter().map(stem).collect()
        }
    };
    for name in names {
        row(&scene(&name)?, repeats)?;
    }
    Ok(())
}

fn row(scene: &Scene, repeats: u32) -> Result<(), BenchError> {
    let skipped = scene.scheme().map_err(refused)?;
    let full = Scheme {
        skip: Skip::Nothing,
        ..skipped
    };
    let [mut least, mut ratios] = [vec![f64::INFINITY; 2], Vec::new()];
    let begun = Moment::now();
    let mut last = None;
    for repeat in 0..repeats.max(2) {
        if repeat > 1 && begun.elapsed() > PATIENCE {
            break;
        }
        let flights = [fly(scene, full)?, fly(scene, skipped)?];
        for (least, flight) in least.iter_mut().zip(&flights) {
            *least = least.min(flight.seconds);
        }
        ratios.push(flights[0].seconds / flights[1].seconds);
        last = Some(flights);
    }
    ratios.sort_by(f64::total_cmp);
    let Some([full, skipped]) = last else {
        return Ok(());
    };
    let states: Vec<_> = scene.bodies.iter().map(|body| body.state).collect();
    let accuracy = Accuracy::new(full.simulation.system().bodies(), &states);
    let error = accuracy.error(skipped.simulation.states(), full.simulation.states());
    let tolerance = match scene.skipping {
        Skipping::Within(tolerance) => format!("{tolerance:.0e}"),
        Skipping::Exact => "exact".into(),
        Skipping::Nothing => "none".into(),
    };
    let difference = if full.simulation.states() == skipped.simulation.states() {
        "same bits".into()
    } else {
        format!("{error:.1e}")
    };
    println!(
        "| {} | {tolerance} | {:.2} | {:.2} | {:.2} | {:.2}–{:.2} | {difference} | {} |",
        scene.name,
        1e3 * least[0],
        1e3 * least[1],
        least[0] / least[1],
        ratios[0],
        ratios[ratios.len() - 1],
        skipped.simulation.switches()
    );
    Ok(())
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
