use lgvi_dynamics::{BodyState, Load};
use nalgebra::{SVector, Vector3};

use crate::discrete::{
    DecoupledCommands, DecouplingError, DiscreteDynamics, Inputs, KickDriftKick, Linearization,
};
use crate::problem::{Vector12, block};
use crate::{Command, Dynamics, MAX_COMMANDS, Motion, Plan, Transfer, wheels};

/// The derivative `dJ/dh` of a transfer's solution. By the envelope theorem it is the derivative of the Lagrangian by the step size at
/// fixed states, commands and multipliers: `Σ ½ wᵀ W w + λ · ∂Φ/∂h`, what violations with a price cost per unit of time, and `Σ y ∂g/∂h` of
/// limits on the speeds of wheels. Coordinates that follow the free flight depend on the step size, and the planned coordinates depend
/// on them.
///
/// # Assumptions and limitations
/// Terminal conditions and other inequalities do not depend on the step size: those that move are neglected. The orbit along which
/// wheels turn a body is that of the body as if it were not turned. Otherwise the derivative is exact.
pub(super) fn by_step(transfer: &Transfer, plan: &Plan) -> Result<f64, DecouplingError> {
    if transfer.actuation.is_of_wheels() {
        let (stated, plan) = wheels::restated(transfer, plan);
        let steps = KickDriftKick::<_, 2, MAX_COMMANDS>::gyrostat(&stated)?;
        let orbit = free_flight(transfer, 0)?;
        return lagrangian(&stated, &plan, &steps, 0, |command| *command, &orbit);
    }
    let motion = if is_whole(transfer.motion, plan) {
        Motion::Full
    } else {
        transfer.motion
    };
    match motion {
        Motion::Full => {
            let steps = KickDriftKick::<_, 2, MAX_COMMANDS>::full(transfer);
            lagrangian(transfer, plan, &steps, 0, |command| *command, &[])
        }
        Motion::Translation => {
            let commands = DecoupledCommands::forces(&transfer.actuation)?;
            let steps = KickDriftKick::translation(transfer, &commands)?;
            let free = free_flight(transfer, 6)?;
            lagrangian(
                transfer,
                plan,
                &steps,
                0,
                |all| commands.narrowed(all),
                &free,
            )
        }
        Motion::Rotation => {
            let commands = DecoupledCommands::moments(&transfer.actuation)?;
            let steps = KickDriftKick::rotation(transfer, &commands)?;
            let free = free_flight(transfer, 0)?;
            lagrangian(
                transfer,
                plan,
                &steps,
                6,
                |all| commands.narrowed(all),
                &free,
            )
        }
    }
}

/// True if all coordinates were planned. A half that is planned beside the free flight of the other half has no
/// multipliers for the other half.
pub(super) fn is_whole(motion: Motion, plan: &Plan) -> bool {
    let other = match motion {
        Motion::Full => return true,
        Motion::Translation => 6,
        Motion::Rotation => 0,
    };
    let rows = |lambda: &Vector12| lambda.fixed_rows::<6>(other).amax();
    plan.multipliers.iter().any(|lambda| rows(lambda) > 0.0)
}

/// The derivative of the Lagrangian. The plan's coordinates begin with index `first`; the others, if any, change with
/// the step size as given by `free`.
fn lagrangian<S: DiscreteDynamics<X, U>, const X: usize, const U: usize>(
    transfer: &Transfer,
    plan: &Plan,
    steps: &S,
    first: usize,
    narrowed: impl Fn(&Command) -> SVector<f64, U>,
    free: &[Vector12],
) -> Result<f64, DecouplingError> {
    let own = |all: &Vector12| all.fixed_rows::<X>(first).into_owned();
    let mut linear = Linearization::default();
    let none = Inputs::<U>::none();
    let mut slope = plan.paid / transfer.h + plan.sweep.by_step_size();
    let intervals = plan.commands.iter().zip(&plan.multipliers);
    for (k, ((command, lambda), ends)) in intervals.zip(plan.states.windows(2)).enumerate() {
        steps
            .linearize(k, &ends[0], &narrowed(command), &mut linear)
            .map_err(|source| DecouplingError::Unsolvable { step: k, source })?;
        let control = transfer.actuation.load(command);
        let [begin, mut end] = changes(transfer, ends, &control, free.get(k..k + 2));
        if let Some(exchange) = &transfer.exchange {
            let mut exchanged = end.fixed_rows_mut::<3>(0);
            exchanged += **exchange * command;
        }
        let mut change = linear.forward(&none, &own(&begin), &SVector::zeros()) + own(&end);
        if transfer.body.drag().is_some() {
            let by_rotation = steps.by_rotation_of_air(k, &ends[0], &narrowed(command));
            change += linear.after_drift::<X>(&by_rotation) / transfer.h;
        }
        slope += transfer.actuation.cost(1.0, command) + own(lambda).dot(&change);
    }
    Ok(slope)
}

