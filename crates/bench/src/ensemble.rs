//! Throughput of ensembles: lanes beside the simulation, and of two dumbbells two threads beside one, and against size.
//!
//! Ratios are taken within a repetition, in which each way is timed once after the other.

mod cases;

use std::path::Path;
use std::time::Instant;

use clap::Args;
use lgvi_dynamics::lanes::{Flight, Instructions, Member, Outcome, Width, fly};
use lgvi_dynamics::{Load, Simulation};
use lgvi_ensemble::{Campaign, Guidance, Settings, Store, run as fly_ensemble};
use lgvi_scene::Scene;
use nalgebra::Vector3;
use serde::Serialize;

use self::cases::CASES;
use crate::clock::Moment;
use crate::error::{BenchError, write_json};
use crate::picture::{Axis, Curve, Picture};
use crate::spread::Spread;
use crate::tables::Table;

/// What is measured.
#[derive(Args)]
pub(crate) struct Options {
    /// Steps of a flight.
    #[arg(long, default_value_t = STEPS)]
    steps: u64,
    /// Samples of the largest ensemble.
    #[arg(long, default_value_t = LARGEST)]
    samples: u64,
}

const STEPS: u64 = 15_000;

/// Samples of the largest ensemble, and of none smaller than the smallest.
const LARGEST: u64 = 4096;
const SMALLEST: u64 = 16;

const THREADS: [usize; 2] = [1, 2];

const PICTURE: &str = "ensemble.svg";

/// Samples that are flown side by side and one after the other.
const SAMPLES: u64 = 16;

const WAYS: [(Instructions, &str); 3] = [
    (Instructions::Baseline, "SSE2"),
    (Instructions::Avx2, "AVX2"),
    (Instructions::Newest, "newest"),
];

const WIDTHS: [Width; 2] = [Width::One, Width::Eight];

/// Threads and size of an ensemble.
type Size = (usize, u64);

impl Default for Options {
    fn default() -> Self {
        Self {
            steps: STEPS,
            samples: LARGEST,
        }
    }
}

/// What was measured.
#[derive(Default, Serialize)]
struct Figures {
    /// Lanes beside the simulation.
    cases: Vec<Beside>,
    /// Whole runs with their files.
    runs: Vec<Runs>,
}

#[derive(Serialize)]
struct Beside {
    case: &'static str,
    /// Steps a second of the simulation, one sample after the other.
    simulation: Vec<f64>,
    /// Lanes beside that.
    lanes: Vec<Lanes>,
}

#[derive(Serialize)]
struct Lanes {
    instructions: &'static str,
    lanes: usize,
    /// Throughput in multiples of the simulation's of the same repetition.
    ratios: Vec<f64>,
}

#[derive(Serialize)]
struct Runs {
    threads: usize,
    samples: u64,
    /// Steps a second by the clock on the wall.
    rates: Vec<f64>,
}

pub(crate) fn run(options: &Options, repeats: u32, directory: &Path) -> Result<(), BenchError> {
    let mut figures = Figures::default();
    for case in &CASES {
        let scene = case.scene(options.steps)?;
        figures.cases.push(lanes(case.name, &scene, repeats)?);
    }
    let scene = CASES[0].scene(options.steps)?;
    threads(&scene, options, repeats, &mut figures)?;
    lanes_table(&figures).keep(directory, "ensemble_lanes")?;
    runs_table(&figures)
        .below("Throughput against the size of an ensemble", PICTURE)
        .keep(directory, "ensemble_runs")?;
    write_json(&directory.join("ensemble.json"), &figures)?;
    draw(&figures, directory)
}

