use lgvi_dynamics::thrusters::{Engine, Propellant, Thruster, Thrusters};
use lgvi_dynamics::{Mobility, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::{check_mobility, check_names};
use crate::compile::body::inertia;
use crate::file::{BodyFile, EngineFile, PropellantFile, ThrusterFile};
use crate::{Scene, SceneError, check};

/// Largest number of thrusters of a body.
pub const MAX_THRUSTERS: usize = 64;

/// Largest delay of a valve, in steps: a pulse may wait for each.
const MAX_DELAY: f64 = 1000.0;

/// Returns the body with the thrusters, or the engine, of its file.
pub(super) fn with_thrusters(
    key: &str,
    file: &BodyFile,
    body: RigidBody,
) -> Result<RigidBody, SceneError> {
    if let Some(engine) = &file.engine {
        return with_engine(key, file, engine, body);
    }
    let key = |rest: &str| format!("{key}.{rest}");
    let count = file.thrusters.len();
    if count == 0 {
        return match &file.propellant {
            Some(propellant) => {
                let expected = "a body with `thrusters` or an `engine`, which use it";
                Err(SceneError::value(
                    key("propellant"),
                    propellant.mass,
                    expected,
                ))
            }
            None => Ok(body),
        };
    }
    if count > MAX_THRUSTERS {
        let expected = format!("{MAX_THRUSTERS} thrusters at most");
        return Err(SceneError::value(key("thrusters"), count, expected));
    }
    check_mobility(&key("thrusters"), count, &body)?;
    check_names(
        &key("thrusters"),
        file.thrusters.iter().map(|one| &one.name),
    )?;
    let each = file.thrusters.iter().enumerate();
    let thrusters = each.map(|(index, one)| thruster(&key(&format!("thrusters[{index}]")), one));
    let thrusters: Vec<_> = thrusters.collect::<Result<_, _>>()?;
    let uses = |one: &Thruster| one.exhaust_velocity.is_finite();
    let propellant = match &file.propellant {
        Some(file) => propellant(&key("propellant"), file)?,
        None => Propellant {
            mass: 0.0,
            inertia: None,
        },
    };
    if file.propellant.is_none()
        && let Some(index) = thrusters.iter().position(uses)
    {
        let key = key(&format!("thrusters[{index}].exhaust_velocity"));
        let expected = "a body with `propellant`";
        return Err(SceneError::value(
            key,
            thrusters[index].exhaust_velocity,
            expected,
        ));
    }
    let refuse = |error: &dyn std::fmt::Display| {
        SceneError::value(key("thrusters"), count, format!("thrusters: {error}"))
    };
    let thrusters = Thrusters::new(thrusters, propellant).map_err(|error| refuse(&error))?;
    loaded(body, thrusters, &key(""))
}

/// Returns the body with its engine.
fn with_engine(
    key: &str,
    file: &BodyFile,
    engine: &EngineFile,
    body: RigidBody,
) -> Result<RigidBody, SceneError> {
    let key = |rest: &str| format!("{key}.{rest}");
    let refuse = |expected: &str| SceneError::value(key("engine"), "given", expected);
    if !file.thrusters.is_empty() {
        return Err(refuse("none beside `thrusters`"));
    }
    if *body.mobility() != Mobility::Free {
        return Err(refuse("none: only a free body has an engine"));
    }
    let Some(given) = &file.propellant else {
        return Err(SceneError::missing(
            key("propellant"),
            "one beside `engine`, which uses it",
        ));
    };
    let velocity = engine.exhaust_velocity;
    let engine = Engine {
        thrust: match engine.thrust {
            Some(thrust) => check::positive(&key("engine.thrust"), thrust)?,
            None => f64::INFINITY,
        },
        exhaust_velocity: check::positive(&key("engine.exhaust_velocity"), velocity)?,
    };
    let propellant = propellant(&key("propellant"), given)?;
    let thrusters = Thrusters::new(Vec::new(), propellant).and_then(|all| all.with_engine(engine));
    let thrusters = thrusters.map_err(|error| refuse(&format!("an engine: {error}")))?;
    loaded(body, thrusters, &key(""))
}

/// Returns the body with thrusters or an engine, whose propellant is part of it.
fn loaded(body: RigidBody, thrusters: Thrusters, key: &str) -> Result<RigidBody, SceneError> {
    let mass = thrusters.propellant().mass;
    body.with_thrusters(thrusters).map_err(|error| {
        let expected = format!("propellant that is part of the body: {error}");
        SceneError::value(format!("{key}propellant.mass"), mass, expected)
    })
}

fn thruster(key: &str, file: &ThrusterFile) -> Result<Thruster, SceneError> {
    let key = |name: &str| format!("{key}.{name}");
    let direction = check::vector(&key("direction"), file.direction)?;
    if direction == Vector3::zeros() {
        let expected = "a direction other than 0";
        return Err(SceneError::value(
            key("direction"),
            file.direction,
            expected,
        ));
    }
    let least = |name: &str, value| check::not_negative(&key(name), value);
    Ok(Thruster {
        position: check::vector(&key("position"), file.position)?,
        direction,
        thrust: check::positive(&key("thrust"), file.thrust)?,
        exhaust_velocity: match file.exhaust_velocity {
            Some(value) => check::positive(&key("exhaust_velocity"), value)?,
            None => f64::INFINITY,
        },
        pulse_period: least("pulse_period", file.pulse_period)?,
        minimum_impulse: least("minimum_impulse", file.minimum_impulse)?,
        delay: least("delay", file.delay)?,
    })
}

fn propellant(key: &str, file: &PropellantFile) -> Result<Propellant, SceneError> {
    let matrix = |given| {
        Ok::<Matrix3<f64>, SceneError>(*inertia(&format!("{key}.inertia"), given)?.matrix())
    };
    Ok(Propellant {
        mass: check::positive(&format!("{key}.mass"), file.mass)?,
        inertia: file.inertia.as_ref().map(matrix).transpose()?,
    })
}

/// Pulses begin and end with steps only where their period is a whole number of them.
pub(super) fn check_steps(scene: &Scene) -> Result<(), SceneError> {
    let h = scene.h();
    for (body, named) in scene.bodies.iter().enumerate() {
        let thrusters = named.body.thrusters().map_or(&[][..], Thrusters::thrusters);
        for (index, thruster) in thrusters.iter().enumerate() {
            let key = |name: &str| format!("bodies[{body}].thrusters[{index}].{name}");
            let steps = thruster.pulse_period / h;
            if !((steps - steps.round()).abs() <= 1e-9 * steps.max(1.0) && steps <= 1e15) {
                let expected = format!("a whole number of steps of {h}");
                return Err(SceneError::value(
                    key("pulse_period"),
                    thruster.pulse_period,
                    expected,
                ));
            }
            let most = thruster.thrust * thruster.pulse_period.max(h);
            if thruster.minimum_impulse > most {
                let expected = format!("{most} at most, the impulse of the longest pulse");
                let value = thruster.minimum_impulse;
                return Err(SceneError::value(key("minimum_impulse"), value, expected));
            }
            if !(thruster.thrust * scene.units.force()).is_finite() {
                let expected = "a force that is in the range of numbers in SI";
                return Err(SceneError::value(key("thrust"), thruster.thrust, expected));
            }
            if thruster.delay / h > MAX_DELAY {
                let expected = format!("{MAX_DELAY} steps of {h} at most");
                return Err(SceneError::value(key("delay"), thruster.delay, expected));
            }
        }
    }
    Ok(())
}
