//! Several bodies planned together.

use std::fmt::Display;
use std::sync::Arc;

use lgvi_control::{FormationError, PlanError, solve_together};
use lgvi_scene::{Maneuver, Scene};
use tracing::info;

#[cfg(feature = "node")]
use super::foretold;
use super::{End, Initial, NO_MANEUVER, Observe, Reason, Solved, Task, Unsolved, newton_settings};

const STATES: &str = "bodies that are planned together are planned from the states of all of them: from the start of the scene, or in flight by the planner node";

/// One of so many iterations is told of: rounds have many short ones.
const EVERY: u32 = 5;

/// Plans all bodies of the maneuver, from the start of the scene or from where they will be.
pub(super) fn solve(
    scene: &Scene,
    maneuver: &Maneuver,
    task: &Task,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    let refused = |error: &dyn Display| Unsolved::new(Reason::Refused, error);
    let start = |planned: &Maneuver| scene.bodies[planned.body].state;
    let (initial, seen): (Vec<_>, Option<Maneuver>) = match &task.initial {
        Initial::State(state) if task.first_step == 0 && *state == start(maneuver) => {
            (maneuver.planned().map(start).collect(), None)
        }
        Initial::State(_) | Initial::Known(_) => return Err(refused(&STATES)),
        #[cfg(feature = "node")]
        Initial::Forecast(forecast) => {
            let (predicted, seen) = foretold(scene, maneuver, forecast, task.first_step)?;
            let states: Vec<_> = predicted.iter().map(|body| body.state).collect();
            (states, seen)
        }
    };
    let maneuver = seen.as_ref().unwrap_or(maneuver);
    let (End::After(intervals), Some(separation)) = (task.end, maneuver.separation) else {
        return Err(refused(&NO_MANEUVER));
    };
    let transfers = scene.transfers_of(maneuver, &initial, intervals);
    let transfers = transfers.map_err(|error| refused(&error))?;
    let warm = (task.guess.as_ref()).map_or_else(Vec::new, |guess| guess.remaining(&transfers));
    let settings = newton_settings(&maneuver.solver);
    let mut count = 0_u32;
    let found = solve_together(&transfers, separation, &warm, &settings, |now| {
        count += 1;
        !count.is_multiple_of(EVERY) || observe(&now.into())
    })
    .map_err(|error| unsolved(scene, maneuver, error))?;
    let agreement = found.agreement;
    let [one, other] = agreement.nearest.map(|body| scene.planned_name(body));
    let remark = format!(
        "planned together in {} rounds, prices agree to {:.1e}; {one} and {other} come nearest, to {:.6} m",
        agreement.rounds,
        agreement.price,
        agreement.distance * scene.units.length
    );
    info!("{remark}");
    let mut plans = found.plans.into_iter();
    let Some(plan) = plans.next() else {
        return Err(refused(&NO_MANEUVER));
    };
    let mut solved = Solved {
        companions: plans.collect(),
        ..Solved::new(plan, remark)
    };
    solved.describe();
    solved.seen = seen.map(Arc::new);
    Ok(solved)
}

/// The error in the names of the scene.
fn unsolved(scene: &Scene, maneuver: &Maneuver, error: FormationError) -> Unsolved {
    let name = |body: usize| scene.planned_name(body);
    match error {
        FormationError::Stopped => Unsolved::new(Reason::Cancelled, "stopped"),
        FormationError::Body { body, source } => {
            let mut unsolved = Unsolved::from(*source);
            unsolved.best = None;
            let part = maneuver.planned().nth(body);
            let told = unsolved.violated.as_ref().zip(part);
            let told =
                told.map(|(violated, part)| violated.told(scene, part, scene.steps as usize, &[]));
            let mut message = told.unwrap_or(unsolved.message);
            if let Some(index) = body.checked_sub(1) {
                let key = format!("maneuver.companions[{index}].constraints");
                message = message.replace("maneuver.constraints", &key);
            }
            Unsolved {
                message: format!("{}: {message}", name(body)),
                ..unsolved
            }
        }
        FormationError::Apart { bodies, source } => {
            let [one, other] = bodies.map(name);
            let reason = Unsolved::from((*source).clone()).reason;
            let how = match *source {
                PlanError::Infeasible {
                    step, violation, ..
                } => format!(
                    "the start or the target fixes the state at step {step}, which is too near by {violation:.3e}"
                ),
                PlanError::NotFound {
                    step, violation, ..
                } => format!("the closest plan is too near at step {step} by {violation:.3e}"),
                PlanError::Between {
                    step, violation, ..
                } => format!(
                    "within step {step} the closest plan is too near by {violation:.3e}; shorter steps may help"
                ),
                ref error => error.to_string(),
            };
            let message = format!(
                "no plan keeps {other} away from {one} by `maneuver.separation`: {how} (in parts of it)"
            );
            Unsolved::new(reason, message)
        }
        FormationError::Unsettled { .. } => Unsolved::new(Reason::NotConverged, error),
        error => Unsolved::new(Reason::Refused, error),
    }
}

