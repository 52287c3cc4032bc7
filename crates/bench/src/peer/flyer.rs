//! Peers that integrate, by the protocol of `peers/protocol.py`.

use lgvi_dynamics::{BodyState, System};
use lgvi_truth::Case;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::{Peer, Process, Python};
use crate::error::BenchError;

/// By what a method is tuned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Tuning {
    /// The number of steps to the last time.
    Steps,
    /// A tolerance, whose meaning is the method's own.
    Tolerance,
}

/// Numbers of a body's state: x, v, R by rows, Ω.
const WIDTH: usize = 18;

/// A method that a peer offers for a case.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Offer {
    pub name: String,
    pub tuning: Tuning,
}

/// Time (s) and the states at the case's times: 18 numbers a body, nothing where no step ends.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct PeerFlight {
    pub seconds: f64,
    states: Vec<Option<Vec<f64>>>,
}

/// A peer that integrates.
pub(crate) struct Flyer {
    process: Process,
    /// Name and version.
    pub version: String,
    pub name: &'static str,
}

#[derive(Deserialize)]
struct Ready {
    peer: String,
}

#[derive(Deserialize)]
struct Methods {
    methods: Vec<Offer>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Answer {
    Flown(PeerFlight),
    Failed { failed: String },
}

impl Flyer {
    pub(crate) fn start(python: &Python, peer: Peer) -> Result<Self, BenchError> {
        let mut process = Process::start(python, peer)?;
        let Ready { peer: version } = process.hear()?;
        Ok(Self {
            process,
            version,
            name: peer.name,
        })
    }

    /// What can fly the reference case called `name` to `times`, until another is offered.
    pub(crate) fn offer_case(
        &mut self,
        name: &str,
        times: &[f64],
    ) -> Result<Vec<Offer>, BenchError> {
        let path = Case::path(name);
        let refuse = |source| BenchError::Read {
            path: path.clone(),
            source,
        };
        let text = std::fs::read_to_string(&path).map_err(refuse)?;
        let mut case: Value = serde_json::from_str(&text).map_err(|error| refuse(error.into()))?;
        case["states"] = Value::Null;
        case["times"] = times.into();
        self.offer(&case)
    }

    /// What can fly the case until another is offered.
    pub(crate) fn offer(&mut self, case: &Value) -> Result<Vec<Offer>, BenchError> {
        let Methods { methods } = self.process.ask(&json!({ "case": case }))?;
        Ok(methods)
    }

    /// A flight, or why there is none.
    pub(crate) fn fly(
        &mut self,
        method: &str,
        setting: f64,
    ) -> Result<Result<PeerFlight, String>, BenchError> {
        let request = json!({ "fly": method, "setting": setting });
        Ok(match self.process.ask(&request)? {
            Answer::Flown(flight) => Ok(flight),
            Answer::Failed { failed } => Err(failed),
        })
    }
}

impl PeerFlight {
    /// The states of the bodies at each time.
    pub(crate) fn states(&self, system: &System) -> Vec<Option<Vec<BodyState>>> {
        let width = WIDTH * system.bodies().len();
        let full = |numbers: &&Vec<f64>| numbers.len() == width;
        let states = |numbers: &Vec<f64>| {
            let bodies = system.bodies().iter().zip(numbers.chunks(WIDTH));
            bodies
                .map(|(body, y)| {
                    let at = |from: usize| Vector3::from_column_slice(&y[from..from + 3]);
                    let attitude = Matrix3::from_row_slice(&y[6..15]);
                    BodyState::from_velocities(body, at(0), at(3), attitude, at(15))
                })
                .collect()
        };
        let reached = self.states.iter();
        reached
            .map(|numbers| numbers.as_ref().filter(full).map(states))
            .collect()
    }
}
