//! ROS messages of plans and how they come about.

use lgvi_common::{header, pose};
use lgvi_msgs::geometry_msgs::PoseStamped;
use lgvi_msgs::msg::PlanProgress;
use lgvi_msgs::nav_msgs::Path;
use lgvi_msgs::stamp::StampError;
use lgvi_scene::Scene;

use crate::sequence::Sequence;
use crate::solver::Iteration;

/// An iteration of the solver, or how it ended, of a plan that begins at `first_step`.
pub(crate) fn progress(
    scene: &Scene,
    body: usize,
    first_step: u64,
    now: &Iteration,
    (status, message): (u8, String),
) -> Result<PlanProgress, StampError> {
    Ok(PlanProgress {
        header: header(scene, first_step)?,
        body: scene.bodies[body].name.clone(),
        status,
        iteration: now.iteration,
        trials: now.trials,
        step_length: now.step_length,
        violation: now.violation,
        stationarity: now.stationarity,
        cost: now.cost,
        condition: now.condition,
        sufficient: now.sufficient,
        message,
    })
}

/// The planned poses, as often as ROS messages are published.
pub(crate) fn path(scene: &Scene, sequence: &Sequence) -> Result<Path, StampError> {
    let every = scene.publishing.ros_every;
    let arrival = sequence.arrival();
    let chosen = (sequence.first_step..)
        .zip(&sequence.plan.states)
        .filter(|(step, _)| *step == arrival || u64::is_multiple_of(*step, every));
    let stamped = |(step, state)| {
        Ok(PoseStamped {
            header: header(scene, step)?,
            pose: pose(state, &scene.units),
        })
    };
    Ok(Path {
        header: header(scene, sequence.first_step)?,
        poses: chosen.map(stamped).collect::<Result<_, _>>()?,
    })
}
