use lgvi_control::Plan;
use lgvi_dynamics::{BodyState, Load};
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::stamp::StampError;
use lgvi_scene::{Commands, Scene};
use thiserror::Error;

use crate::sequence::Sequence;
use crate::solver::{End, Guess, Initial, Iteration, Reason, Task, Unsolved, solve};

/// A plan of a scene's maneuver, as it is flown.
#[derive(Clone, Debug)]
pub struct NominalPlan {
    sequence: Sequence,
    remark: String,
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
    made(scene, &Task::whole(scene, maneuver), go_on)
}

/// Plans the rest of the maneuver from `first_step` on, at which the body is in `state`, in the scene's units, to arrive when
/// `warm` does. The solver starts from the rest of `warm`; without it, it starts from nothing and arrives at the end of the
/// run.
///
/// # Errors
/// Why there is no plan; too few steps are left for one among it.
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
    let guess = |plan: &NominalPlan| {
        let flown = first_step.checked_sub(plan.first_step())?;
        Some(Guess {
            plan: plan.sequence.plan.clone(),
            flown: flown as usize,
        })
    };
    let task = Task {
        first_step,
        initial: Initial::State(state),
        end: End::After(intervals as usize),
        guess: warm.and_then(guess),
        switches: warm.map(|warm| warm.switches().to_vec()),
    };
    made(scene, &task, go_on)
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
        sequence: Sequence::of(maneuver, task.first_step, solved),
    })
}

impl NominalPlan {
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
}