/// Lanes beside the simulation, by the time that the thread was running.
fn lanes(case: &'static str, scene: &Scene, repeats: u32) -> Result<Beside, BenchError> {
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
    let ratios = |&((_, instructions), width): &((Instructions, &'static str), Width)| Lanes {
        instructions,
        lanes: width.lanes(),
        ratios: Vec::new(),
    };
    let mut beside = Beside {
        case,
        simulation: Vec::new(),
        lanes: ways.iter().map(ratios).collect(),
    };
    let steps = (SAMPLES * scene.steps) as f64;
    for _ in 0..repeats {
        let alone = members(scene)?;
        let begun = Moment::now();
        let expected = simulate(alone, &flight)?;
        let alone = begun.elapsed();
        beside.simulation.push(steps / alone);
        for (((instructions, _), width), lanes) in ways.iter().zip(&mut beside.lanes) {
            let members = members(scene)?;
            let begun = Moment::now();
            let found = fly(&flight, &members, *width, *instructions)
                .map_err(|error| BenchError::Body(error.to_string()))?;
            lanes.ratios.push(alone / begun.elapsed());
            if found != expected {
                return Err(BenchError::Body("lanes end elsewhere".into()));
            }
        }
    }
    Ok(beside)
}

/// A row a case and an instruction set, a column a number of lanes.
fn lanes_table(figures: &Figures) -> Table {
    let columns = WIDTHS.map(|width| match width.lanes() {
        1 => "1 lane".to_owned(),
        lanes => format!("{lanes} lanes"),
    });
    let first = ["flight", "instructions"].map(str::to_owned);
    let mut table = Table::new(first.into_iter().chain(columns));
    for beside in &figures.cases {
        for row in beside.lanes.chunks(WIDTHS.len()) {
            let ratio = |lanes: &Lanes| {
                let spread = Spread::of(lanes.ratios.iter().copied());
                spread.map_or_else(String::new, |spread| spread.to_string())
            };
            let instructions = row.first().map_or("", |first| first.instructions);
            let names = [beside.case, instructions].map(str::to_owned);
            table.row(names.into_iter().chain(row.iter().map(ratio)));
        }
    }
    table
}

/// Throughput against size by one thread, and with two beside one.
fn runs_table(figures: &Figures) -> Table {
    let mut table = Table::new(["samples", "threads", "million steps/s", "beside one thread"]);
    for run in &figures.runs {
        let alone = figures
            .runs
            .iter()
            .find(|other| (other.threads, other.samples) == (1, run.samples));
        let beside = alone.and_then(|alone| Spread::of_ratios(&run.rates, &alone.rates));
        let rate = Spread::of(run.rates.iter().map(|rate| 1e-6 * rate));
        table.row([
            run.samples.to_string(),
            run.threads.to_string(),
            rate.map_or_else(String::new, |rate| rate.to_string()),
            beside
                .filter(|_| run.threads > 1)
                .map_or_else(String::new, |beside| beside.to_string()),
        ]);
    }
    table
}

fn draw(figures: &Figures, directory: &Path) -> Result<(), BenchError> {
    let curve = |threads: usize| Curve {
        label: match threads {
            1 => "1 thread".into(),
            _ => format!("{threads} threads"),
        },
        points: figures
            .runs
            .iter()
            .filter(|run| run.threads == threads)
            .filter_map(|run| {
                let rate = Spread::of(run.rates.iter().copied())?;
                Some([run.samples as f64, rate.median])
            })
            .collect(),
    };
    let picture = Picture {
        title: "throughput against the size of an ensemble".into(),
        horizontal: Axis::logarithmic("samples"),
        vertical: Axis::logarithmic("steps a second"),
    };
    picture.draw(&directory.join(PICTURE), &THREADS.map(curve))
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

fn simulate(members: Vec<Member>, flight: &Flight) -> Result<Vec<Outcome>, BenchError> {
    let mut outcomes = Vec::new();
    for Member { system, states, .. } in members {
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

/// Whole runs with their files, by the clock on the wall, from the largest down.
fn threads(
    scene: &Scene,
    options: &Options,
    repeats: u32,
    figures: &mut Figures,
) -> Result<(), BenchError> {
    let mut samples = options.samples;
    while samples >= SMALLEST.min(options.samples) {
        figures.runs.extend(THREADS.map(|threads| Runs {
            threads,
            samples,
            rates: Vec::new(),
        }));
        samples /= 4;
    }
    for _ in 0..repeats {
        for run in &mut figures.runs {
            run.rates.push(rate(scene, (run.threads, run.samples))?);
        }
    }
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
