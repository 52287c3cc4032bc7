//! Throughput of ensembles of two dumbbells: lanes beside the simulation, two threads beside one, and against size.
//!
//! Ratios are taken within a repetition, in which each way is timed once after the other.

use std::time::Instant;

use clap::Args;
use lgvi_dynamics::lanes::{Flight, Instructions, Member, Outcome, Width, fly};
use lgvi_dynamics::{Load, Simulation};
use lgvi_ensemble::{Campaign, Guidance, Settings, Store, run as fly_ensemble};
use lgvi_scene::Scene;
use nalgebra::Vector3;

use crate::clock::Moment;
use crate::error::BenchError;
use crate::run::scene;

/// What is measured.
#[derive(Args)]
pub(crate) struct Options {
    /// Steps of a flight.
    #[arg(long, default_value_t = 15_000)]
    steps: u64,
    /// Samples of the largest ensemble.
    #[arg(long, default_value_t = 4096)]
    samples: u64,
}

const SPREAD: &str = r#"
[ensemble]
samples = 1
seed = 1

[[ensemble.bodies]]
body = "dumbbell1"
position = 0.001
attitude = 0.01
inertia = 0.01

[[ensemble.bodies]]
body = "dumbbell2"
velocity = 0.001
mass = 0.01
"#;

/// Samples that are flown side by side and one after the other.
const SAMPLES: u64 = 16;

const WAYS: [(Instructions, &str); 3] = [
    (Instructions::Baseline, "SSE2"),
    (Instructions::Avx2, "AVX2"),
    (Instructions::Newest, "newest"),
];

const WIDTHS: [Width; 3] = [Width::One, Width::Four, Width::Eight];

/// Threads and size of an ensemble.
type Size = (usize, u64);

pub(crate) fn run(options: &Options, repeats: u32) -> Result<(), BenchError> {
    let plain = scene("two_dumbbells")?;
    let text = format!("{}{SPREAD}", plain.text);
    let text = text.replace("steps = 15000", &format!("steps = {}", options.steps));
    let scene = Scene::parse("two_dumbbells", &text).map_err(|source| BenchError::Scene {
        name: "two_dumbbells".into(),
        source,
    })?;
    lanes(&scene, repeats)?;
    threads(&scene, options, repeats)
}

/// Lanes beside the simulation, by the time that the thread was running.
fn lanes(scene: &Scene, repeats: u32) -> Result<(), BenchError> {
    let scheme = scene
        .scheme()
        .map_err(|error| BenchError::Body(error.to_string()))?;
    let flight = Flight {
        method: scheme.method,
        h: scene.h(),
        substeps: scheme.substeps,
        steps: scene.steps,
        thrust: None,
    };
    let ways: Vec<_> = WAYS
        .into_iter()
        .flat_map(|way| WIDTHS.map(|width| (way, width)))
        .collect();
    let mut simulated = Vec::new();
    let mut ratios = vec![Vec::new(); ways.len()];
    for _ in 0..repeats {
        let begun = Moment::now();
        let expected = simulate(scene, &flight)?;
        let alone = begun.elapsed();
        simulated.push(alone);
        for (((instructions, _), width), ratios) in ways.iter().zip(&mut ratios) {
            let members = members(scene)?;
            let begun = Moment::now();
            let found = fly(&flight, &members, *width, *instructions)
                .map_err(|error| BenchError::Body(error.to_string()))?;
            ratios.push(alone / begun.elapsed());
            if found != expected {
                return Err(BenchError::Body("lanes end elsewhere".into()));
            }
        }
    }
    let steps = (SAMPLES * scene.steps) as f64;
    let rates = simulated.iter().map(|seconds| 1e-6 * steps / seconds);
    println!("simulation: {} million steps/s", spread(rates));
    for (((_, name), width), ratios) in ways.iter().zip(&ratios) {
        let ratios = spread(ratios.iter().copied());
        println!("{name}, {} lanes: {ratios} times that", width.lanes());
    }
    Ok(())
}

fn members(scene: &Scene) -> Result<Vec<Member>, BenchError> {
    let Some(ensemble) = &scene.ensemble else {
        return Err(BenchError::Body("no ensemble".into()));
    };
    let member = |index| {
        let (system, states) = ensemble
            .sample(index)
            .system(scene)
            .map_err(|error| BenchError::Body(error.to_string()))?;
        Ok(Member {
            system,
            states,
            force: Vector3::repeat(1.0),
            moment: Vector3::repeat(1.0),
        })
    };
    (0..SAMPLES).map(member).collect()
}

fn simulate(scene: &Scene, flight: &Flight) -> Result<Vec<Outcome>, BenchError> {
    let mut outcomes = Vec::new();
    for Member { system, states, .. } in members(scene)? {
        let none = vec![Load::default(); states.len()];
        let mut simulation = Simulation::new(system, states, flight.method, flight.h)?;
        for _ in 0..flight.steps {
            simulation.advance(&none)?;
        }
        outcomes.push(Outcome {
            states: simulation.states().to_vec(),
            steps: flight.steps,
            failure: None,
        });
    }
    Ok(outcomes)
}

/// Whole runs with their files, by the clock on the wall.
fn threads(scene: &Scene, options: &Options, repeats: u32) -> Result<(), BenchError> {
    let mut sizes: Vec<Size> = vec![(1, options.samples), (2, options.samples)];
    let mut size = options.samples;
    while size > 16 {
        size /= 4;
        sizes.push((1, size));
    }
    let mut rates = vec![Vec::new(); sizes.len()];
    for _ in 0..repeats {
        for (size, rates) in sizes.iter().zip(&mut rates) {
            rates.push(rate(scene, *size)?);
        }
    }
    for ((threads, samples), rates) in sizes.iter().zip(&rates) {
        let rates = rates.iter().map(|rate| 1e-6 * rate);
        println!(
            "{samples} samples, {threads} threads: {} million steps/s",
            spread(rates)
        );
    }
    let ratios = rates[1].iter().zip(&rates[0]).map(|(two, one)| two / one);
    println!("two threads: {} times one", spread(ratios));
    Ok(())
}

/// Steps a second.
fn rate(scene: &Scene, (threads, samples): Size) -> Result<f64, BenchError> {
    let refuse = |error: &dyn std::fmt::Display| BenchError::Body(error.to_string());
    let settings = Settings {
        samples: Some(samples),
        seed: None,
    };
    let campaign =
        Campaign::new(scene, settings, Guidance::None).map_err(|error| refuse(&error))?;
    let directory = tempfile::tempdir().map_err(|error| refuse(&error))?;
    let store = Store::create(directory.path(), campaign.identity(), campaign.columns())
        .map_err(|error| refuse(&error))?;
    let options = lgvi_ensemble::Options {
        range: None,
        threads,
        width: Width::default(),
    };
    let begun = Instant::now();
    fly_ensemble(&campaign, &store, &options, &|| false, &mut |_| ())
        .map_err(|error| refuse(&error))?;
    Ok((samples * scene.steps) as f64 / begun.elapsed().as_secs_f64())
}

/// The median, and the least and the greatest.
fn spread(values: impl Iterator<Item = f64>) -> String {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    match values[..] {
        [] => "no".into(),
        [least, .., greatest] => {
            let median = values[values.len() / 2];
            format!("{median:.2} ({least:.2} to {greatest:.2})")
        }
        [only] => format!("{only:.2}"),
    }
}
