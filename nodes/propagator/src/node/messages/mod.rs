//! ROS messages: of a state, and of what stays as it is.

mod markers;
mod states;
mod transforms;

pub(crate) use markers::markers;
pub(crate) use states::{
    Snapshot, inertia, intervention, invariants, joint_state, odometry, state_header, system_state,
    thruster_states,
};
pub(crate) use transforms::{static_transforms, transforms};