/// `[0, δγ, 0, δΠ]` at the beginning and at the end of a step, with `∂Φ/∂h = A begin + end`.
///
/// A step is a kick, a drift and a kick. It depends on `h` only through `h m` and `h² load`, where `m` are the momenta:
/// with `c h`, `m/c` and `load/c²` it leads to the same pose and to momenta `m⁺/c`. Let `m_b` and `m_d` be the momenta
/// at the beginning and at the end of the drift. Euler's theorem on homogeneous functions gives `h ∂Φ/∂h = A [0, 2 m_b
/// − m] + [0, m⁺ − 2 m_d]`. (Lie–Euler has `m_b = m`.) Drag keeps this if the angular velocity of the air is `ω/c`; as it is
/// ω, `∂Φ/∂h` has `(1/h) ω · ∂Φ/∂ω` in addition, which the callers add. Coordinates that are not planned change the kicks in addition;
/// `free` holds their changes at both ends.
fn changes(
    transfer: &Transfer,
    ends: &[BodyState],
    control: &Load,
    free: Option<&[Vector12]>,
) -> [Vector12; 2] {
    let (h, field, body) = (transfer.h, &transfer.field, &transfer.body);
    let lengths = match transfer.dynamics {
        Dynamics::LieEuler => [0.0, h],
        Dynamics::Lgvi => [0.5 * h, 0.5 * h],
    };
    // Gravity does not act on what the wheels of a gyrostat store, in the place of the linear momentum.
    let acting = |load: Load| match transfer.orbit {
        Some(_) => Load {
            force: Vector3::zeros(),
            ..load
        },
        None => load,
    };
    std::array::from_fn(|at| {
        let state = &ends[at];
        let (x, r) = (&state.position, &state.attitude);
        let momenta = Load {
            force: state.linear_momentum,
            moment: state.angular_momentum,
        };
        let sign = if at == 0 { 1.0 } else { -1.0 };
        let control = transfer.actuation.in_inertial_axes(control, r);
        let load = impulses(&(acting(field.load(body, x, r)) + control));
        let mut change = (sign * impulses(&momenta) + 2.0 * lengths[at] * load) / h;
        if let Some(free) = free {
            let (position, attitude) = (block(&free[at], 0), block(&free[at], 2));
            let g = field.gradient(body, x, r);
            let by_free = acting(Load {
                force: g.force_by_position * position + g.force_by_attitude * attitude,
                moment: g.moment_by_position * position + g.moment_by_attitude * attitude,
            });
            change += lengths[at] * impulses(&by_free);
        }
        change
    })
}

/// The derivatives of the free flight's states at `0 … N` by the step size: six coordinates starting at index `first`;
/// the others are zero.
fn free_flight(transfer: &Transfer, first: usize) -> Result<Vec<Vector12>, DecouplingError> {
    let steps = KickDriftKick::<_, 2, 6>::full(transfer);
    let mut linear = Linearization::default();
    let none = Inputs::<6>::none();
    let mut state = transfer.initial;
    let mut change = Vector12::zeros();
    let half = |change: &Vector12| {
        let mut half = Vector12::zeros();
        let own = change.fixed_rows::<6>(first);
        half.fixed_rows_mut::<6>(first).copy_from(&own);
        half
    };
    let mut all = vec![half(&change)];
    for step in 0..transfer.intervals {
        let next = steps
            .linearize(step, &state, &SVector::zeros(), &mut linear)
            .map_err(|source| DecouplingError::Unsolvable { step, source })?;
        let [begin, end] = changes(transfer, &[state, next], &Load::default(), None);
        change = linear.forward(&none, &(change + begin), &SVector::<f64, 6>::zeros()) + end;
        if transfer.body.drag().is_some() {
            let by_rotation = steps.by_rotation_of_air(step, &state, &SVector::zeros());
            change += linear.after_drift::<12>(&by_rotation) / transfer.h;
        }
        all.push(half(&change));
        state = next;
    }
    Ok(all)
}

/// `[0, force, 0, moment]`
fn impulses(load: &Load) -> Vector12 {
    let mut z = Vector12::zeros();
    z.fixed_rows_mut::<3>(3).copy_from(&load.force);
    z.fixed_rows_mut::<3>(9).copy_from(&load.moment);
    z
}

#[cfg(test)]
mod tests;
