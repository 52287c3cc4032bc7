//! A recorded state beside the one that the repetition gives.

use lgvi_common::{body_sample, header};
use lgvi_msgs::msg::{BodyState, SystemState};
use lgvi_msgs::shm::Name;
use lgvi_msgs::std_msgs::Header;
use lgvi_propagator::Flight;
use lgvi_scene::Scene;

use super::difference::{Difference, Value};

/// Flies on to the state's step, after `prepare` before each, and compares all that a state has. Its number is not compared: it tells which state it is.
pub(super) fn compare(
    scene: &Scene,
    flight: &mut Flight,
    recorded: &SystemState,
    prepare: impl FnMut(&mut Flight) -> Result<(), String>,
) -> Result<Option<Difference>, String> {
    let SystemState {
        header,
        sequence: _,
        step,
        time,
        bodies,
    } = recorded;
    let step = *step;
    let at_step = |error: String| format!("step {step}: {error}");
    let (found, expected) = (bodies.len(), scene.bodies.len());
    if found != expected {
        return Err(at_step(format!("{found} bodies, the scene has {expected}")));
    }
    fly(scene, flight, step, prepare)?;
    let difference = |body: &str, field: String, [recorded, computed]: [Value; 2]| Difference {
        step,
        body: body.into(),
        field,
        recorded,
        computed,
    };
    let own = of_system(scene, step, header, *time).map_err(at_step)?;
    if let Some((field, values)) = own {
        return Ok(Some(difference("the system's", field.into(), values)));
    }
    for ((recorded, named), state) in bodies.iter().zip(&scene.bodies).zip(flight.states()) {
        let body = &named.name;
        if recorded.name != *body {
            let found = &recorded.name;
            return Err(at_step(format!("body {found:?}, the scene has {body:?}")));
        }
        let name = Name::try_from(body.as_str()).map_err(|error| at_step(error.to_string()))?;
        let computed = BodyState::from(&body_sample(name, state, &scene.units));
        if let Some((field, values)) = of_body(recorded, &computed) {
            return Ok(Some(difference(body, field, values)));
        }
    }
    Ok(None)
}

/// Where what all bodies share differs.
fn of_system(
    scene: &Scene,
    step: u64,
    recorded: &Header,
    time: f64,
) -> Result<Option<(&'static str, [Value; 2])>, String> {
    let Header { stamp, frame_id } = recorded;
    let computed = header(scene, step).map_err(|error| error.to_string())?;
    let integers = |one: i64, other: i64| [Value::Integer(one), Value::Integer(other)];
    let texts = |one: &str, other: &str| [Value::Text(one.into()), Value::Text(other.into())];
    let fields = [
        ("time", [time, scene.seconds(step)].map(Value::Number)),
        (
            "header.stamp.sec",
            integers(stamp.sec.into(), computed.stamp.sec.into()),
        ),
        (
            "header.stamp.nanosec",
            integers(stamp.nanosec.into(), computed.stamp.nanosec.into()),
        ),
        ("header.frame_id", texts(frame_id, &computed.frame_id)),
    ];
    let differs = |(_, [one, other]): &(_, [Value; 2])| one != other;
    Ok(fields.into_iter().find(differs))
}

/// Where a body's numbers differ.
fn of_body(recorded: &BodyState, computed: &BodyState) -> Option<(String, [Value; 2])> {
    let pairs = components(recorded).zip(components(computed));
    let different = pairs
        .map(|((field, index, one), (.., other))| (field, index, [one, other]))
        .find(|(.., [one, other])| one.to_bits() != other.to_bits());
    different.map(|(field, index, values)| (format!("{field}[{index}]"), values.map(Value::Number)))
}

fn fly(
    scene: &Scene,
    flight: &mut Flight,
    step: u64,
    mut prepare: impl FnMut(&mut Flight) -> Result<(), String>,
) -> Result<(), String> {
    if step < flight.step() || step > scene.steps {
        let (from, to) = (flight.step(), scene.steps);
        return Err(format!(
            "step {step} is out of order, expected {from} to {to}"
        ));
    }
    while flight.step() < step {
        let at = flight.step();
        prepare(flight)?;
        flight.advance().map_err(|error| {
            let error = scene.step_error(&error);
            format!("the repetition fails at step {at}: {error}")
        })?;
    }
    Ok(())
}

/// All numbers of a body's state, by field and index.
fn components(body: &BodyState) -> impl Iterator<Item = (&'static str, usize, f64)> {
    let BodyState {
        name: _,
        position,
        linear_momentum,
        attitude,
        angular_momentum,
    } = body;
    let fields: [(&str, &[f64]); 4] = [
        ("position", position),
        ("linear_momentum", linear_momentum),
        ("attitude", attitude),
        ("angular_momentum", angular_momentum),
    ];
    fields.into_iter().flat_map(|(field, values)| {
        values
            .iter()
            .enumerate()
            .map(move |(index, value)| (field, index, *value))
    })
}
