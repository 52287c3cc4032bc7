//! Thrusters, engines and reaction wheels as commands.

use lgvi_control::constraint::{CommandLimit, NormLimit, Place};
use lgvi_control::{Actuation, ActuationError, Constraint, Dynamics, MAX_COMMANDS, Motion};
use lgvi_dynamics::thrusters::Thrusters;
use lgvi_dynamics::wheels::Wheels;
use nalgebra::Matrix3;

use super::{actuation, dynamics};
use crate::file::{CostFile, EachFile, ManeuverFile};
use crate::{Commands, Scene, SceneError, check};

/// The actuation by actuators, and their limits.
type Actuators = (Actuation, Option<Constraint>);

pub(super) fn thrusters(file: &ManeuverFile, all: &Thrusters) -> Result<Actuators, SceneError> {
    let thrusters = all.thrusters();
    let limits: Vec<_> = thrusters.iter().map(|one| one.thrust).collect();
    let limit = limit(&limits, CommandLimit::one_sided)?;
    let flows: Vec<_> = thrusters
        .iter()
        .map(|one| one.exhaust_velocity.recip())
        .collect();
    let by = |weights: &[f64]| Actuation::thrusters(all, weights);
    if flows.iter().all(|flow| *flow == 0.0) || !check_propellant(file, all)? {
        let actuation = weighed(file, Commands::Thrusters, limits.len(), by)?;
        return Ok((actuation, Some(limit)));
    }
    let priced = |_: &[f64]| by(&flows);
    let actuation = weighed(file, Commands::Thrusters, limits.len(), priced)?;
    Ok((actuation, Some(limit)))
}

/// Force and moment, where the engine exerts the force, and the limit of its thrust.
pub(super) fn engine(
    scene: &Scene,
    file: &ManeuverFile,
    all: &Thrusters,
    motion: Motion,
) -> Result<Actuators, SceneError> {
    let Some(engine) = all.engine() else {
        return Ok((actuation::actuation(file, motion)?, None));
    };
    let beside = "of a body with an `engine`";
    for (key, given, value, expected) in [
        ("actuators", file.actuators.is_some(), "given", "none"),
        ("final_time", file.final_time.is_some(), "given", "none"),
        ("confidence", file.confidence.is_some(), "given", "none"),
        ("feedback", file.feedback, "true", "false"),
        (
            "dynamics",
            dynamics(scene, file) != Dynamics::Lgvi,
            "lie_euler",
            "\"lgvi\"",
        ),
    ] {
        if given {
            let expected = format!("{expected} {beside}");
            return Err(SceneError::value(
                format!("maneuver.{key}"),
                value,
                expected,
            ));
        }
    }
    check_inertia(all)?;
    let limit = match engine.thrust {
        thrust if thrust.is_finite() => Some(NormLimit::new(Place::Position, thrust)),
        _ => None,
    };
    let limit = limit
        .transpose()
        .map_err(|error| SceneError::parameter(String::from("bodies.engine.thrust"), error))?;
    let actuation = match (file.cost, file.force_weight) {
        (CostFile::Energy, _) => actuation::actuation(file, motion)?,
        (CostFile::Fuel, None) => {
            let price = engine.exhaust_velocity.recip();
            actuation::of_loads(file, &Matrix3::from_diagonal_element(price))?
        }
        (CostFile::Fuel, Some(_)) => {
            let expected =
                format!("none {beside} where `cost` is \"fuel\": the cost is the propellant");
            return Err(SceneError::value(
                "maneuver.force_weight",
                "given",
                expected,
            ));
        }
    };
    Ok((actuation, limit.map(Constraint::commands)))
}

/// Checks that the mass distribution stays what it is while propellant flows out.
fn check_inertia(all: &Thrusters) -> Result<(), SceneError> {
    if all.propellant().inertia.is_some() {
        let expected = "none of a body whose propellant a plan uses, which lets the inertia be in proportion to the mass";
        let key = "bodies.propellant.inertia";
        return Err(SceneError::value(key, "given", expected));
    }
    Ok(())
}

