//! The flight of a plan by wheels, in both halves of the motion.

use std::sync::Arc;

use lgvi_dynamics::rotation::solve_gyrostat;
use lgvi_dynamics::wheels::Wheels;
use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_lie::Quaternion;
use nalgebra::Vector3;

use crate::discrete::DecouplingError;
use crate::solver::PlanError;
use crate::{Command, Transfer};

/// The states of a body under torques of its wheels, at `0 … N`.
pub(super) struct Flight {
    pub(super) states: Vec<BodyState>,
}

/// The flight of torques by the steps of the LGVI.
pub(super) fn fly(transfer: &Transfer, commands: &[Command]) -> Result<Flight, PlanError> {
    let Transfer { body, h, .. } = transfer;
    let momenta = momenta(transfer, *h, commands);
    let mut state = transfer.initial;
    let mut states = vec![state];
    for (step, command) in commands.iter().enumerate() {
        let impulse = 0.5 * h * transfer.actuation.load(command).moment;
        state.angular_momentum += impulse;
        kick(transfer, &mut state);
        body.glide(&mut state, *h, 1.0);
        let middle = 0.5 * (momenta[step] + momenta[step + 1]);
        let stored = total(body.wheels(), &middle);
        let turn = solve_gyrostat(body.inertia(), &stored, *h, &state.angular_momentum)
            .map_err(|source| PlanError::Dynamics { step, source })?;
        let rotation = Quaternion::from_cayley(&turn.cayley);
        let whole = state.angular_momentum + stored;
        let (attitude, whole) = rotation.carry(&state.attitude, &whole);
        state.attitude = attitude;
        state.angular_momentum = whole - stored;
        kick(transfer, &mut state);
        state.angular_momentum += impulse;
        if !state.is_finite() {
            return Err(DecouplingError::NotFinite { step }.into());
        }
        states.push(state);
    }
    Ok(Flight { states })
}

/// Half an impulse of gravity.
fn kick(transfer: &Transfer, state: &mut BodyState) {
    let Transfer { body, field, h, .. } = transfer;
    let load = field.load(body, &state.position, &state.attitude);
    state.linear_momentum += 0.5 * h * load.force;
    state.angular_momentum += 0.5 * h * load.moment;
}

/// The axial momenta of the wheels at `0 … N` in steps of length `h`.
pub(super) fn momenta(transfer: &Transfer, h: f64, commands: &[Command]) -> Vec<Command> {
    let Some(wheels) = transfer.body.wheels() else {
        return Vec::new();
    };
    let mut momenta = Command::zeros();
    for (momentum, state) in momenta.iter_mut().zip(wheels.states()) {
        *momentum = state.momentum;
    }
    let mut all = vec![momenta];
    for command in commands {
        momenta += h * command;
        all.push(momenta);
    }
    all
}

/// The momenta that the wheels store at `0 … N` in steps of length `h`, body frame.
pub(super) fn stored(transfer: &Transfer, h: f64, commands: &[Command]) -> Vec<Vector3<f64>> {
    let momenta = momenta(transfer, h, commands);
    let each = momenta.iter();
    each.map(|momenta| total(transfer.body.wheels(), momenta))
        .collect()
}

fn total(wheels: Option<&Wheels>, momenta: &Command) -> Vector3<f64> {
    let wheels = wheels.into_iter().flat_map(Wheels::wheels);
    let each = wheels.zip(momenta.iter());
    each.map(|(wheel, momentum)| *momentum * wheel.axis).sum()
}

impl Flight {
    pub(super) fn positions(&self) -> Arc<[Vector3<f64>]> {
        self.states.iter().map(|state| state.position).collect()
    }

    /// Checks that no motor would have to exert its torque beyond the limit of its wheel's speed.
    pub(super) fn check_speeds(
        &self,
        transfer: &Transfer,
        commands: &[Command],
    ) -> Result<(), PlanError> {
        let body: &RigidBody = &transfer.body;
        let Some(mut wheels) = body.wheels().cloned() else {
            return Ok(());
        };
        let momenta = momenta(transfer, transfer.h, commands);
        let mut states = wheels.states().to_vec();
        for (step, command) in commands.iter().enumerate() {
            for (state, momentum) in states.iter_mut().zip(&momenta[step]) {
                state.momentum = *momentum;
            }
            wheels.set_states(&states);
            wheels.set_commands(&command.as_slice()[..states.len()]);
            let rate = self.states[step].angular_velocity(body);
            let beyond = wheels.overspeed(&rate, body.inertia().inverse(), transfer.h);
            if let Some((wheel, speed)) = beyond {
                return Err(PlanError::WheelSpeed {
                    wheel,
                    step,
                    speed,
                    limit: wheels.wheels()[wheel]
                        .max_speed
                        .max(wheels.speed(wheel, &rate).abs()),
                });
            }
        }
        Ok(())
    }
}
