//! Peers that integrate, by the protocol of `peers/protocol.py`.

use std::time::Duration;

use lgvi_dynamics::{BodyState, System};
use lgvi_truth::Case;
use nalgebra::{Matrix3, Vector3};
use serde::de::DeserializeOwned;
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

/// How long a peer may take for an answer: all its repeated flights, and what it compiles before.
const LIMIT: Duration = Duration::from_secs(180);

/// A peer that integrates. One that has died or hangs is gone until a case is offered, which starts it anew.
pub(crate) struct Flyer {
    python: Python,
    peer: Peer,
    process: Option<Process>,
    /// Name and version, once it has been started.
    pub version: String,
    pub name: &'static str,
    limit: Duration,
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
struct Timed {
    seconds: f64,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Answer<Good> {
    Good(Good),
    Failed { failed: String },
}

impl<Good> Answer<Good> {
    fn result(self) -> Result<Good, String> {
        match self {
            Self::Good(good) => Ok(good),
            Self::Failed { failed } => Err(failed),
        }
    }
}

impl Flyer {
    /// It is started when a case is offered.
    pub(crate) fn new(python: &Python, peer: Peer) -> Self {
        Self {
            python: python.clone(),
            peer,
            process: None,
            version: String::new(),
            name: peer.name,
            limit: LIMIT,
        }
    }

    /// It may take this long for an answer.
    pub(crate) fn patient(self, limit: Duration) -> Self {
        Self { limit, ..self }
    }

    /// What can fly the reference case called `name` to `times`, until another is offered.
    pub(crate) fn offer_case(
        &mut self,
        name: &str,
        times: &[f64],
    ) -> Result<Vec<Offer>, BenchError> {
        self.offer_to(read_case(name)?, times)
    }

    /// What can fly a case to `times`, until another is offered.
    pub(crate) fn offer_to(
        &mut self,
        mut case: Value,
        times: &[f64],
    ) -> Result<Vec<Offer>, BenchError> {
        case["states"] = Value::Null;
        case["times"] = times.into();
        self.offer(&case)
    }

    /// What can fly the case until another is offered.
    pub(crate) fn offer(&mut self, case: &Value) -> Result<Vec<Offer>, BenchError> {
        if self.process.is_none() {
            let mut process = Process::start(&self.python, self.peer)?;
            let Ready { peer: version } = process.hear(self.limit)?;
            self.version = version;
            self.process = Some(process);
        }
        let offered: Answer<Methods> = self.ask(&json!({ "case": case }))?;
        let refuse = |why| BenchError::Peer(format!("{}: {why}", self.name));
        Ok(offered.result().map_err(refuse)?.methods)
    }

    /// A flight through the case's times, or why there is none.
    pub(crate) fn fly(
        &mut self,
        method: &str,
        setting: f64,
    ) -> Result<Result<PeerFlight, String>, BenchError> {
        let request = json!({ "fly": method, "setting": setting });
        Ok(self.ask::<Answer<_>>(&request)?.result())
    }

    /// The time (s) of a flight to the last time, the mean of several short ones; or why there is none.
    pub(crate) fn time(
        &mut self,
        method: &str,
        setting: f64,
    ) -> Result<Result<f64, String>, BenchError> {
        let request = json!({ "time": method, "setting": setting });
        let timed: Answer<Timed> = self.ask(&request)?;
        Ok(timed.result().map(|timed| timed.seconds))
    }

    fn ask<Answer: DeserializeOwned>(&mut self, request: &Value) -> Result<Answer, BenchError> {
        let Some(process) = &mut self.process else {
            return Err(BenchError::Peer(format!("{} is gone", self.name)));
        };
        let answer = process.ask(request, self.limit);
        if answer.is_err() {
            self.process = None;
        }
        answer
    }
}

/// The data of the reference case called `name`.
pub(crate) fn read_case(name: &str) -> Result<Value, BenchError> {
    let path = Case::path(name);
    let refuse = |source| BenchError::Read {
        path: path.clone(),
        source,
    };
    let text = std::fs::read_to_string(&path).map_err(refuse)?;
    serde_json::from_str(&text).map_err(|error| refuse(error.into()))
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use serde_json::json;

    use super::Flyer;
    use crate::peer::tests::{shell, written};

    /// Answers a case, a failure, a time, and then no more.
    const SCRIPT: &str = r#"
        echo '{"peer": "peer 1"}'
        read -r case && echo '{"methods": [{"name": "m", "tuning": "steps"}]}'
        read -r fly && echo '{"failed": "too far"}'
        read -r time && echo '{"seconds": 0.5}'
        read -r fly && END
    "#;

    #[test]
    fn a_peer_that_dies_or_hangs_is_gone_until_the_next_case() {
        for end in ["exit 1", "exec sleep 60"] {
            let (peer, _file) = written(&SCRIPT.replace("END", end));
            let mut flyer = Flyer::new(&shell(), peer);
            for _ in 0..2 {
                flyer.limit = Duration::from_secs(60);
                assert_eq!(flyer.offer(&json!({})).unwrap()[0].name, "m");
                assert_eq!(flyer.version, "peer 1");
                assert_eq!(flyer.fly("m", 1.0).unwrap().unwrap_err(), "too far");
                assert_eq!(flyer.time("m", 1.0).unwrap(), Ok(0.5));
                flyer.limit = Duration::from_millis(200);
                assert!(flyer.fly("m", 1.0).is_err());
                let gone = flyer.time("m", 1.0).unwrap_err().to_string();
                assert_eq!(gone, "peer is gone");
            }
        }
    }
}
