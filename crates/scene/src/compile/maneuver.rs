mod actuation;
mod actuators;
mod chances;
mod constraints;
mod formation;
mod options;
mod phases;
mod prediction;
mod relative;
mod target;

pub(super) use chances::chances;
pub(crate) use constraints::ConstraintFile;
pub(super) use formation::check_formation;
pub use prediction::Seen;
pub(crate) use relative::Relative;

use lgvi_control::{Dynamics, Motion, Transfer};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Method, Mobility};

use crate::file::{
    CommandsFile, CostFile, DynamicsFile, ManeuverFile, MotionFile, SolverMethodFile,
};
use crate::scene::{NamedBody, Scene};
use crate::{Commands, FinalTime, Integration, Maneuver, Minimize, SceneError};
use prediction::Predictions;

/// Largest number of steps of a maneuver: the planner keeps all of them in memory, and one message holds the sequence.
const MAX_MANEUVER_STEPS: u64 = 1_000_000;

/// Compiles the maneuver of a scene that has none yet, with its companions.
pub(super) fn maneuver<'s>(
    scene: &'s Scene,
    file: &'s ManeuverFile,
) -> Result<Maneuver, SceneError> {
    let alone = of_body(scene, file)?;
    formation::joined(scene, alone, file)
}

/// Compiles the part of one body.
fn of_body<'s>(scene: &'s Scene, file: &'s ManeuverFile) -> Result<Maneuver, SceneError> {
    let body = scene.body_index(&file.body).ok_or_else(|| {
        let names: Vec<_> = scene.bodies.iter().map(|body| body.name.as_str()).collect();
        SceneError::unknown("maneuver.body", &file.body, &names)
    })?;
    check_actuators(scene, body, file)?;
    check_field(scene, body)?;
    if !(2..=MAX_MANEUVER_STEPS).contains(&scene.steps) {
        let expected = format!("2 to {MAX_MANEUVER_STEPS} steps for a maneuver");
        return Err(SceneError::value("run.steps", scene.steps, expected));
    }
    let motion = match file.motion {
        MotionFile::Full => Motion::Full,
        MotionFile::Translation => Motion::Translation,
        MotionFile::Rotation => Motion::Rotation,
    };
    let rigid = &scene.bodies[body].body;
    let (actuation, actuator_limit) = match (file.commands, rigid.thrusters(), rigid.wheels()) {
        (Some(CommandsFile::Thrusters), Some(thrusters), _) => {
            actuators::thrusters(file, thrusters)?
        }
        (Some(CommandsFile::Wheels), _, Some(wheels)) => actuators::wheels(file, wheels)?,
        (_, Some(all), _) if motion != Motion::Rotation => {
            actuators::engine(scene, file, all, motion)?
        }
        _ => (actuation::actuation(file, motion)?, None),
    };
    let mut predictions = Predictions::new(scene, body);
    let target = target::target(scene, body, &file.target, motion, &mut predictions)?;
    let given = (&file.constraints[..], "maneuver.constraints");
    let predicted = &mut predictions;
    let constraints = constraints::constraints(scene, rigid, given, motion, &actuation, predicted)?;
    let phases = phases::phases(scene, body, file, motion, &actuation, &mut predictions)?;
    let actuation = match file.cost {
        CostFile::Energy => actuation,
        CostFile::Fuel => {
            let limits: Vec<_> = constraints.iter().chain(&actuator_limit).cloned().collect();
            actuation::minimizing_fuel(&actuation, &limits, motion)?
        }
    };
    let maneuver = Maneuver {
        body,
        target,
        predicted: file.target.relative_to.is_some(),
        relative: Relative::of(file),
        constraints,
        phases,
        chances: None,
        actuator_limit,
        actuation,
        dynamics: dynamics(scene, file),
        processed: file.processed,
        motion,
        final_time: options::final_time(scene, file.final_time.as_ref())?,
        solver: options::solver(&file.solver)?,
        search: options::search(file.search.as_ref())?,
        replan: options::replan(scene, file.replan.as_ref())?,
        feedback: file.feedback,
        separation: None,
        companions: Vec::new(),
    };
    options::check_combination(scene, &maneuver, file)?;
    Ok(maneuver)
}

