//! How far disturbed flights of a plan miss, with and without feedback and new plans on the way.

use std::path::Path;

use serde::Serialize;

use crate::corrected::{Correction, Noise, Task};
use crate::error::{BenchError, write_json};
use crate::maneuvers::quantile;
use crate::picture::{Axis, Curve, Picture};
use crate::tables::Table;

const SCENES: [&str; 2] = ["inclination_change", "orbital_capture"];

/// New plans in a flight.
const PLANS: usize = 10;

/// Thrust errors of 1 %; a state known to a thousandth of the orbit's radius and its velocity, and to 0.3°.
const NOISE: Noise = Noise {
    thrust: 0.01,
    translation: 1e-3,
    rotation: 5e-3,
};

pub(crate) const CORRECTIONS: [(&str, Correction); 4] = [
    (
        "open loop",
        Correction {
            feedback: false,
            plans: None,
        },
    ),
    (
        "feedback",
        Correction {
            feedback: true,
            plans: None,
        },
    ),
    (
        "new plans",
        Correction {
            feedback: false,
            plans: Some(PLANS),
        },
    ),
    (
        "new plans and feedback",
        Correction {
            feedback: true,
            plans: Some(PLANS),
        },
    ),
];

/// Arrivals of many flights: median and 95th percentile.
#[derive(Serialize)]
struct Row {
    scene: &'static str,
    correction: &'static str,
    flights: u64,
    position: [f64; 2],
    velocity: [f64; 2],
    attitude: [f64; 2],
    angular_momentum: [f64; 2],
    cost: [f64; 2],
    /// Newton steps of new plans.
    iterations: [f64; 2],
    /// Their time for an interval, in units of that of the plan from nothing.
    time: [f64; 2],
}

#[derive(Serialize)]
struct Report {
    intervals: usize,
    plans: usize,
    thrust_error: f64,
    translation_noise: f64,
    rotation_noise: f64,
    rows: Vec<Row>,
}

/// Flies both examples of §4.7; prints a table, writes `feedback.json` and draws the distributions of the position error.
pub(crate) fn run(flights: u64, intervals: usize, directory: &Path) -> Result<(), BenchError> {
    println!(
        "{flights} flights of {intervals} steps; thrust errors {}, translation {}, rotation {}; {PLANS} new plans a flight",
        NOISE.thrust, NOISE.translation, NOISE.rotation
    );
    println!(
        "median and 95 % of the arrival error; median cost; iterations of a new plan, and its time for an interval beside that \
         of the plan from nothing"
    );
    let mut table = Table::new([
        "scene",
        "correction",
        "position",
        "attitude",
        "velocity",
        "angular momentum",
        "cost",
        "iterations",
        "time",
    ]);
    let mut rows = Vec::new();
    for scene in SCENES {
        let task = Task::load(scene, intervals)?;
        let mut curves = Vec::new();
        for (label, correction) in CORRECTIONS {
            let (row, positions) = measure(&task, scene, label, correction, flights)?;
            table.row(row.cells());
            rows.push(row);
            curves.push(Curve {
                label: label.into(),
                points: (1..)
                    .zip(positions)
                    .map(|(rank, error)| [error, 100.0 * f64::from(rank) / flights as f64])
                    .collect(),
            });
        }
        let picture = Picture {
            title: format!("{scene}: arrivals of {flights} disturbed flights"),
            horizontal: Axis::logarithmic("position error"),
            vertical: Axis::linear("flights (%)"),
        };
        picture.draw(&directory.join(format!("feedback_{scene}.svg")), &curves)?;
    }
    table.print();
    positions(&rows).keep(directory, "feedback")?;
    let report = Report {
        intervals,
        plans: PLANS,
        thrust_error: NOISE.thrust,
        translation_noise: NOISE.translation,
        rotation_noise: NOISE.rotation,
        rows,
    };
    write_json(&directory.join("feedback.json"), &report)
}

/// Position errors at arrival, a column a scene.
fn positions(rows: &[Row]) -> Table {
    let scenes = SCENES.map(|scene| scene.replace('_', " "));
    let mut table = Table::new(std::iter::once(String::new()).chain(scenes));
    for (label, _) in CORRECTIONS {
        let of_this = rows.iter().filter(|row| row.correction == label);
        let cells = of_this.map(|row| error(row.position));
        table.row(std::iter::once(label.to_owned()).chain(cells));
    }
    table
}

/// Median and 95 %.
fn error([median, most]: [f64; 2]) -> String {
    format!("{median:.1e}, {most:.1e}")
}

/// The row and the sorted position errors.
fn measure(
    task: &Task,
    scene: &'static str,
    correction: &'static str,
    law: Correction,
    flights: u64,
) -> Result<(Row, Vec<f64>), BenchError> {
    let mut errors: [Vec<f64>; 4] = Default::default();
    let (mut costs, mut iterations, mut times) = (Vec::new(), Vec::new(), Vec::new());
    for flight in 0..flights {
        let arrival = task.fly(flight, &NOISE, law)?;
        for (which, errors) in errors.iter_mut().enumerate() {
            errors.push(arrival.miss.fixed_rows::<3>(3 * which).norm());
        }
        costs.push(arrival.cost);
        for [steps, time] in arrival.replans {
            iterations.push(steps);
            times.push(time / task.cold);
        }
    }
    let spread = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        [0.5, 0.95].map(|part| quantile(values, part))
    };
    let [position, velocity, attitude, angular_momentum] = errors.each_mut().map(spread);
    let row = Row {
        scene,
        correction,
        flights,
        position,
        velocity,
        attitude,
        angular_momentum,
        cost: spread(&mut costs),
        iterations: spread(&mut iterations),
        time: spread(&mut times),
    };
    let [positions, ..] = errors;
    Ok((row, positions))
}

impl Row {
    fn cells(&self) -> [String; 9] {
        let [cost, _] = self.cost;
        let (iterations, time) = match (self.iterations, self.time) {
            ([median, _], _) if median.is_nan() => (String::new(), String::new()),
            ([median, most], [time, longest]) => (
                format!("{median:.0}, {most:.0}"),
                format!("{time:.2}, {longest:.2}"),
            ),
        };
        [
            self.scene.replace('_', " "),
            self.correction.into(),
            error(self.position),
            error(self.attitude),
            error(self.velocity),
            error(self.angular_momentum),
            format!("{cost:.3}"),
            iterations,
            time,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrected_flights_arrive_nearer_than_those_in_open_loop() {
        let task = Task::load("inclination_change", 60).unwrap();
        let rows = CORRECTIONS.map(|(label, law)| measure(&task, "", label, law, 11).unwrap().0);
        let [open, feedback, plans, both] = rows;
        for corrected in [feedback, plans, both] {
            for (error, open) in [
                (corrected.position, open.position),
                (corrected.velocity, open.velocity),
                (corrected.attitude, open.attitude),
            ] {
                assert!(
                    error[0] < 0.3 * open[0],
                    "{}: {error:?} for {open:?}",
                    corrected.correction
                );
            }
        }
    }
}
