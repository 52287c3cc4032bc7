//! A recorded flight: the bag of one propagator, with its scene and the controls that were flown.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};

use lgvi_bag::{BagReader, Message, Topic};
use lgvi_msgs::cdr::CdrError;
use lgvi_msgs::msg::{self, ControlSequence, Intervention, SystemState};
use lgvi_msgs::std_msgs::Header;
use lgvi_msgs::{RosMessage, cdr, stamp};
use lgvi_propagator::Controls;
use lgvi_scene::Scene;

use crate::Unusable;
use crate::course::Course;

/// An open bag that holds a flight.
pub struct FlightBag {
    path: PathBuf,
    reader: BagReader,
    topics: Topics,
    /// What was flown.
    pub scene: Scene,
    /// What flew it.
    pub software: String,
    sequences: Vec<ControlSequence>,
    interventions: Vec<Intervention>,
}

/// The topics of one propagator, by the name of its scene topic.
struct Topics {
    node: String,
    scene: String,
    state: String,
    flown: String,
    intervention: String,
}

/// What a flight has been given, each kind in the order in which it was.
struct Given {
    scene: msg::Scene,
    sequences: Vec<ControlSequence>,
    interventions: Vec<Intervention>,
}

impl FlightBag {
    /// Opens the bag and reads scene and control sequences of the propagator `flight`, which must be named where there are
    /// several; every error names the bag.
    pub fn open(path: &Path, flight: Option<&str>) -> Result<Self, Unusable> {
        let reader = BagReader::open(path).map_err(Unusable::new)?;
        let topics = Topics::of(reader.topics(), flight).map_err(|error| refuse(path, &error))?;
        let Given {
            scene,
            sequences,
            interventions,
        } = given(path, &reader, &topics)?;
        let msg::Scene {
            header,
            name,
            text,
            software,
        } = scene;
        let scene = Scene::parse(&name, &text).map_err(|error| refuse(path, &error))?;
        let prefix = header.frame_id.strip_suffix(&scene.frame);
        let scene = scene.with_frame_prefix(prefix.unwrap_or_default());
        let path = path.to_owned();
        Ok(Self {
            path,
            reader,
            topics,
            scene,
            software,
            sequences,
            interventions,
        })
    }

    /// Its path, as it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Something wrong with this bag.
    pub fn refuse(&self, error: &dyn Display) -> Unusable {
        refuse(&self.path, error)
    }

    /// Name of the propagator.
    pub fn name(&self) -> &str {
        &self.topics.node
    }

    /// Name of the topic of the full-rate states.
    pub fn state_topic(&self) -> &str {
        &self.topics.state
    }

    /// How many full-rate states it has.
    pub fn state_count(&self) -> u64 {
        let counts = self.reader.message_counts();
        counts.get(self.state_topic()).copied().unwrap_or(0)
    }

    /// How often the flight's course has been changed.
    pub fn interventions(&self) -> usize {
        self.interventions.len()
    }

    /// Control sequences of it, checked against the scene.
    pub fn check(
        &self,
        sequences: &[ControlSequence],
    ) -> impl Iterator<Item = Result<Controls, Unusable>> {
        sequences.iter().map(|sequence| {
            Controls::of_message(&self.scene, sequence)
                .map_err(|error| self.refuse(&format!("{}: {error}", self.topics.flown)))
        })
    }

    /// The courses of the flight. Samples may be missing within a course, but not where one begins.
    pub fn courses(&self) -> Result<Vec<Course<'_>>, Unusable> {
        if self.interventions.is_empty() {
            return Ok(vec![Course {
                controls: &self.sequences,
                samples: 0..u64::MAX,
                set: Vec::new(),
            }]);
        }
        let samples = self
            .states()
            .map(|state| state.map(|state| (state.sequence, state.step)));
        let mut samples = samples.collect::<Result<Vec<_>, _>>()?;
        samples.sort_unstable();
        Course::of(&samples, &self.sequences, &self.interventions).map_err(|error| {
            let mut text = format!("{}: {error}", self.topics.intervention);
            for (topic, count) in self.lost() {
                text += &format!("; the recorder lost {count} messages of {topic}");
            }
            self.refuse(&text)
        })
    }

    /// Topics of the flight of which the recorder says that messages were lost, and how many.
    pub fn lost(&self) -> BTreeMap<&str, &str> {
        let Topics {
            state,
            flown,
            intervention,
            ..
        } = &self.topics;
        let custom = self.reader.custom();
        let lost = [state, flown, intervention]
            .into_iter()
            .filter_map(|topic| {
                let count = custom.get(&format!("lost:{topic}"))?;
                Some((topic.as_str(), count.as_str()))
            });
        lost.collect()
    }

    /// The full-rate states in the order in which they were recorded; where stamps tell the time, those of one course
    /// are among those of others.
    pub fn states(&self) -> impl Iterator<Item = Result<SystemState, Unusable>> {
        let wanted = |topic: &Topic| topic.name == self.topics.state;
        self.reader.messages_of(0, wanted).map(|message| {
            let message = message.map_err(Unusable::new)?;
            decode(&message).map_err(|error| self.refuse(&error))
        })
    }

    /// The full-rate states with these numbers, in their order.
    pub fn states_of(
        &self,
        samples: Range<u64>,
    ) -> impl Iterator<Item = Result<SystemState, Unusable>> {
        self.states().filter(move |state| {
            state
                .as_ref()
                .map_or(true, |state| samples.contains(&state.sequence))
        })
    }
}

