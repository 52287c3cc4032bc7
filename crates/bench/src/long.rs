//! Errors of energy and phase over very many orbits, beside peers.

use std::path::Path;
use std::time::Duration;

use lgvi_dynamics::integrator::KeplerScheme;
use lgvi_dynamics::{BodyState, Load, Method, Simulation, Skip};
use lgvi_truth::Case;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::clock::Moment;
use crate::error::{BenchError, write_json};
use crate::peer::{Flyer, HEYOKA, Peer, Python, REBOUND, read_case};
use crate::picture::{Axis, Curve, Picture};
use crate::tables::Table;

/// What is flown.
struct Voyage {
    name: &'static str,
    case: &'static str,
    title: &'static str,
    /// In the case's unit of time.
    period: f64,
    duration: f64,
    /// Steps of methods of equal steps, as a power of two.
    doublings: u32,
}

const VOYAGES: [Voyage; 2] = [
    Voyage {
        name: "long_outer_planets",
        case: "f_outer_planets",
        title: "The outer planets over 1e6 orbits of Jupiter",
        period: 4332.589,
        duration: 4_332_589_000.0,
        doublings: 24,
    },
    Voyage {
        name: "long_kw4",
        case: "e_kw4_like",
        title: "A binary asteroid over 100 years",
        period: 62_640.0,
        duration: 3_155_760_000.0,
        doublings: 20,
    },
];

/// States are compared at the end, at half of the time, a quarter, and so on.
const INSTANTS: u32 = 18;

/// The instant, from the end, whose errors are in the table too: a thousandth of the time.
const EARLY: usize = 10;

/// A peer may fly so long.
const LIMIT: Duration = Duration::from_secs(3600);

/// Of the reference.
const FINEST: Method = Method::Taylor { tolerance: 1e-17 };

/// Errors of a flight, and what it took.
#[derive(Serialize)]
struct Flown {
    method: String,
    setting: String,
    seconds: f64,
    /// At the instants, the last one first: of energy, relative; of positions from that of the first body, relative to
    /// their distance, from the reference.
    energy: Vec<f64>,
    position: Vec<f64>,
}

/// The states at the instants, the last ones first, and the time (s).
struct Flight {
    seconds: f64,
    states: Vec<Vec<BodyState>>,
}

/// Flies both voyages; keeps a table and a picture of each.
pub(crate) fn run(
    quick: bool,
    python: Option<&Python>,
    directory: &Path,
) -> Result<(), BenchError> {
    for voyage in &VOYAGES {
        let rows = fly(voyage, quick, python)?;
        let mut table = Table::new([
            "method",
            "setting",
            "time (s)",
            "energy error after a thousandth",
            "at the end",
            "difference of position after a thousandth",
            "at the end",
        ]);
        for row in &rows {
            let number = |errors: &[f64], at: usize| format!("{:.1e}", errors[at]);
            table.row([
                row.method.clone(),
                row.setting.clone(),
                format!("{:.3}", row.seconds),
                number(&row.energy, EARLY),
                number(&row.energy, 0),
                number(&row.position, EARLY),
                number(&row.position, 0),
            ]);
        }
        let picture = format!("{}.svg", voyage.name);
        table
            .below(voyage.title, &picture)
            .keep(directory, voyage.name)?;
        write_json(&directory.join(format!("{}.json", voyage.name)), &rows)?;
        draw(voyage, &rows, &directory.join(picture))?;
    }
    Ok(())
}

fn draw(voyage: &Voyage, rows: &[Flown], path: &Path) -> Result<(), BenchError> {
    let curve = |row: &Flown, errors: &[f64], what: &str| Curve {
        label: format!("{}: {what}", row.method),
        points: errors
            .iter()
            .enumerate()
            .map(|(instant, error)| {
                let time = voyage.duration * 0.5_f64.powi(instant as i32);
                [time / voyage.period, error.max(f64::EPSILON)]
            })
            .collect(),
    };
    let energy: Vec<_> = rows
        .iter()
        .map(|row| curve(row, &row.energy, "energy"))
        .collect();
    let position: Vec<_> = rows
        .iter()
        .map(|row| curve(row, &row.position, "position"))
        .collect();
    Picture {
        title: voyage.title.into(),
        horizontal: Axis::logarithmic("orbits"),
        vertical: Axis::logarithmic("relative error"),
    }
    .draw_beside(path, &energy, &position)
}