/// Checks that the body has the actuators that are commanded, and no others.
fn check_actuators(scene: &Scene, body: usize, file: &ManeuverFile) -> Result<(), SceneError> {
    let named = &scene.bodies[body];
    let expected = match file.commands {
        Some(CommandsFile::Wheels) if named.wheels.is_empty() => {
            "a body with `wheels`, where `commands` is \"wheels\""
        }
        Some(CommandsFile::Wheels) if !named.thrusters.is_empty() => {
            "a body without `thrusters`, where `commands` is \"wheels\""
        }
        Some(CommandsFile::Wheels) => return Ok(()),
        _ if !named.wheels.is_empty() => {
            "a body without `wheels`, where `commands` is not \"wheels\""
        }
        Some(CommandsFile::Thrusters) if named.thrusters.is_empty() => {
            "a body with `thrusters`, where `commands` is \"thrusters\""
        }
        None if !named.thrusters.is_empty() => {
            "a body without `thrusters`, where `commands` is not \"thrusters\""
        }
        _ => return Ok(()),
    };
    Err(SceneError::value("maneuver.body", &file.body, expected))
}

/// Checks that all commands are limited where the duration is minimized.
pub(super) fn check_limits(scene: &Scene, transfer: &Transfer) -> Result<(), SceneError> {
    let Some(maneuver) = &scene.maneuver else {
        return Ok(());
    };
    let minimized = |range: FinalTime| range.minimize == Minimize::Time;
    if !maneuver.final_time.is_some_and(minimized) {
        return Ok(());
    }
    let Some(command) = transfer.unlimited_command() else {
        return Ok(());
    };
    if maneuver.commands() == Commands::Wheels {
        let wheel = &scene.bodies[maneuver.body].wheels[command];
        let expected = format!("one of wheel \"{wheel}\" beside `final_time.minimize = \"time\"`");
        return Err(SceneError::missing("bodies.wheels.max_torque", expected));
    }
    let loads =
        maneuver.actuation.commands() == LOADS.len() && maneuver.commands() == Commands::Loads;
    let name = match LOADS.get(command) {
        Some(name) if loads => (*name).to_string(),
        _ => format!("command {command}"),
    };
    Err(SceneError::Value {
        line: None,
        key: "maneuver.constraints".into(),
        value: format!("without a limit of {name}"),
        expected: "limits of all commands beside `final_time.minimize = \"time\"`".into(),
    })
}

/// Names of the commands where they are force and moment.
const LOADS: [&str; 6] = [
    "the force along x",
    "the force along y",
    "the force along z",
    "the moment about x",
    "the moment about y",
    "the moment about z",
];

/// Returns if translation is planned, and if rotation is planned.
fn moves(motion: Motion) -> (bool, bool) {
    (motion != Motion::Rotation, motion != Motion::Translation)
}

/// Returns the dynamics that the maneuver asks for. By default these are the dynamics of the scene's integrator, or
/// those closest to it.
fn dynamics(scene: &Scene, file: &ManeuverFile) -> Dynamics {
    match (file.dynamics, scene.integration) {
        (Some(DynamicsFile::LieEuler), _) => Dynamics::LieEuler,
        (Some(DynamicsFile::Lgvi), _) => Dynamics::Lgvi,
        (None, _) if file.processed => Dynamics::LieEuler,
        (None, Integration::Method(Method::LieEuler(_))) => Dynamics::LieEuler,
        (None, _) => Dynamics::Lgvi,
    }
}

/// Returns the method that flies a maneuver if the scene leaves the choice open: the method of the planned steps, or
/// for a processed plan the method that it is conjugate to. The default is of second order, unless the solver only
/// supports Lie–Euler steps.
pub(super) fn method(file: &ManeuverFile) -> Method {
    let shot = matches!(file.solver.method, SolverMethodFile::Shooting);
    match file.dynamics {
        _ if file.processed => Method::Lgvi(Rotor::default()),
        Some(DynamicsFile::LieEuler) => Method::LieEuler(Rotor::default()),
        None if shot => Method::LieEuler(Rotor::default()),
        Some(DynamicsFile::Lgvi) | None => Method::Lgvi(Rotor::default()),
    }
}

/// Checks the planner's assumption: one free body in a field that does not change with time.
fn check_field(scene: &Scene, body: usize) -> Result<(), SceneError> {
    let controlled = &scene.bodies[body];
    if *controlled.body.mobility() != Mobility::Free {
        let expected = "a body that is free to move";
        return Err(SceneError::value(
            "maneuver.body",
            &controlled.name,
            expected,
        ));
    }
    let Some(constant) = scene.gravity.mutual else {
        return Ok(());
    };
    let moving = scene
        .bodies
        .iter()
        .enumerate()
        .find(|(index, other)| *index != body && *other.body.mobility() != Mobility::Fixed);
    match moving {
        None => Ok(()),
        Some((_, NamedBody { name, .. })) => {
            let expected = format!(
                "no mutual gravity beside a maneuver unless all other bodies are fixed: \
                 the field of {name} would move, and the planner knows none that does"
            );
            Err(SceneError::value(
                "gravity.mutual.constant",
                constant,
                expected,
            ))
        }
    }
}
