use lgvi_control::Plan;
use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::stamp::StampError;
use lgvi_scene::{Commands, Scene};
use thiserror::Error;

use crate::sequence::Sequence;
use crate::solver::{End, Initial, Iteration, Reason, Task, Unsolved, solve};
use crate::used::Used;

/// A plan of a scene's maneuver, as it is flown.
#[derive(Clone, Debug)]
pub struct NominalPlan {
    sequence: Sequence,
    remark: String,
    fitting_duration: Option<f64>,
    /// What the plans before it have used.
    used_before: Used,
}

/// Why there is no plan.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{message}")]
pub struct NoPlan {
    /// The kind of reason.
    pub reason: Reason,
    /// The reason in words.
    pub message: String,
}

impl From<Unsolved> for NoPlan {
    fn from(unsolved: Unsolved) -> Self {
        Self {
            reason: unsolved.reason,
            message: unsolved.message,
        }
    }
}

/// Plans the maneuver of `scene` from its nominal state as the node does; `go_on` sees each iteration and is asked whether
/// there is to be another.
///
/// # Errors
/// Why there is no plan.
pub fn plan(
    scene: &Scene,
    go_on: &mut dyn FnMut(&Iteration) -> bool,
) -> Result<NominalPlan, NoPlan> {
    let maneuver = scene.maneuver.as_ref().ok_or_else(no_maneuver)?;
    made(scene, &Task::whole(scene, maneuver), Used::default(), go_on)
}

/// Plans the rest of the maneuver from `first_step` on, at which the body is in `state`, in the scene's units, to arrive when
/// `warm` does. The solver starts from the rest of `warm`; without it, it starts from nothing and arrives at the end of the
/// run. What the wheels store and what propellant is left there are what `warm`, and the plans that it is the rest of, lead to.
///
/// # Errors
/// Why there is no plan; too few steps are left for one among it. Without a plan that has begun by then, a maneuver by wheels or one
/// that uses propellant is refused.
pub fn plan_rest(
    scene: &Scene,
    (first_step, state): (u64, BodyState),
    warm: Option<&NominalPlan>,
    go_on: &mut dyn FnMut(&Iteration) -> bool,
) -> Result<NominalPlan, NoPlan> {
    let arrival = warm.map_or(scene.steps, NominalPlan::arrival);
    let intervals = arrival.saturating_sub(first_step);
    if intervals < 2 {
        let message = format!(
            "`first_step` is {first_step}, expected at least two steps before the arrival at step {arrival}"
        );
        return Err(NoPlan {
            reason: Reason::Refused,
            message,
        });
    }
    let maneuver = scene.maneuver.as_ref().ok_or_else(no_maneuver)?;
    let body = &scene.bodies[maneuver.body].body;
    let flown = warm.filter(|plan| plan.first_step() <= first_step);
    let used = flown.map(|plan| plan.used(scene, body, first_step));
    let task = Task {
        first_step,
        initial: match &used {
            Some(used) => Initial::Known(used.leaves(body, state)),
            None => Initial::State(state),
        },
        end: End::After(intervals as usize),
        guess: flown.map(|plan| plan.sequence.guess(first_step)),
        switches: warm.map(|warm| warm.switches().to_vec()),
    };
    made(scene, &task, used.unwrap_or_default(), go_on)
}

/// Why a plan of one body does not do.
const TOGETHER: &str = "`maneuver.companions` is given, expected none: several bodies are planned together by the planner node, \
                        which `lgvi run` starts";

fn no_maneuver() -> NoPlan {
    NoPlan {
        reason: Reason::Refused,
        message: "the scene has no maneuver".into(),
    }
}

fn made(
    scene: &Scene,
    task: &Task,
    used_before: Used,
    go_on: &mut dyn FnMut(&Iteration) -> bool,
) -> Result<NominalPlan, NoPlan> {
    let maneuver = scene.maneuver.as_ref().ok_or_else(no_maneuver)?;
    if !maneuver.companions.is_empty() {
        return Err(NoPlan {
            reason: Reason::Refused,
            message: TOGETHER.into(),
        });
    }
    let solved = solve(scene, task, go_on)?;
    Ok(NominalPlan {
        remark: solved.remark.clone(),
        fitting_duration: solved.fitting_duration,
        sequence: Sequence::of(maneuver, task.first_step, solved),
        used_before,
    })
}

impl NominalPlan {
    /// What it and the plans before it have used by a step.
    fn used(&self, scene: &Scene, body: &RigidBody, step: u64) -> Used {
        let mut used = self.used_before.clone();
        used.add(scene, body, &self.sequence, step);
        used
    }

    /// The step that it begins at.
    pub fn first_step(&self) -> u64 {
        self.sequence.first_step
    }

    /// The step at which it arrives.
    pub fn arrival(&self) -> u64 {
        self.sequence.arrival()
    }

