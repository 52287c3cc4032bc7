//! Repeats a recorded flight.

use std::path::Path;
use std::process::ExitCode;

use lgvi_bag::{BagReader, Message};
use lgvi_msgs::msg::{self, ControlSequence, SystemState};
use lgvi_msgs::shm::{BodySample, ControlHeader, Name, StateHeader};
use lgvi_msgs::{RosMessage, cdr};
use lgvi_node::{NodeError, body_sample};
use lgvi_propagator::{Controls, Flight};
use lgvi_scene::Scene;
use serde::Serialize;

/// What the comparison has found.
#[derive(Debug, Serialize)]
struct Verdict {
    bag: String,
    scene: String,
    /// What flew the bag, and what repeats it.
    software: [String; 2],
    sequences: usize,
    /// States compared, the differing one included.
    states: u64,
    bodies: usize,
    difference: Option<Difference>,
}

/// The first place where record and repetition differ.
#[derive(Debug, Serialize)]
struct Difference {
    step: u64,
    body: String,
    field: String,
    recorded: f64,
    computed: f64,
}

/// The topics of one propagator, by the name of its scene topic.
struct Topics {
    scene: String,
    state: String,
    flown: String,
}

/// Compares every recorded state with the repetition; exit code 0 where all agree, 1 at a difference.
pub(crate) fn verify(path: &Path, json: bool) -> Result<ExitCode, NodeError> {
    let refuse = |error: &dyn std::fmt::Display| {
        NodeError::Input(format!("bag {}: {error}", path.display()))
    };
    let bag = BagReader::open(path).map_err(|error| refuse(&error))?;
    let topics = topics(&bag).map_err(|error| refuse(&error))?;
    let (recorded, sequences) = given(&bag, &topics).map_err(|error| refuse(&error))?;
    let scene = Scene::parse(&recorded.name, &recorded.text).map_err(|error| refuse(&error))?;
    let mut flight = Flight::new(&scene);
    for sequence in &sequences {
        let controls = ControlHeader::from_message(sequence)
            .map_err(|error| refuse(&format!("{}: {error}", topics.flown)))
            .and_then(|(header, intervals)| {
                Controls::check(&scene, &header, &intervals)
                    .map_err(|error| refuse(&format!("{}: {error}", topics.flown)))
            })?;
        flight.accept(controls).map_err(|error| refuse(&error))?;
    }

    let mut verdict = Verdict {
        bag: path.display().to_string(),
        scene: scene.name.clone(),
        software: [recorded.software, lgvi_propagator::SOFTWARE.into()],
        sequences: sequences.len(),
        states: 0,
        bodies: scene.bodies.len(),
        difference: None,
    };
    let mut expected_sequence = 0;
    for message in bag.messages() {
        let message = message.map_err(|error| refuse(&error))?;
        if message.topic.name != topics.state {
            continue;
        }
        let state: SystemState =
            decode(&message).map_err(|error| refuse(&error))?;
        if state.sequence != expected_sequence {
            let error = format!(
                "{}: sequence {} follows {expected_sequence} states: some are missing",
                topics.state, state.sequence
            );
            return Err(refuse(&error));
        }
        expected_sequence += 1;
        verdict.states += 1;
        verdict.difference = compare(&scene, &mut flight, &state).map_err(|error| refuse(&error))?;
        if verdict.difference.is_some() {
            break;
        }
    }
    if verdict.states == 0 {
        return Err(refuse(&format!("{}: no states, expected at least one", topics.state)));
    }
    report(&verdict, json)
}

