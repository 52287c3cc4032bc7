//! Repeats a recorded flight.

use std::fmt::{self, Display, Formatter};
use std::path::Path;
use std::process::ExitCode;

use lgvi_msgs::msg::{Intervention, SystemState};
use lgvi_msgs::shm::{BodySample, Name, StateHeader};
use lgvi_node::{NodeError, body_sample};
use lgvi_propagator::{Flight, SetStates};
use lgvi_scene::Scene;
use serde::Serialize;

use crate::course::Course;
use crate::flight_bag::FlightBag;
use crate::output::say;

/// What the comparison has found.
#[derive(Debug, Serialize)]
struct Verdict {
    bag: String,
    scene: String,
    /// What flew the bag, and what repeats it.
    software: [String; 2],
    sequences: usize,
    /// Resets, and states set.
    interventions: usize,
    /// States compared, the differing one included.
    states: u64,
    /// Step of the last of them.
    step: u64,
    /// Steps of the scene.
    steps: u64,
    /// Whether the states compared go to the scene's last step: those of an interrupted flight do not.
    complete: bool,
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

/// Compares every recorded state with the repetition; exit code 0 where all agree, 1 at a difference.
pub(crate) fn verify(path: &Path, json: bool) -> Result<ExitCode, NodeError> {
    let bag = FlightBag::open(path)?;
    let scene = &bag.scene;
    let courses = bag.courses()?;
    let mut verdict = Verdict {
        bag: path.display().to_string(),
        scene: scene.name.clone(),
        software: [bag.software.clone(), lgvi_propagator::SOFTWARE.into()],
        sequences: 0,
        interventions: bag.interventions(),
        states: 0,
        step: 0,
        steps: scene.steps,
        complete: false,
        bodies: scene.bodies.len(),
        difference: None,
    };
    let topic = bag.state_topic();
    for course in &courses {
        repeat(&bag, course, &mut verdict)?;
        if verdict.difference.is_some() {
            break;
        }
    }
    if verdict.states == 0 {
        return Err(bag.refuse(&format!("{topic}: no states, expected at least one")));
    }
    report(&verdict, json)
}

/// Repeats a course of the flight up to the first difference.
fn repeat(bag: &FlightBag, course: &Course<'_>, verdict: &mut Verdict) -> Result<(), NodeError> {
    let scene = &bag.scene;
    let mut flight = Flight::new(scene).map_err(NodeError::input)?;
    for controls in bag.check(course.controls) {
        flight
            .accept(controls?)
            .map_err(|error| bag.refuse(&error))?;
        verdict.sequences += 1;
    }
    let mut set = course.set.iter().peekable();
    for state in bag.states_of(course.samples.clone()) {
        let state = state?;
        bag.complete(state.sequence, verdict.states)?;
        verdict.states += 1;
        verdict.step = state.step;
        verdict.complete = state.step == scene.steps;
        if let Some((_, intervention)) = set.next_if(|(sample, _)| *sample == state.sequence) {
            set_states(scene, &mut flight, intervention).map_err(|error| bag.refuse(&error))?;
        }
        verdict.difference =
            compare(scene, &mut flight, &state).map_err(|error| bag.refuse(&error))?;
        if verdict.difference.is_some() {
            break;
        }
    }
    Ok(())
}

/// Sets states as they were set in the flight.
fn set_states(
    scene: &Scene,
    flight: &mut Flight,
    intervention: &Intervention,
) -> Result<(), String> {
    let Intervention { step, bodies, .. } = intervention;
    let states = SetStates::of_message(scene, bodies)
        .map_err(|error| format!("states set at step {step}: {error}"))?;
    flight
        .set_states(&states)
        .map_err(|error| format!("states set at step {step}: {error}"))
}

fn report(verdict: &Verdict, json: bool) -> Result<ExitCode, NodeError> {
    if json {
        say(&serde_json::to_string(verdict).map_err(NodeError::runtime)?)?;
    } else {
        say(verdict)?;
    }
    Ok(ExitCode::from(u8::from(verdict.difference.is_some())))
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
        match &self.difference {
            None => {
                write!(f, "all {states} recorded states agree bit for bit")?;
                if !complete {
                    write!(
                        f,
                        "; the flight is not complete: its last state is of step {last} of {steps}"
                    )?;
                }
                Ok(())
            }
            Some(Difference {
                step,
                body,
                field,
                recorded,
                computed,
            }) => write!(
                f,
                "differs at step {step} (state {states}): {body} {field} is {recorded:e}, \
                 the repetition gives {computed:e}"
            ),
        }
    }
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
        return Err(format!(
            "step {step}: {found} bodies, the scene has {expected}"
        ));
    }
    if step < flight.step() || step > scene.steps {
        let (from, to) = (flight.step(), scene.steps);
        return Err(format!(
            "step {step} is out of order, expected {from} to {to}"
        ));
    }
    while flight.step() < step {
        let at = flight.step();
        flight
            .advance()
            .map_err(|error| format!("the repetition fails at step {at}: {error}"))?;
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
    let time = difference(
        "the system's",
        "time".into(),
        header.time,
        scene.seconds(step),
    );
    if time.is_some() {
        return Ok(time);
    }
    for ((recorded, named), state) in bodies.iter().zip(&scene.bodies).zip(flight.states()) {
        let name = Name::try_from(named.name.as_str()).map_err(|error| error.to_string())?;
        let computed = body_sample(name, state, &scene.units);
        if recorded.name != name {
            return Err(format!(
                "step {step}: body {}, the scene has {name}",
                recorded.name
            ));
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
        values
            .iter()
            .enumerate()
            .map(move |(index, value)| (field, index, *value))
    })
}
