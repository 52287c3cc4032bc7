//! A recorded flight: the bag of one propagator, with its scene and the controls that were flown.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use lgvi_bag::{BagReader, Message, Topic};
use lgvi_msgs::msg::{self, ControlSequence, SystemState};
use lgvi_msgs::{RosMessage, cdr};
use lgvi_node::NodeError;
use lgvi_propagator::Controls;
use lgvi_scene::Scene;

/// An open bag that holds a flight.
pub(crate) struct FlightBag {
    path: PathBuf,
    reader: BagReader,
    topics: Topics,
    /// What was flown.
    pub(crate) scene: Scene,
    /// What flew it.
    pub(crate) software: String,
    sequences: Vec<ControlSequence>,
}

/// The topics of one propagator, by the name of its scene topic.
struct Topics {
    scene: String,
    state: String,
    flown: String,
}

impl FlightBag {
    /// Opens the bag and reads its scene and control sequences; every error is [`NodeError::Input`] and names the bag.
    pub(crate) fn open(path: &Path) -> Result<Self, NodeError> {
        let reader = BagReader::open(path).map_err(|error| refuse(path, &error))?;
        let topics = Topics::of(&reader).map_err(|error| refuse(path, &error))?;
        let (scene, sequences) = given(&reader, &topics).map_err(|error| refuse(path, &error))?;
        let software = scene.software;
        let scene = Scene::parse(&scene.name, &scene.text).map_err(|error| refuse(path, &error))?;
        let path = path.to_owned();
        Ok(Self {
            path,
            reader,
            topics,
            scene,
            software,
            sequences,
        })
    }

    /// Something wrong with this bag.
    pub(crate) fn refuse(&self, error: &dyn Display) -> NodeError {
        refuse(&self.path, error)
    }

    /// Name of the topic of the full-rate states.
    pub(crate) fn state_topic(&self) -> &str {
        &self.topics.state
    }

    /// The control sequences in the order of their acceptance, checked against the scene.
    pub(crate) fn controls(&self) -> impl Iterator<Item = Result<Controls, NodeError>> {
        self.sequences.iter().map(|sequence| {
            Controls::of_message(&self.scene, sequence)
                .map_err(|error| self.refuse(&format!("{}: {error}", self.topics.flown)))
        })
    }

    /// The full-rate states in the order in which they were recorded.
    pub(crate) fn states(&self) -> impl Iterator<Item = Result<SystemState, NodeError>> {
        self.reader.messages().filter_map(|message| match message {
            Err(error) => Some(Err(self.refuse(&error))),
            Ok(message) if message.topic.name == self.topics.state => {
                Some(decode(&message).map_err(|error| self.refuse(&error)))
            }
            Ok(_) => None,
        })
    }
}

impl Topics {
    fn of(bag: &BagReader) -> Result<Self, String> {
        let scene = bag
            .topics()
            .iter()
            .find(|topic| topic.type_name == msg::Scene::TYPE_NAME)
            .ok_or_else(|| format!("no topic of type {}: not a flight", msg::Scene::TYPE_NAME))?;
        let node = scene.name.rsplit_once('/').map_or("", |(node, _)| node);
        Ok(Self {
            scene: scene.name.clone(),
            state: format!("{node}/state"),
            flown: format!("{node}/flown_control"),
        })
    }
}

fn refuse(path: &Path, error: &dyn Display) -> NodeError {
    NodeError::input(format!("bag {}: {error}", path.display()))
}

/// Decodes a message, unless it was recorded with another definition of its type, which may mean other things.
fn decode<M: RosMessage>(message: &Message<'_>) -> Result<M, String> {
    let Topic {
        name, type_hash, ..
    } = message.topic;
    if !(type_hash.is_empty() || type_hash == M::TYPE_HASH) {
        let (type_name, expected) = (M::TYPE_NAME, M::TYPE_HASH);
        return Err(format!(
            "{name}: recorded with another definition of {type_name}, {type_hash}, expected {expected}"
        ));
    }
    cdr::decode(&message.data)
        .map_err(|error| format!("{name} at {} ns: {error}", message.log_time))
}

/// The scene and the control sequences that were flown, in the order of their acceptance.
fn given(bag: &BagReader, topics: &Topics) -> Result<(msg::Scene, Vec<ControlSequence>), String> {
    let mut scene = None;
    let mut sequences = Vec::new();
    for message in bag.messages() {
        let message = message.map_err(|error| error.to_string())?;
        if message.topic.name == topics.scene {
            scene = Some(decode(&message)?);
        } else if message.topic.name == topics.flown {
            sequences.push((message.sequence, decode::<ControlSequence>(&message)?));
        }
    }
    // Sequences are logged at the time they start at; what counts is the order in which they were accepted.
    sequences.sort_by_key(|(sequence, _)| *sequence);
    let scene = scene.ok_or_else(|| format!("{}: no scene", topics.scene))?;
    Ok((
        scene,
        sequences
            .into_iter()
            .map(|(_, sequence)| sequence)
            .collect(),
    ))
}
