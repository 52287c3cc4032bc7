use lgvi_control::{Constraint, Dynamics, Motion};
use lgvi_dynamics::Method;

use crate::file::{
    FinalTimeFile, ManeuverFile, MinimizeFile, ReplanFile, SearchFile, SolverFile, SolverMethodFile,
};
use crate::{
    Commands, FinalTime, Integration, Maneuver, Minimize, Phase, Replan, Scene, SceneError, Search,
    Solver, SolverMethod, check,
};

/// Largest number of starts of a search.
const MAX_STARTS: u32 = 10_000;

/// Largest number of steps of a sequence with feedback: the capacity of shared memory.
const MAX_FEEDBACK_STEPS: u64 = 100_000;

/// The rows of a gain for force and moment. More thrusters or wheels have as many rows as there are.
const ROWS: usize = 6;

/// Largest number of forces of thrusters or torques of wheels in a sequence, likewise.
const MAX_EFFORTS: u64 = 10_000_000;

/// Tolerance within which the bounds of a duration count as whole steps (steps).
const ROUNDING: f64 = 1e-6;

pub(super) fn solver(file: &SolverFile) -> Result<Solver, SceneError> {
    if let Some(tolerance) = file.tolerance {
        check::positive("maneuver.solver.tolerance", tolerance)?;
    }
    Ok(Solver {
        method: match file.method {
            SolverMethodFile::Newton => SolverMethod::Newton,
            SolverMethodFile::Shooting => SolverMethod::Shooting,
        },
        tolerance: file.tolerance,
        max_iterations: file.max_iterations,
    })
}

/// Converts the durations to whole steps of the run, because the plan uses the steps of the flight.
pub(super) fn final_time(
    scene: &Scene,
    file: Option<&FinalTimeFile>,
) -> Result<Option<FinalTime>, SceneError> {
    let Some(file) = file else {
        return Ok(None);
    };
    let (h, duration) = (scene.h(), scene.duration);
    let min = check::positive("maneuver.final_time.min", file.min)?;
    let max = check::positive("maneuver.final_time.max", file.max.unwrap_or(duration))?;
    if max > duration {
        let expected = format!("at most {duration}, the duration of the run");
        return Err(SceneError::value("maneuver.final_time.max", max, expected));
    }
    let min_steps = ((min / h - ROUNDING).ceil() as u64).max(2);
    let max_steps = ((max / h + ROUNDING).floor() as u64).min(scene.steps);
    if min_steps > max_steps {
        let expected = format!("a range that holds a whole number of 2 or more steps of {h}");
        return Err(SceneError::value(
            "maneuver.final_time",
            [min, max],
            expected,
        ));
    }
    check::not_negative("maneuver.final_time.weight", file.weight)?;
    let minimize = match file.minimize {
        MinimizeFile::Cost => Minimize::Cost,
        MinimizeFile::Time => Minimize::Time,
    };
    if minimize == Minimize::Time && file.weight != 0.0 {
        return Err(SceneError::value(
            "maneuver.final_time.weight",
            file.weight,
            "none beside `minimize = \"time\"`",
        ));
    }
    Ok(Some(FinalTime {
        min_steps,
        max_steps,
        weight: file.weight,
        minimize,
    }))
}

pub(super) fn search(file: Option<&SearchFile>) -> Result<Option<Search>, SceneError> {
    let Some(&SearchFile { starts, seed }) = file else {
        return Ok(None);
    };
    if (1..=MAX_STARTS).contains(&starts) {
        Ok(Some(Search { starts, seed }))
    } else {
        let expected = format!("1 to {MAX_STARTS} starts");
        Err(SceneError::value(
            "maneuver.search.starts",
            starts,
            expected,
        ))
    }
}

pub(super) fn replan(
    scene: &Scene,
    file: Option<&ReplanFile>,
) -> Result<Option<Replan>, SceneError> {
    let Some(&ReplanFile { every, deadline }) = file else {
        return Ok(None);
    };
    if !(1..=scene.steps).contains(&every) {
        let expected = format!("1 to {} steps, those of the run", scene.steps);
        return Err(SceneError::value("maneuver.replan.every", every, expected));
    }
    let deadline = check::positive("maneuver.replan.deadline", deadline)?;
    Ok(Some(Replan { every, deadline }))
}