/// Checks a maneuver by thrusters that use propellant. Returns true if the flow is the price of their forces.
fn check_propellant(file: &ManeuverFile, all: &Thrusters) -> Result<bool, SceneError> {
    check_inertia(all)?;
    if file.final_time.is_some() {
        let expected = "none where `commands` is \"thrusters\" that use propellant";
        return Err(SceneError::value("maneuver.final_time", "given", expected));
    }
    if matches!(file.cost, CostFile::Energy) {
        return Ok(false);
    }
    if let Some(weight) = &file.thruster_weight {
        let expected =
            "none where `cost` is \"fuel\" and thrusters use propellant, which is the cost";
        let key = "maneuver.thruster_weight";
        return Err(SceneError::value(key, weight.given(), expected));
    }
    let mut thrusters = all.thrusters().iter();
    if thrusters.any(|one| one.exhaust_velocity.is_infinite()) {
        let expected = "one of every thruster, or of none, where `cost` is \"fuel\"";
        let key = "bodies.thrusters.exhaust_velocity";
        return Err(SceneError::missing(key, expected));
    }
    Ok(true)
}

pub(super) fn wheels(file: &ManeuverFile, all: &Wheels) -> Result<Actuators, SceneError> {
    let wheels = all.wheels();
    for (name, of) in [
        (
            "viscous_friction",
            wheels
                .iter()
                .map(|one| one.viscous_friction)
                .find(|d| *d > 0.0),
        ),
        (
            "coulomb_friction",
            wheels
                .iter()
                .map(|one| one.coulomb_friction)
                .find(|c| *c > 0.0),
        ),
    ] {
        if let Some(friction) = of {
            let expected = "0 of all wheels that a plan commands, which neglects friction";
            let key = format!("bodies.wheels.{name}");
            return Err(SceneError::value(key, friction, expected));
        }
    }
    let limits: Vec<_> = wheels.iter().map(|one| one.max_torque).collect();
    let by = |weights: &[f64]| Actuation::wheels(all, weights);
    let actuation = weighed(file, Commands::Wheels, limits.len(), by)?;
    Ok((actuation, Some(limit(&limits, |limit| limit)?)))
}

fn limit(
    limits: &[f64],
    sided: impl Fn(CommandLimit) -> CommandLimit,
) -> Result<Constraint, SceneError> {
    let limit = CommandLimit::new(limits)
        .map_err(|error| SceneError::parameter(String::from("maneuver.commands"), error))?;
    Ok(Constraint::commands(sided(limit)))
}

/// The actuation by so many actuators, with their weights.
fn weighed(
    file: &ManeuverFile,
    commands: Commands,
    count: usize,
    by: impl Fn(&[f64]) -> Result<Actuation, ActuationError>,
) -> Result<Actuation, SceneError> {
    let name = commands.name();
    for (key, given) in [
        ("actuators", file.actuators.is_some()),
        ("force_weight", file.force_weight.is_some()),
        ("moment_weight", file.moment_weight.is_some()),
    ] {
        if given {
            let expected = format!("none beside `commands = \"{name}\"`");
            let key = format!("maneuver.{key}");
            return Err(SceneError::value(key, "given", expected));
        }
    }
    check_weights(file, commands)?;
    if count > MAX_COMMANDS {
        let expected = format!("a body with at most {MAX_COMMANDS} {name}");
        return Err(SceneError::value("maneuver.commands", count, expected));
    }
    let weights = [&file.thruster_weight, &file.wheel_weight]
        .into_iter()
        .flatten()
        .next();
    let key = format!("maneuver.{}_weight", name.trim_end_matches('s'));
    let given = weights.map_or(&[1.0][..], EachFile::given);
    let weights = weights.map_or(Some(vec![1.0; count]), |weights| weights.each(count));
    let Some(weights) = weights else {
        let expected = format!("one number, or {count} of them");
        return Err(SceneError::value(key, given, expected));
    };
    for weight in &weights {
        check::positive(&key, *weight)?;
    }
    by(&weights).map_err(|error| {
        let expected = format!("weights and {name} of sizes that can be compared: {error}");
        SceneError::value(key, given, expected)
    })
}

/// Checks that no weights are given but those of the commands.
pub(super) fn check_weights(file: &ManeuverFile, commands: Commands) -> Result<(), SceneError> {
    for (key, of, weight) in [
        (
            "thruster_weight",
            Commands::Thrusters,
            &file.thruster_weight,
        ),
        ("wheel_weight", Commands::Wheels, &file.wheel_weight),
    ] {
        if let (Some(weight), true) = (weight, of != commands) {
            let expected = format!("none unless `commands` is \"{}\"", of.name());
            let key = format!("maneuver.{key}");
            return Err(SceneError::value(key, weight.given(), expected));
        }
    }
    Ok(())
}
