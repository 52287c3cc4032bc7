//! ROS messages and samples of a plan.

use lgvi_control::extremal::Extremal;
use lgvi_control::{Iteration, ShootingError};
use lgvi_msgs::geometry_msgs::PoseStamped;
use lgvi_msgs::msg::PlanProgress;
use lgvi_msgs::nav_msgs::Path;
use lgvi_msgs::shm::{ControlHeader, ControlInterval, Name, NameError};
use lgvi_msgs::stamp::StampError;
use lgvi_node::{control_interval, header, pose};
use lgvi_scene::{Maneuver, Scene};

/// An iteration of the solver, or how it ended.
pub(crate) fn progress(
    scene: &Scene,
    maneuver: &Maneuver,
    now: &Iteration,
    outcome: Option<Result<(), &ShootingError>>,
) -> Result<PlanProgress, StampError> {
    let (status, message) = match outcome {
        None => (PlanProgress::SOLVING, String::new()),
        Some(Ok(())) => (PlanProgress::CONVERGED, String::new()),
        Some(Err(error)) => (PlanProgress::FAILED, error.to_string()),
    };
    Ok(PlanProgress {
        header: header(scene, 0)?,
        body: scene.bodies[maneuver.body].name.clone(),
        status,
        iteration: now.iteration,
        trials: now.trials,
        step_length: now.step_length,
        violation: now.violation,
        cost: now.cost,
        message,
    })
}

/// The plan's control sequence as it goes over shared memory.
pub(crate) fn controls(
    scene: &Scene,
    maneuver: &Maneuver,
    plan: &Extremal,
) -> Result<(ControlHeader, Vec<ControlInterval>), NameError> {
    let header = ControlHeader {
        body: Name::try_from(scene.bodies[maneuver.body].name.as_str())?,
        first_step: 0,
        step_size: scene.h() * scene.units.time,
        stamp_nanoseconds: scene.stamp(0),
    };
    let interval = |control| control_interval(control, &scene.units);
    Ok((header, plan.controls.iter().map(interval).collect()))
}

/// The planned poses, as often as ROS messages are published.
pub(crate) fn path(scene: &Scene, plan: &Extremal) -> Result<Path, StampError> {
    let every = scene.publishing.ros_every;
    let chosen = (0..)
        .zip(&plan.states)
        .filter(|(step, _)| *step == scene.steps || u64::is_multiple_of(*step, every));
    let stamped = |(step, state)| {
        Ok(PoseStamped {
            header: header(scene, step)?,
            pose: pose(state, &scene.units),
        })
    };
    Ok(Path {
        header: header(scene, 0)?,
        poses: chosen.map(stamped).collect::<Result<_, _>>()?,
    })
}
