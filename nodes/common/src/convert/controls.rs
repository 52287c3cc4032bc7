use lgvi_dynamics::{BodyState, Load};
use lgvi_msgs::geometry_msgs::Vector3;
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::stamp::StampError;
use lgvi_scene::Scene;

use super::feedback::{Gain, Limits, gain_si, reference};
use super::header;

/// The law `u = u* − K δz` of a sequence, in the scene's units.
#[derive(Clone, Copy, Debug)]
pub struct Feedback<'a> {
    /// The states that belong to `u*` at the start of each interval; more are left out.
    pub reference: &'a [BodyState],
    /// `K`, one an interval.
    pub gains: &'a [Gain],
    /// Of the corrected control.
    pub limits: &'a Limits,
}

/// The message of the controls `u*` for `body` from `first_step` on, in the scene's units, with their law or in open loop.
///
/// # Errors
/// A stamp that ROS time cannot hold.
pub fn control_sequence(
    scene: &Scene,
    body: usize,
    first_step: u64,
    controls: &[Load],
    feedback: Option<Feedback<'_>>,
) -> Result<ControlSequence, StampError> {
    let units = &scene.units;
    let name = &scene.bodies[body].name;
    let open = Feedback {
        reference: &[],
        gains: &[],
        limits: &Limits::NONE,
    };
    let law = feedback.unwrap_or(open);
    let references = law.reference.iter().take(controls.len());
    let gains = law.gains.iter().flat_map(|gain| gain_si(gain, units));
    let si: Vec<_> = controls.iter().map(|load| units.load_to_si(load)).collect();
    Ok(ControlSequence {
        header: header(scene, first_step)?,
        body: name.clone(),
        first_step,
        step_size: scene.h() * units.time,
        force: si.iter().map(|load| vector(load.force)).collect(),
        moment: si.iter().map(|load| vector(load.moment)).collect(),
        reference: references
            .map(|state| reference(name, state, units))
            .collect(),
        feedback: gains.collect(),
        limits: law.limits.to_si(units),
        ..ControlSequence::default()
    })
}

fn vector(vector: nalgebra::Vector3<f64>) -> Vector3 {
    let [x, y, z] = vector.into();
    Vector3 { x, y, z }
}