fn report(verdict: &Verdict, json: bool) -> Result<ExitCode, NodeError> {
    if json {
        println!("{}", serde_json::to_string(verdict).map_err(NodeError::runtime)?);
    } else {
        let Verdict { bag, scene, sequences, states, bodies, .. } = verdict;
        println!("{bag}: {scene}, {bodies} bodies, {sequences} control sequences");
        let [flown_by, repeated_by] = &verdict.software;
        if flown_by != repeated_by {
            println!("flown by {flown_by}, repeated by {repeated_by}");
        }
        match &verdict.difference {
            None => println!("all {states} recorded states agree bit for bit"),
            Some(Difference { step, body, field, recorded, computed }) => println!(
                "differs at step {step} (state {states}): {body} {field} is {recorded:e}, \
                 the repetition gives {computed:e}"
            ),
        }
    }
    Ok(ExitCode::from(u8::from(verdict.difference.is_some())))
}

fn topics(bag: &BagReader) -> Result<Topics, String> {
    let scene = bag
        .topics()
        .iter()
        .find(|topic| topic.type_name == msg::Scene::TYPE_NAME)
        .ok_or_else(|| format!("no topic of type {}: not a flight", msg::Scene::TYPE_NAME))?;
    let node = scene.name.rsplit_once('/').map_or("", |(node, _)| node);
    Ok(Topics {
        scene: scene.name.clone(),
        state: format!("{node}/state"),
        flown: format!("{node}/flown_control"),
    })
}

fn decode<M: RosMessage>(message: &Message<'_>) -> Result<M, String> {
    cdr::decode(&message.data)
        .map_err(|error| format!("{} at {} ns: {error}", message.topic.name, message.log_time))
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
    Ok((scene, sequences.into_iter().map(|(_, sequence)| sequence).collect()))
}

/// Flies on to the state's step and compares.
fn compare(
    scene: &Scene,
    flight: &mut Flight,
    recorded: &SystemState,
) -> Result<Option<Difference>, String> {
    let step = recorded.step;
    let (header, bodies) =
        StateHeader::from_message(recorded).map_err(|error| format!("step {step}: {error}"))?;
    if bodies.len() != scene.bodies.len() {
        let (found, expected) = (bodies.len(), scene.bodies.len());
        return Err(format!("step {step}: {found} bodies, the scene has {expected}"));
    }
    if step < flight.step() || step > scene.steps {
        let (from, to) = (flight.step(), scene.steps);
        return Err(format!("step {step} is out of order, expected {from} to {to}"));
    }
    while flight.step() < step {
        let at = flight.step();
        flight.advance().map_err(|error| format!("the repetition fails at step {at}: {error}"))?;
    }
    let difference = |body: &str, field: String, recorded: f64, computed: f64| {
        (recorded.to_bits() != computed.to_bits()).then(|| Difference {
            step,
            body: body.into(),
            field,
            recorded,
            computed,
        })
    };
    let time = difference("the system's", "time".into(), header.time, scene.seconds(step));
    if time.is_some() {
        return Ok(time);
    }
    for ((recorded, named), state) in bodies.iter().zip(&scene.bodies).zip(flight.states()) {
        let name = Name::try_from(named.name.as_str()).map_err(|error| error.to_string())?;
        let computed = body_sample(name, state, &scene.units);
        if recorded.name != name {
            return Err(format!("step {step}: body {}, the scene has {name}", recorded.name));
        }
        let fields = components(recorded).zip(components(&computed));
        for ((field, index, recorded), (_, _, computed)) in fields {
            let found = difference(&named.name, format!("{field}[{index}]"), recorded, computed);
            if found.is_some() {
                return Ok(found);
            }
        }
    }
    Ok(None)
}

/// All numbers of a sample, by field and index.
fn components(sample: &BodySample) -> impl Iterator<Item = (&'static str, usize, f64)> {
    let fields: [(&str, &[f64]); 4] = [
        ("position", &sample.position),
        ("linear_momentum", &sample.linear_momentum),
        ("attitude", &sample.attitude),
        ("angular_momentum", &sample.angular_momentum),
    ];
    fields.into_iter().flat_map(|(field, values)| {
        values.iter().enumerate().map(move |(index, value)| (field, index, *value))
    })
}