/// Refuses combinations of options that are not supported, naming the key.
pub(super) fn check_combination(
    scene: &Scene,
    maneuver: &Maneuver,
    file: &ManeuverFile,
) -> Result<(), SceneError> {
    if maneuver.solver.method == SolverMethod::Shooting {
        let beyond = [
            ("dynamics", maneuver.dynamics != Dynamics::LieEuler),
            ("actuators", file.actuators.is_some()),
            ("commands", file.commands.is_some()),
            ("final_time", maneuver.final_time.is_some()),
            ("search", maneuver.search.is_some()),
            ("cost", maneuver.actuation.minimizes_fuel()),
        ];
        check_plain(maneuver, &beyond, "`solver.method` is \"shooting\"")?;
        if let Some(drag) = scene.bodies[maneuver.body].body.drag() {
            let key = format!("bodies[{}].drag", maneuver.body);
            let expected = "none where `solver.method` is \"shooting\"";
            return Err(SceneError::value(key, drag.area(), expected));
        }
    }
    if maneuver.processed {
        let flown = matches!(scene.integration, Integration::Method(Method::LieEuler(_)));
        if flown {
            let expected = "false where `run.integrator` is \"lie_euler\": a processed plan is flown by a method of \
                            second order or higher";
            return Err(SceneError::value("maneuver.processed", true, expected));
        }
        let beyond = [
            ("commands", file.commands.is_some()),
            ("dynamics", maneuver.dynamics != Dynamics::LieEuler),
            ("cost", maneuver.actuation.minimizes_fuel()),
        ];
        check_plain(maneuver, &beyond, "`processed` is true")?;
    }
    check_actuators(scene, maneuver, file)?;
    if maneuver.feedback && maneuver.actuation.minimizes_fuel() {
        let expected = "false where `cost` is \"fuel\": commands at their limits do not respond";
        return Err(SceneError::value("maneuver.feedback", true, expected));
    }
    let rows = maneuver.actuators().max(ROWS) as u64;
    let most = MAX_FEEDBACK_STEPS * ROWS as u64 / rows;
    if maneuver.feedback && scene.steps > most {
        let expected = format!("at most {most} steps beside `maneuver.feedback`");
        return Err(SceneError::value("run.steps", scene.steps, expected));
    }
    check_phases(maneuver)?;
    if maneuver.is_relative() && maneuver.final_time.is_some() {
        let expected = "none beside `relative_to`: the axes are known at the times of the run only";
        return Err(SceneError::value("maneuver.final_time", "given", expected));
    }
    match maneuver.final_time.map(|range| range.minimize) {
        None => Ok(()),
        Some(Minimize::Time) => check_minimum_time(maneuver),
        Some(Minimize::Cost) if maneuver.search.is_none() => Ok(()),
        Some(Minimize::Cost) => {
            let expected = "none beside a `final_time` that minimizes the cost";
            Err(SceneError::value("maneuver.search", "given", expected))
        }
    }
}

/// Refuses what does not go with phases.
fn check_phases(maneuver: &Maneuver) -> Result<(), SceneError> {
    if maneuver.phases.is_empty() {
        return Ok(());
    }
    if maneuver.final_time.is_some() {
        let expected =
            "none beside `phases`, which last for the run: give the last one a range, or none";
        return Err(SceneError::value("maneuver.final_time", "given", expected));
    }
    if maneuver.search.is_some() && maneuver.has_free_phases() {
        let expected = "none beside phases whose lengths are to be found";
        return Err(SceneError::value("maneuver.search", "given", expected));
    }
    let limits = |phase: &Phase| phase.constraints.iter().any(Constraint::is_on_commands);
    let limited = maneuver.phases.iter().position(limits);
    if let (true, Some(number)) = (maneuver.feedback, limited) {
        let expected = format!(
            "false beside limits in `maneuver.phases[{number}]`: feedback is held within the limits of all phases only"
        );
        return Err(SceneError::value("maneuver.feedback", true, expected));
    }
    Ok(())
}

/// Refuses what does not go with the least duration.
fn check_minimum_time(maneuver: &Maneuver) -> Result<(), SceneError> {
    let beside = "beside `final_time.minimize = \"time\"`";
    if maneuver.replan.is_some() {
        let expected =
            format!("none {beside}: commands at their limits leave nothing to correct with");
        return Err(SceneError::value("maneuver.replan", "given", expected));
    }
    if maneuver.actuation.minimizes_fuel() {
        let expected = format!("\"energy\" {beside}");
        return Err(SceneError::value("maneuver.cost", "fuel", expected));
    }
    let priced = |constraint: &Constraint| constraint.price();
    let prices = maneuver.constraints.iter().map(priced).enumerate();
    for (index, price) in prices {
        if let Some(price) = price {
            let key = format!("maneuver.constraints[{index}].price");
            let expected = format!("none {beside}: no violation is worth a shorter time");
            return Err(SceneError::value(key, price, expected));
        }
    }
    Ok(())
}

