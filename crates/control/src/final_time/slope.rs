use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, Load};
use nalgebra::{SMatrix, SVector};

use crate::problem::Vector12;
use crate::steps::{KickDriftKick, Linearisation, Steps};
use crate::{Dynamics, Plan, Transfer};

/// `dJ/dh` of a transfer's solution, exact: by the envelope theorem the derivative of the Lagrangian by the step at fixed
/// states, commands and multipliers, `Σ ½ wᵀ W w + λ · ∂Φ/∂h`. Terminal conditions and inequalities do not know the step, so
/// they have no part in it.
pub(super) fn by_step<F: Field>(transfer: &Transfer<F>, plan: &Plan) -> Result<f64, Unsolvable> {
    let steps = KickDriftKick::full(transfer);
    let mut linear = Linearisation {
        a: SMatrix::zeros(),
        b: SMatrix::zeros(),
    };
    let mut slope = 0.0;
    let intervals = plan.commands.iter().zip(&plan.multipliers).enumerate();
    for (k, (command, multipliers)) in intervals {
        let [begin, end] = [&plan.states[k], &plan.states[k + 1]];
        steps.linearise(k, begin, command, &mut linear)?;
        let change = change(transfer, begin, end, command, &linear.a);
        slope += transfer.actuation.cost(1.0, command) + multipliers.dot(&change);
    }
    Ok(slope)
}

/// `∂Φ/∂h`.
///
/// A step is a kick, a drift and a kick, and knows `h` only by `h m` and `h² load`, `m` the momenta: with `c h`, `m/c`
/// and `load/c²` it leads to the same pose and to momenta `m⁺/c`. With `m_b` and `m_d` the momenta where the drift begins and
/// ends, Euler's theorem on homogeneous functions gives `h ∂Φ/∂h = A [0, 2 m_b − m] + [0, m⁺ − 2 m_d]`. (Lie–Euler has
/// `m_b = m`, and the formula of §4.2.)
fn change<F: Field>(
    transfer: &Transfer<F>,
    begin: &BodyState,
    end: &BodyState,
    command: &SVector<f64, 6>,
    a: &SMatrix<f64, 12, 12>,
) -> Vector12 {
    let h = transfer.h;
    let [before, after] = match transfer.dynamics {
        Dynamics::LieEuler => [0.0, h],
        Dynamics::Lgvi => [0.5 * h, 0.5 * h],
    };
    let control = transfer.actuation.load(command);
    let kick = |tau: f64, state: &BodyState| {
        let field = &transfer.field;
        tau * impulses(&(field.load(&transfer.body, &state.position, &state.attitude) + control))
    };
    let begun = momenta(begin) + 2.0 * kick(before, begin);
    let ended = 2.0 * kick(after, end) - momenta(end);
    (a * begun + ended) / h
}

/// `[0, γ, 0, Π]`
fn momenta(state: &BodyState) -> Vector12 {
    impulses(&Load {
        force: state.linear_momentum,
        moment: state.angular_momentum,
    })
}

fn impulses(load: &Load) -> Vector12 {
    let mut z = Vector12::zeros();
    z.fixed_rows_mut::<3>(3).copy_from(&load.force);
    z.fixed_rows_mut::<3>(9).copy_from(&load.moment);
    z
}
