//! What the comparison has found, and how it is told.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

use serde::Serialize;

use super::difference::Difference;
use crate::flight_bag::FlightBag;

/// What a comparison comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// All recorded states agree.
    Agrees,
    /// One differs, after messages that were lost: the controls of the flight may be among them.
    Incomplete,
    /// One differs, and nothing is missing before.
    Differs,
}

/// What the comparison has found.
#[derive(Debug, Serialize)]
pub struct Verdict {
    /// What it comes to.
    pub outcome: Outcome,
    bag: String,
    /// The propagator.
    flight: String,
    scene: String,
    /// What flew the bag, and what repeats it.
    software: [String; 2],
    pub(super) sequences: usize,
    /// Resets, and states set.
    interventions: usize,
    /// States compared, the differing one included.
    pub states: u64,
    /// States that the propagator published before the last of them and that are not in the bag.
    pub missing: u64,
    /// Messages of the flight that the recorder has lost, by topic.
    lost: BTreeMap<String, String>,
    /// Step of the last of them.
    pub step: u64,
    /// Steps of the scene.
    pub steps: u64,
    /// Whether the states compared go to the scene's last step: those of an interrupted flight do not.
    pub complete: bool,
    bodies: usize,
    /// The first difference.
    pub difference: Option<Difference>,
}

impl Verdict {
    /// Of a bag that has not been looked at.
    pub(super) fn new(bag: &FlightBag) -> Self {
        let scene = &bag.scene;
        Self {
            outcome: Outcome::Agrees,
            bag: bag.path().display().to_string(),
            flight: bag.name().to_owned(),
            scene: scene.name.clone(),
            software: [bag.software.clone(), lgvi_propagator::SOFTWARE.into()],
            sequences: 0,
            interventions: bag.interventions(),
            states: 0,
            missing: 0,
            lost: bag
                .lost()
                .into_iter()
                .map(|(topic, count)| (topic.to_owned(), count.to_owned()))
                .collect(),
            step: 0,
            steps: scene.steps,
            complete: false,
            bodies: scene.bodies.len(),
            difference: None,
        }
    }

    /// Takes note of the first difference.
    pub(super) fn differ(&mut self, difference: Difference) {
        self.outcome = if self.missing > 0 || !self.lost.is_empty() {
            Outcome::Incomplete
        } else {
            Outcome::Differs
        };
        self.difference = Some(difference);
    }
}

impl Display for Verdict {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            bag,
            scene,
            sequences,
            interventions,
            states,
            step: last,
            steps,
            complete,
            bodies,
            missing,
            lost,
            ..
        } = self;
        write!(
            f,
            "{bag}: {scene}, {bodies} bodies, {sequences} control sequences"
        )?;
        if *interventions > 0 {
            write!(f, ", {interventions} interventions")?;
        }
        writeln!(f)?;
        let [flown_by, repeated_by] = &self.software;
        if flown_by != repeated_by {
            writeln!(f, "flown by {flown_by}, repeated by {repeated_by}")?;
        }
        if *missing > 0 || !lost.is_empty() {
            write!(f, "the record is incomplete: {missing} states are missing")?;
            for (topic, count) in lost {
                write!(f, "; the recorder lost {count} messages of {topic}")?;
            }
            writeln!(f)?;
        }
        match &self.difference {
            None => {
                if *missing == 0 {
                    write!(f, "all {states} recorded states agree bit for bit")?;
                } else {
                    let published = *states + *missing;
                    write!(
                        f,
                        "{states} of {published} states are recorded, and agree bit for bit"
                    )?;
                }
                if !complete {
                    write!(
                        f,
                        "; the flight is not complete: its last state is of step {last} of {steps}"
                    )?;
                }
                Ok(())
            }
            Some(difference) => {
                let step = difference.step;
                match self.outcome {
                    Outcome::Incomplete => write!(
                        f,
                        "incomplete: what is missing may have changed the flight before step {step} (state {states}), \
                         where {difference}"
                    ),
                    _ => write!(f, "differs at step {step} (state {states}): {difference}"),
                }
            }
        }
    }
}
