//! The paper's two-dumbbell figure (§3.4): energy over time, and mean energy error, orthogonality error and CPU time
//! against the step, for LGVI, explicit midpoint (RK), implicit midpoint (SRK) and Crouch–Grossman (LGM).

use std::path::Path;

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Load, Method, Simulation};
use lgvi_truth::Case;

use crate::clock::Moment;
use crate::error::BenchError;
use crate::picture::{Axis, Curve, Picture};
use crate::spread::Spread;

const METHODS: [(&str, Method); 4] = [
    ("LGVI", Method::Lgvi(Rotor::Discrete)),
    ("RK (explicit midpoint)", Method::ExplicitMidpoint),
    ("SRK (implicit midpoint)", Method::ImplicitMidpoint),
    ("LGM (Crouch–Grossman)", Method::CrouchGrossman),
];

const CASE: &str = "a1_two_dumbbells_regular";

/// The paper's step and duration.
const H: f64 = 0.002;
const DURATION: f64 = 30.0;

/// A hundred times as long: where a drift shows.
const LONG: f64 = 3000.0;

/// Steps of the sweep, as parts of `DURATION`.
const STEPS: [u64; 7] = [3_750, 7_500, 15_000, 30_000, 60_000, 120_000, 240_000];

/// Points of a curve over time.
const SAMPLES: u64 = 300;

/// What a flight showed.
struct Measured {
    /// `[t, |E(t) − E(0)|]`, the mean over the steps since the last point.
    energy: Vec<[f64; 2]>,
    mean_energy_error: f64,
    orthogonality_error: f64,
}

pub(crate) fn run(repeats: u32, images: &Path) -> Result<(), BenchError> {
    let case = Case::load(CASE)?;
    over_time(&case, images)?;
    against_step(&case, repeats, images)
}

fn over_time(case: &Case, images: &Path) -> Result<(), BenchError> {
    for (duration, name) in [(DURATION, "energy"), (LONG, "energy_long")] {
        let steps = (duration / H).round() as u64;
        println!("\nmean |ΔE| at h = {H}, t = {duration}");
        let mut curves = Vec::new();
        for (label, method) in METHODS {
            let measured = measure(case, method, duration, steps)?;
            println!("{label:28}{:12.3e}", measured.mean_energy_error);
            curves.push(Curve {
                label: label.into(),
                points: measured.energy,
            });
        }
        let picture = Picture {
            title: format!("Two dumbbells, energy error, h = {H}"),
            horizontal: Axis::linear("time"),
            vertical: Axis::logarithmic("|E − E(0)|"),
        };
        picture.draw(&images.join(format!("dumbbells_{name}.svg")), &curves)?;
    }
    Ok(())
}

fn against_step(case: &Case, repeats: u32, images: &Path) -> Result<(), BenchError> {
    let mut pictures: [(&str, &str, Vec<Curve>); 3] = [
        ("energy_step", "mean |ΔE|", vec![]),
        ("orthogonality_step", "mean |RᵀR − I|", vec![]),
        ("time_step", "CPU time (s)", vec![]),
    ];
    let times = times(case, repeats)?;
    println!(
        "\n{:28}{:>12}{:>14}{:>16}{:>14}",
        "t = 30", "h", "mean |ΔE|", "mean |RᵀR − I|", "CPU time (ms)"
    );
    for ((label, method), times) in METHODS.into_iter().zip(times) {
        let mut points = [vec![], vec![], vec![]];
        for (steps, times) in STEPS.into_iter().zip(times) {
            let measured = measure(case, method, DURATION, steps)?;
            let time = Spread::of(times).map_or(f64::NAN, |spread| spread.median);
            let h = DURATION / steps as f64;
            let values = [
                measured.mean_energy_error,
                measured.orthogonality_error,
                time,
            ];
            for (points, value) in points.iter_mut().zip(values) {
                points.push([h, value]);
            }
            println!(
                "{label:28}{h:12.2e}{:14.2e}{:16.2e}{:14.3}",
                values[0],
                values[1],
                1e3 * values[2]
            );
        }
        for ((_, _, curves), points) in pictures.iter_mut().zip(points) {
            curves.push(Curve {
                label: label.into(),
                points,
            });
        }
    }
    for (name, label, curves) in &pictures {
        let picture = Picture {
            title: format!("Two dumbbells to t = {DURATION}"),
            horizontal: Axis::logarithmic("step h"),
            vertical: Axis::logarithmic(label),
        };
        picture.draw(&images.join(format!("dumbbells_{name}.svg")), curves)?;
    }
    Ok(())
}

fn simulation(case: &Case, method: Method, h: f64) -> Result<Simulation, BenchError> {
    let (system, states) = case.system()?;
    Ok(Simulation::new(system, states, method, h)?)
}

/// Times (s) of the sweep's flights, by method and step, in turns.
fn times(
    case: &Case,
    repeats: u32,
) -> Result<[[Vec<f64>; STEPS.len()]; METHODS.len()], BenchError> {
    let mut times = [const { [const { Vec::new() }; STEPS.len()] }; METHODS.len()];
    for _ in 0..repeats {
        for ((_, method), times) in METHODS.into_iter().zip(&mut times) {
            for (steps, times) in STEPS.into_iter().zip(times) {
                let mut flight = simulation(case, method, DURATION / steps as f64)?;
                let controls = vec![Load::default(); flight.states().len()];
                let begun = Moment::now();
                for _ in 0..steps {
                    flight.advance(&controls)?;
                }
                times.push(begun.elapsed());
            }
        }
    }
    Ok(times)
}

/// Flies once with a look at the invariants after each step.
fn measure(case: &Case, method: Method, duration: f64, steps: u64) -> Result<Measured, BenchError> {
    let mut flight = simulation(case, method, duration / steps as f64)?;
    let controls = vec![Load::default(); flight.states().len()];
    let start = flight.invariants().energy;
    let (mut energy, mut energy_sum, mut orthogonality_sum) = (Vec::new(), 0.0, 0.0);
    let stride = (steps / SAMPLES).max(1);
    let mut since = 0.0;
    for step in 1..=steps {
        flight.advance(&controls)?;
        let invariants = flight.invariants();
        let error = (invariants.energy - start).abs();
        energy_sum += error;
        since += error;
        orthogonality_sum += invariants.orthogonality_error;
        if step % stride == 0 {
            energy.push([flight.time(), since / stride as f64]);
            since = 0.0;
        }
    }
    Ok(Measured {
        energy,
        mean_energy_error: energy_sum / steps as f64,
        orthogonality_error: orthogonality_sum / steps as f64,
    })
}