/// Refuses what does not go with thrusters or wheels as commands.
fn check_actuators(
    scene: &Scene,
    maneuver: &Maneuver,
    file: &ManeuverFile,
) -> Result<(), SceneError> {
    let commands = maneuver.commands();
    let name = commands.name();
    let (motion, expected) = match commands {
        Commands::Loads => return Ok(()),
        Commands::Thrusters => (Motion::Full, "\"full\""),
        Commands::Wheels => (Motion::Rotation, "\"rotation\""),
    };
    let numbers = scene
        .steps
        .saturating_mul(maneuver.actuation.commands() as u64);
    if numbers > MAX_EFFORTS {
        let most = MAX_EFFORTS / maneuver.actuation.commands() as u64;
        let expected = format!("at most {most} steps for a plan of so many {name}");
        return Err(SceneError::value("run.steps", scene.steps, expected));
    }
    let mut all = file.all_constraints();
    if let Some((key, _)) = all.find(|(_, constraint)| constraint.is_of_inertial_axes()) {
        let key = format!("{key}.kind");
        let expected = format!("a kind without inertial axes where `commands` is \"{name}\"");
        return Err(SceneError::value(key, "force_components", expected));
    }
    let given = match maneuver.motion {
        Motion::Full => "\"full\"",
        Motion::Translation => "\"translation\"",
        Motion::Rotation => "\"rotation\"",
    };
    let others = [
        ("motion", given, expected, maneuver.motion != motion),
        (
            "dynamics",
            "\"lie_euler\"",
            "\"lgvi\"",
            maneuver.dynamics != Dynamics::Lgvi,
        ),
    ];
    let Some((key, value, expected, _)) = others.iter().find(|(.., wrong)| *wrong) else {
        return check_actuator_feedback(scene, maneuver);
    };
    Err(SceneError::Value {
        line: None,
        key: format!("maneuver.{key}"),
        value: (*value).into(),
        expected: format!("{expected} where `commands` is \"{name}\""),
    })
}

/// Refuses feedback by thrusters or wheels that plans do not know enough of.
fn check_actuator_feedback(scene: &Scene, maneuver: &Maneuver) -> Result<(), SceneError> {
    if !maneuver.feedback {
        return Ok(());
    }
    let refused = |expected: &str| Err(SceneError::value("maneuver.feedback", true, expected));
    if maneuver.uses_propellant(scene) {
        return refused(
            "false where thrusters use propellant: plans do not know how its use deviates",
        );
    }
    if maneuver.all_constraints().any(Constraint::is_on_commands) {
        return refused(
            "false beside limits of commands in `constraints`: feedback knows those of the thrusters or wheels only",
        );
    }
    if maneuver.commands() == Commands::Wheels && maneuver.replan.is_some() {
        return refused(
            "false where wheels are planned anew in flight: plans do not know how their momenta deviate",
        );
    }
    Ok(())
}

/// Refuses any option beyond an open-loop plan of the full motion to a fixed state by Lie–Euler steps.
fn check_plain(maneuver: &Maneuver, beyond: &[(&str, bool)], why: &str) -> Result<(), SceneError> {
    let always = [
        ("motion", maneuver.motion != Motion::Full),
        ("constraints", !maneuver.constraints.is_empty()),
        ("phases", !maneuver.phases.is_empty()),
        ("target", maneuver.target.state().is_none()),
        ("replan", maneuver.replan.is_some()),
        ("feedback", maneuver.feedback),
    ];
    let Some((key, _)) = beyond.iter().chain(&always).find(|(_, given)| *given) else {
        return Ok(());
    };
    let (value, expected) = match *key {
        "dynamics" => ("\"lgvi\"", "\"lie_euler\""),
        "motion" => ("a part of the motion", "\"full\""),
        "cost" => ("\"fuel\"", "\"energy\""),
        "target" => (
            "free in parts",
            "position, velocity, attitude and angular velocity",
        ),
        "feedback" => ("true", "false"),
        _ => ("given", "none"),
    };
    Err(SceneError::Value {
        line: None,
        key: format!("maneuver.{key}"),
        value: value.into(),
        expected: format!("{expected} where {why}"),
    })
}
