use lgvi_dynamics::{BodyState, Load};
use lgvi_msgs::geometry_msgs::Vector3;
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::stamp::StampError;
use lgvi_scene::{Commands, Scene};

use super::feedback::{DEVIATIONS, Gain, Limits, gain_si, reference, row_units};
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

/// The message of what thrusters or wheels of `body` are asked for from `first_step` on, in the scene's units and by rows an interval,
/// with their law or in open loop: the states that belong to them at the start of each interval, and the rows of gains.
///
/// # Errors
/// A stamp that ROS time cannot hold.
pub fn actuator_sequence(
    scene: &Scene,
    body: usize,
    first_step: u64,
    commands: Commands,
    efforts: &[f64],
    law: Option<(&[BodyState], &[f64])>,
) -> Result<ControlSequence, StampError> {
    let units = &scene.units;
    let unit = match commands {
        Commands::Wheels => units.energy(),
        Commands::Thrusters | Commands::Loads => units.force(),
    };
    let efforts = efforts.iter().map(|effort| effort * unit).collect();
    let [thrust, wheel_torque] = match commands {
        Commands::Wheels => [Vec::new(), efforts],
        Commands::Thrusters | Commands::Loads => [efforts, Vec::new()],
    };
    let (references, gains) = law.unwrap_or_default();
    let name = &scene.bodies[body].name;
    let row = row_units(unit, units);
    let gains = gains
        .chunks(DEVIATIONS)
        .flat_map(|gains| gains.iter().zip(row));
    Ok(ControlSequence {
        thrust,
        wheel_torque,
        reference: (references.iter().map(|state| reference(name, state, units))).collect(),
        feedback: gains.map(|(gain, unit)| gain * unit).collect(),
        ..control_sequence(scene, body, first_step, &[], None)?
    })
}

fn vector(vector: nalgebra::Vector3<f64>) -> Vector3 {
    let [x, y, z] = vector.into();
    Vector3 { x, y, z }
}
