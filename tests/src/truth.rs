//! Reference data of `tests/truth`, made by methods independent of this project.

use std::fs;

use lgvi_msgs::msg::SystemState;
use serde_json::Value;

use crate::root;

/// A reference trajectory in units that are SI units.
#[derive(Debug)]
pub struct Trajectory(Value);

/// How far a state is from the reference: norms of differences, the largest over the bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Of positions (m).
    pub position: f64,
    /// Of velocities (m/s).
    pub velocity: f64,
    /// Of attitude matrices, Frobenius.
    pub attitude: f64,
    /// Of angular velocities, body frame [rad/s].
    pub angular_velocity: f64,
}

fn load(name: &str) -> Value {
    let path = root().join("tests/truth").join(name).with_extension("json");
    let text =
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).expect("reference data")
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The cost of an optimal maneuver in `steps` steps.
pub fn optimal_cost(problem: &str, steps: u64) -> f64 {
    let runs = &load("optimal_control")[problem]["runs"];
    let run = runs
        .as_array()
        .expect("runs")
        .iter()
        .find(|run| run["N"] == steps);
    number(&run.expect("a run of so many steps")["cost"])
}

impl Trajectory {
    /// A file of `tests/truth`.
    pub fn load(name: &str) -> Self {
        Self(load(name))
    }

    /// Compares a state with the reference at its time.
    pub fn deviation(&self, state: &SystemState) -> Deviation {
        let states = self.0["states"].as_array().expect("states");
        let reference = states
            .iter()
            .find(|reference| number(&reference["t"]) == state.time);
        let reference: Vec<f64> = reference
            .unwrap_or_else(|| panic!("no reference at {} s", state.time))["y"]
            .as_array()
            .expect("y")
            .iter()
            .map(number)
            .collect();
        let bodies = self.0["bodies"].as_array().expect("bodies");
        assert_eq!(state.bodies.len(), bodies.len());
        let mut worst = Deviation::default();
        for ((body, found), expected) in bodies.iter().zip(&state.bodies).zip(reference.chunks(18))
        {
            let mass = number(&body["mass"]);
            let velocity = found.linear_momentum.map(|momentum| momentum / mass);
            let omega: [f64; 3] =
                std::array::from_fn(|i| found.angular_momentum[i] / number(&body["J"][i]));
            for (error, found, expected) in [
                (&mut worst.position, &found.position[..], &expected[..3]),
                (&mut worst.velocity, &velocity, &expected[3..6]),
                (&mut worst.attitude, &found.attitude, &expected[6..15]),
                (&mut worst.angular_velocity, &omega, &expected[15..]),
            ] {
                *error = error.max(distance(found, expected));
            }
        }
        worst
    }
}

fn distance(left: &[f64], right: &[f64]) -> f64 {
    left.iter()
        .zip(right)
        .map(|(left, right)| (left - right).powi(2))
        .sum::<f64>()
        .sqrt()
}

impl Deviation {
    /// Its four numbers.
    pub fn parts(&self) -> [f64; 4] {
        [
            self.position,
            self.velocity,
            self.attitude,
            self.angular_velocity,
        ]
    }

    /// Whether no part exceeds the bound's.
    pub fn within(&self, bound: &Self) -> bool {
        self.parts()
            .iter()
            .zip(bound.parts())
            .all(|(part, bound)| *part <= bound)
    }
}