#[cfg(test)]
mod tests {
    use lgvi_propagator::{Controls, Flight};

    use super::*;
    use crate::sequence::Sequence;
    use crate::solver::solve;

    const SCENE: &str = include_str!("../../../../scenes/formation_change.toml");

    fn scene() -> Scene {
        Scene::parse("test", &SCENE.replace("steps = 150", "steps = 60")).unwrap()
    }

    /// The sequences of all bodies lead them to their targets, and apart.
    #[test]
    fn a_formation_is_flown_to_its_targets() {
        let scene = scene();
        let maneuver = scene.maneuver.as_ref().unwrap();
        let task = Task::whole(&scene, maneuver);
        let solved = solve(&scene, &task, &mut |_| true).unwrap();
        let remark = &solved.remark;
        assert!(remark.starts_with("planned together in "), "{remark}");
        let whole = Sequence::of(maneuver, 0, solved);
        let bodies: Vec<_> = whole.all().map(|one| one.body).collect();
        assert_eq!(bodies, [1, 2, 3]);
        let mut flight = Flight::new(&scene).unwrap();
        for one in whole.all() {
            assert!(!flight.commanded(one.body));
            let message = one.message(&scene, one.body, 0).unwrap();
            let controls = Controls::of_message(&scene, &message).unwrap();
            flight.accept(controls).unwrap();
            assert!(flight.commanded(one.body));
        }
        let mut nearest = f64::INFINITY;
        while flight.step() < 60 {
            flight.advance().unwrap();
            let states = flight.states();
            for [one, other] in [[1, 2], [1, 3], [2, 3]] {
                nearest = nearest.min((states[one].position - states[other].position).norm());
            }
        }
        assert!(nearest > 40.0 * (1.0 - 1e-7), "{nearest}");
        assert!(
            nearest < 40.5,
            "they give way no more than they must: {nearest}"
        );
        let misses = scene.misses(flight.system().bodies(), flight.states());
        assert_eq!(misses.len(), 3);
        assert!(
            misses
                .iter()
                .all(|miss| miss.is_some_and(|miss| miss.norm() < 1e-6)),
            "{misses:?}"
        );
    }

    #[test]
    fn formations_are_planned_from_the_states_of_all_bodies_and_by_the_node() {
        let scene = scene();
        let start = scene.bodies[1].state;
        for (first_step, state) in [(5, start), (0, scene.bodies[2].state)] {
            let task = Task {
                first_step,
                initial: Initial::State(state),
                end: End::After(50),
                guess: None,
                switches: None,
            };
            let refused = solve(&scene, &task, &mut |_| true).unwrap_err();
            assert_eq!(refused.reason, Reason::Refused);
            assert_eq!(refused.message, STATES);
        }
        let refused = crate::plan(&scene, &mut |_| true).unwrap_err();
        assert_eq!(refused.reason, Reason::Refused);
        assert!(
            refused.message.contains("`maneuver.companions`"),
            "{refused}"
        );
        let stopped = solve(
            &scene,
            &Task::whole(&scene, scene.maneuver.as_ref().unwrap()),
            &mut |_| false,
        );
        assert_eq!(stopped.unwrap_err().reason, Reason::Cancelled);
    }

    #[test]
    fn errors_have_the_names_of_the_bodies() {
        let narrow = "[[maneuver.companions]]\nbody = \"light\"\n";
        let limited =
            format!("{narrow}constraints = [{{ kind = \"force_norm\", limit = 1e-3 }}]\n");
        assert!(SCENE.contains(narrow));
        let text = SCENE
            .replace(narrow, &limited)
            .replace("steps = 150", "steps = 60");
        let scene = Scene::parse("test", &text).unwrap();
        let task = Task::whole(&scene, scene.maneuver.as_ref().unwrap());
        let error = solve(&scene, &task, &mut |_| true).unwrap_err();
        assert_eq!(error.reason, Reason::Infeasible);
        let expected = "violates force_norm (maneuver.companions[0].constraints[0]) by ";
        let told = &error.message;
        assert!(
            told.starts_with("light: ") && told.contains(expected),
            "{told}"
        );

        let source = Box::new(PlanError::NotFound {
            constraint: 0,
            step: 7,
            violation: 0.25,
        });
        let bodies = [0, 2];
        let apart = FormationError::Apart { bodies, source };
        let error = unsolved(&scene, scene.maneuver.as_ref().unwrap(), apart);
        assert_eq!(error.reason, Reason::Infeasible);
        let expected = "no plan keeps third away from heavy by `maneuver.separation`: the closest plan is too near at step 7 by 2.500e-1 (in parts of it)";
        assert_eq!(error.message, expected);
    }
}