    /// The steps of the run at which the phases after the first begin; empty if the maneuver has none.
    pub fn switches(&self) -> &[u64] {
        &self.sequence.phased.switches
    }

    /// Its states, controls, gains and certificate, in the scene's units.
    pub fn solution(&self) -> &Plan {
        &self.sequence.plan
    }

    /// Which of several plans it is, and whether it may be no minimum; empty where neither is to be said.
    pub fn remark(&self) -> &str {
        &self.remark
    }

    /// The duration of the run with which the same number of steps takes the shortest time, where that is minimized and steps of the
    /// run's length take longer.
    pub fn fitting_duration(&self) -> Option<f64> {
        self.fitting_duration
    }

    /// Whether it is flown with its feedback law.
    pub fn has_feedback(&self) -> bool {
        self.sequence.limits.is_some()
    }

    /// What it commands.
    pub fn commands(&self) -> Commands {
        self.sequence.commands
    }

    /// One load a step, unless a feedback law corrects them or thrusters or wheels are commanded.
    pub fn open_loop(&self) -> Option<&[Load]> {
        let open = self.sequence.limits.is_none() && self.commands() == Commands::Loads;
        open.then_some(self.sequence.plan.controls.as_slice())
    }

    /// The force and moment that it lets act during `step` on the body in `state`: none if it commands thrusters or wheels.
    pub fn at(&self, step: u64, state: &BodyState) -> Load {
        self.sequence.at(step, state).unwrap_or_default()
    }

    /// What it asks the thrusters or wheels of a body in `state` for during `step`; `None` if it commands force and moment.
    pub fn efforts(&self, step: u64, state: &BodyState) -> Option<Vec<f64>> {
        let commands = self.commands() != Commands::Loads;
        commands.then(|| self.sequence.efforts(step, state).unwrap_or_default())
    }

    /// Its control sequence, as the node publishes it.
    ///
    /// # Errors
    /// A stamp that ROS time cannot hold.
    pub fn message(&self, scene: &Scene) -> Result<ControlSequence, StampError> {
        let body = scene.maneuver.as_ref().map_or(0, |maneuver| maneuver.body);
        self.sequence.message(scene, body, self.first_step())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rest of a plan, from the state that it leads to, is planned as it was.
    #[test]
    fn the_rest_of_a_plan_is_the_plan_of_the_rest() {
        let text = include_str!("../../../scenes/inclination_change.toml");
        let text = text.replace("steps = 1000", "steps = 60");
        let scene = Scene::parse("test", &text).unwrap();
        let whole = plan(&scene, &mut |_| true).unwrap();
        let state = whole.solution().states[23];
        let rest = plan_rest(&scene, (23, state), Some(&whole), &mut |_| true).unwrap();
        assert_eq!((rest.first_step(), rest.arrival()), (23, 60));
        for (one, other) in whole.solution().controls[23..]
            .iter()
            .zip(&rest.solution().controls)
        {
            assert!(
                (one.force - other.force).norm() < 1e-8
                    && (one.moment - other.moment).norm() < 1e-8
            );
        }
        let message = rest.message(&scene).unwrap();
        assert_eq!((message.first_step, message.force.len()), (23, 37));

        let late = plan_rest(&scene, (59, state), Some(&whole), &mut |_| true).unwrap_err();
        assert_eq!(late.reason, Reason::Refused);
        assert!(late.message.contains("`first_step` is 59"), "{late}");
        let stopped = plan(&scene, &mut |_| false).unwrap_err();
        assert_eq!(stopped.reason, Reason::Cancelled);
    }

    /// What is left then is known from the plan before, and from the plan before that.
    #[test]
    fn the_rest_of_a_plan_counts_on_the_propellant_that_is_left() {
        let text = include_str!("../../../scenes/earth_mars.toml");
        let scene = Scene::parse("test", &text.replace("steps = 400", "steps = 60")).unwrap();
        let whole = plan(&scene, &mut |_| true).unwrap();
        let mut last = whole.clone();
        for step in [15, 30] {
            let state = whole.solution().states[step];
            let begin = (step as u64, state);
            let refused = plan_rest(&scene, begin, None, &mut |_| true).unwrap_err();
            assert!(
                refused
                    .message
                    .contains("what propellant is left at a later step"),
                "{refused}"
            );
            last = plan_rest(&scene, begin, Some(&last), &mut |_| true).unwrap();
            let expected = &whole.solution().controls[step..];
            let most = expected.iter().map(|load| load.force.norm());
            let most = most.fold(0.0, f64::max);
            for (one, other) in expected.iter().zip(&last.solution().controls) {
                let apart = (one.force - other.force).norm();
                assert!(apart < 1e-4 * most, "{apart:e} of {most:e}");
            }
        }
    }
}