impl FlightBag {
    /// The recorded messages of a topic of a body, with their stamps (ns).
    pub fn of_body<M: RosMessage>(
        &self,
        name: &str,
        body: &str,
        header: impl Fn(&M) -> &Header,
    ) -> Result<Vec<(i64, M)>, Unusable> {
        let topic = format!("{}/{name}/{body}", self.topics.node);
        let messages = self.reader.messages_of(0, |known| known.name == topic);
        let each = messages.map(|message| {
            let message = message.map_err(Unusable::new)?;
            let decoded: M = decode(&message).map_err(|error| self.refuse(&error))?;
            let stamp = stamp::from_message(&header(&decoded).stamp);
            let stamp = stamp.map_err(|error| self.refuse(&format!("{topic}: {error}")))?;
            Ok((stamp, decoded))
        });
        each.collect()
    }
}

impl Topics {
    /// Those of the propagator `flight`, or of the only one.
    fn of(topics: &[Topic], flight: Option<&str>) -> Result<Self, String> {
        let scenes = topics
            .iter()
            .filter(|topic| topic.type_name == msg::Scene::TYPE_NAME);
        let flights: BTreeMap<_, _> = scenes
            .map(|topic| {
                let name = topic.name.as_str();
                (name.rsplit_once('/').map_or("", |(node, _)| node), name)
            })
            .collect();
        let known = flights.keys().copied().collect::<Vec<_>>().join(", ");
        let found = match (flight, flights.len()) {
            (_, 0) => Err(format!(
                "no topic of type {}: not a flight",
                msg::Scene::TYPE_NAME
            )),
            (Some(flight), _) => flights
                .get_key_value(flight)
                .ok_or_else(|| format!("no flight of {flight}, there is {known}")),
            (None, count) => flights
                .first_key_value()
                .filter(|_| count == 1)
                .ok_or_else(|| {
                    format!("{count} flights, expected --flight with the name of one: {known}")
                }),
        };
        let (node, scene) = found?;
        Ok(Self {
            node: (*node).to_owned(),
            scene: (*scene).to_owned(),
            state: format!("{node}/state"),
            flown: format!("{node}/flown_control"),
            intervention: format!("{node}/intervention"),
        })
    }
}

fn refuse(path: &Path, error: &dyn Display) -> Unusable {
    Unusable::new(format!("bag {}: {error}", path.display()))
}

/// Decodes a message, if it was recorded with a definition of its type that is known.
fn decode<M: RosMessage>(message: &Message<'_>) -> Result<M, String> {
    let Topic {
        name, type_hash, ..
    } = message.topic;
    cdr::decode_recorded(type_hash, &message.data).map_err(|error| match error {
        CdrError::Definition { .. } => format!("{name}: {error}"),
        _ => format!("{name} at {} ns: {error}", message.log_time),
    })
}

fn given(path: &Path, bag: &BagReader, topics: &Topics) -> Result<Given, Unusable> {
    let refused = |error: String| refuse(path, &error);
    let mut scene = None;
    let (mut sequences, mut interventions) = (Vec::new(), Vec::new());
    let wanted = [&topics.scene, &topics.flown, &topics.intervention];
    for message in bag.messages_of(0, |topic| wanted.contains(&&topic.name)) {
        let message = message.map_err(Unusable::new)?;
        let topic = &message.topic.name;
        if *topic == topics.scene {
            scene = Some(decode(&message).map_err(refused)?);
        } else if *topic == topics.flown {
            sequences.push((message.sequence, decode(&message).map_err(refused)?));
        } else {
            interventions.push((message.sequence, decode(&message).map_err(refused)?));
        }
    }
    Ok(Given {
        scene: scene.ok_or_else(|| refused(format!("{}: no scene", topics.scene)))?,
        sequences: in_order(sequences),
        interventions: in_order(interventions),
    })
}

/// Messages are logged at their stamps; what counts is the order in which they were published.
fn in_order<M>(mut messages: Vec<(u32, M)>) -> Vec<M> {
    messages.sort_by_key(|(sequence, _)| *sequence);
    messages.into_iter().map(|(_, message)| message).collect()
}