/// All flights of a voyage; in a quick run the first thousandth of it, with as much fewer steps.
fn fly(voyage: &Voyage, quick: bool, python: Option<&Python>) -> Result<Vec<Flown>, BenchError> {
    let data = barycentric(voyage.case)?;
    let case = Case::deserialize(&data).map_err(|error| BenchError::Read {
        path: Case::path(voyage.case),
        source: error.into(),
    })?;
    let (duration, doublings) = if quick {
        (voyage.duration / 1024.0, INSTANTS)
    } else {
        (voyage.duration, voyage.doublings)
    };
    let steps = f64::from(doublings).exp2();
    let reference = own(&case, FINEST, duration, INSTANTS)?;
    let mut rows = Vec::new();
    let mut row = |method: String, setting: String, flight: &Flight| {
        let mut judge = simulation(&case, FINEST, duration)?;
        let start = judge.invariants().energy;
        let (mut energy, mut position) = (Vec::new(), Vec::new());
        for (states, truth) in flight.states.iter().zip(&reference.states) {
            judge.set_states(states)?;
            energy.push(((judge.invariants().energy - start) / start).abs());
            position.push(difference(states, truth));
        }
        rows.push(Flown {
            method,
            setting,
            seconds: flight.seconds,
            energy,
            position,
        });
        Ok::<_, BenchError>(())
    };
    let scheme = KeplerScheme::Aba1064;
    let equal = [
        ("Wisdom–Holman (10, 6, 4)", Method::WisdomHolman { scheme }),
        ("Nyström 8", Method::Nystrom { order: 8 }),
    ];
    let per_orbit = format!("{:.1} steps per orbit", steps * voyage.period / duration);
    for (label, method) in equal {
        let flight = own(&case, method, duration, doublings)?;
        row(label.into(), per_orbit.clone(), &flight)?;
    }
    row("Taylor".into(), "tolerance 1e-17".into(), &reference)?;
    let Some(python) = python.filter(|_| !quick) else {
        return Ok(rows);
    };
    let times: Vec<_> = (0..=INSTANTS)
        .rev()
        .map(|instant| duration * 0.5_f64.powi(instant as i32))
        .collect();
    let peers: [(Peer, &str, f64, String); 3] = [
        (REBOUND, "WHFast", steps, per_orbit),
        (REBOUND, "IAS15", 1e-9, "epsilon 1e-9".into()),
        (HEYOKA, "Taylor", 1e-16, "tolerance 1e-16".into()),
    ];
    for (peer, method, setting, label) in peers {
        if !python.has(peer) {
            continue;
        }
        let mut flyer = Flyer::new(python, peer).patient(LIMIT);
        let offers = flyer.offer_to(data.clone(), &times)?;
        if !offers.iter().any(|offer| offer.name == method) {
            continue;
        }
        let flown = flyer.fly(method, setting)?.map_err(BenchError::Peer)?;
        let judge = simulation(&case, FINEST, duration)?;
        let states = flown.states(judge.system()).into_iter().flatten();
        let mut states: Vec<_> = states.collect();
        states.reverse();
        let flight = Flight {
            seconds: flown.seconds,
            states,
        };
        row(format!("{} {method}", peer.name), label, &flight)?;
    }
    Ok(rows)
}

/// The data of a case, with positions and velocities from the center of mass. Otherwise the center would move far away in
/// so long a flight, and every position would carry the rounding of that distance.
fn barycentric(name: &str) -> Result<Value, BenchError> {
    let mut data = read_case(name)?;
    let bodies = data["bodies"].as_array_mut().into_iter().flatten();
    let mut bodies: Vec<_> = bodies.collect();
    let mass = |body: &Value| body["mass"].as_f64().unwrap_or(0.0);
    let total: f64 = bodies.iter().map(|body| mass(body)).sum();
    for key in ["x", "v"] {
        for axis in 0..3 {
            let of = |body: &Value| body[key][axis].as_f64().unwrap_or(0.0);
            let center = bodies.iter().map(|body| mass(body) * of(body)).sum::<f64>() / total;
            for body in &mut *bodies {
                body[key][axis] = (of(body) - center).into();
            }
        }
    }
    Ok(data)
}

fn simulation(case: &Case, method: Method, h: f64) -> Result<Simulation, BenchError> {
    let (system, states) = case.system()?;
    Ok(Simulation::new(system, states, method, h)?.with_skips(Skip::Exact))
}

/// A flight of ours in `2^doublings` steps.
fn own(case: &Case, method: Method, duration: f64, doublings: u32) -> Result<Flight, BenchError> {
    let steps = 1_u64 << doublings;
    let mut simulation = simulation(case, method, duration / steps as f64)?;
    let controls = vec![Load::default(); simulation.states().len()];
    let mut states = Vec::new();
    let begun = Moment::now();
    for step in 1..=steps {
        simulation.advance(&controls)?;
        if step.is_power_of_two() && step >= steps >> INSTANTS {
            states.push(simulation.states().to_vec());
        }
    }
    let seconds = begun.elapsed();
    states.reverse();
    Ok(Flight { seconds, states })
}

/// The greatest difference of a position from that of the first body, relative to their distance.
fn difference(states: &[BodyState], truth: &[BodyState]) -> f64 {
    let place = |states: &[BodyState], body: usize| states[body].position - states[0].position;
    (1..states.len())
        .map(|body| {
            let expected = place(truth, body);
            (place(states, body) - expected).norm() / expected.norm()
        })
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energy_and_phase_are_kept_over_a_thousandth_of_the_time() {
        let folder = tempfile::tempdir().unwrap();
        run(true, None, folder.path()).unwrap();
        for voyage in &VOYAGES {
            let rows = fly(voyage, true, None).unwrap();
            assert_eq!(rows.len(), 3);
            for row in rows {
                assert_eq!(row.energy.len(), INSTANTS as usize + 1);
                let (energy, position) = (row.energy[0], row.position[0]);
                assert!(energy < 1e-11, "{}: {energy:e}", row.method);
                assert!(position < 1e-5, "{}: {position:e}", row.method);
            }
            assert!(folder.path().join(format!("{}.svg", voyage.name)).exists());
        }
    }
}
