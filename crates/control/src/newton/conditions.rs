//! Conditions on a plan besides its dynamics, as the Newton iteration sees them.

use lgvi_dynamics::BodyState;
use nalgebra::{SMatrix, SVector};

use super::step_size::BySize;
use crate::riccati::StageModel;

/// The terminal set: conditions `c(s_N) = 0` on the last state.
pub(crate) trait Ending<const X: usize> {
    /// `c` at `end`; rows without a condition are zero, here and in the derivatives.
    fn residual(&self, end: &BodyState) -> SVector<f64, X>;

    /// `C`: first derivatives of `z ↦ c(moved(end, z))` at 0.
    fn jacobian(&self, end: &BodyState) -> SMatrix<f64, X, X>;

    /// Second derivatives of `z ↦ ν · c(moved(end, z))` at 0, symmetric.
    fn curvature(&self, end: &BodyState, nu: &SVector<f64, X>) -> SMatrix<f64, X, X>;
}

/// Inequalities, treated by an interior point method.
///
/// Interval `k = 0 … N−1` has the command `w_{k+1}` and the state `s_{k+1}` at its end. Slacks and multipliers belong
/// to the implementation. A Newton step calls [`Inequalities::add_state`] and [`Inequalities::add_command`] for every
/// interval, then [`Inequalities::direct`] for every interval, then the merit of trials, then
/// [`Inequalities::advance`].
pub(crate) trait Inequalities<const X: usize, const U: usize> {
    /// True if there are no inequalities.
    const NONE: bool = false;

    /// Adds the contributions of the interval's state inequalities at `state` to the gradient and the Hessian, with
    /// slacks and multipliers eliminated. The second derivatives are multiplied by `curvature`.
    fn add_state(
        &mut self,
        interval: usize,
        state: &BodyState,
        curvature: f64,
        hessian: &mut SMatrix<f64, X, X>,
        gradient: &mut SVector<f64, X>,
    );

    /// Adds the contributions of the interval's command inequalities in the same way.
    fn add_command(
        &mut self,
        interval: usize,
        command: &SVector<f64, U>,
        hessian: &mut SMatrix<f64, U, U>,
        gradient: &mut SVector<f64, U>,
    );

    /// Adds the contributions of inequalities on the state at the start of the interval and its command together.
    fn add_joint(
        &mut self,
        _interval: usize,
        _state: &BodyState,
        _command: &SVector<f64, U>,
        _stage: &mut StageModel<X, U>,
    ) {
    }

    /// The contributions of the same to the gradient of the Lagrangian, by the state at the start and by the command; `None` if there
    /// are no such inequalities.
    fn joint_force(
        &self,
        _interval: usize,
        _state: &BodyState,
        _command: &SVector<f64, U>,
    ) -> Option<(SVector<f64, X>, SVector<f64, U>)> {
        None
    }

    /// `Σ y ∂g/∂z`: the contribution of the inequalities to the gradient of the Lagrangian by the interval's state,
    /// used for the costate.
    fn state_force(&self, interval: usize, state: &BodyState) -> SVector<f64, X>;

    /// `Σ y ∂g/∂w`: the contribution to the gradient by the interval's command, used for the stationarity.
    fn command_force(&self, interval: usize, command: &SVector<f64, U>) -> SVector<f64, U>;

    /// Takes the Newton direction of the states at the interval's start and end and of its command, and computes that of its
    /// multipliers.
    fn direct(
        &mut self,
        interval: usize,
        start: &SVector<f64, X>,
        z: &SVector<f64, X>,
        v: &SVector<f64, U>,
    );

    /// The longest step, at most 1, that keeps all multipliers of all intervals positive.
    fn reach(&self) -> f64;

    /// The longest step to try, at most 1.
    fn room(&self) -> f64 {
        1.0
    }

    /// The penalty of the interval, with the states at its ends, in the merit of a trial.
    fn merit(&self, interval: usize, ends: [&BodyState; 2], command: &SVector<f64, U>) -> f64;

    /// The derivative of the penalties along the direction, for all intervals.
    fn slope(&self) -> f64;

    /// Sets whether inequalities on states give way in the model: they add nothing to the Hessian.
    fn give_way(&mut self, _give_way: bool) {}

    /// The largest price of a command for an interval, in these units of gradients by commands.
    fn price(&self, _units: &SVector<f64, U>) -> f64 {
        0.0
    }

    /// The cost of all intervals beside the quadratic one.
    fn cost(&self) -> f64 {
        0.0
    }

    /// Moves the multipliers by a step.
    fn advance(&mut self, step: f64);

    /// The largest violation `max(g, 0)` that is forbidden and the largest product of slack and multiplier relative to the cost, over all
    /// intervals.
    fn residuals(&self) -> (f64, f64);

    /// The largest violation `max(g, 0)` of inequalities whose violation has a price.
    fn priced(&self) -> f64 {
        0.0
    }

    /// What violations and positions cost that have a price.
    fn paid(&self) -> f64 {
        0.0
    }

    /// The multipliers of each inequality on states at the ends of all intervals.
    fn multipliers(&self) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// `Σ y ∂g/∂h` of inequalities that depend on the step size.
    fn by_step_size(&self, _commands: &[SVector<f64, U>]) -> f64 {
        0.0
    }

    /// What inequalities that depend on the step size add to the model of an interval with this command, where the state at its start and
    /// the command change with the step size as given. Follows [`Inequalities::add_joint`].
    fn by_step_size_in(
        &mut self,
        _interval: usize,
        _command: &SVector<f64, U>,
        _changes: (&SVector<f64, X>, &SVector<f64, U>),
    ) -> BySize<X, U> {
        BySize::default()
    }

    /// Sets the step size, and its change along the direction.
    fn set_step_size(&mut self, _h: f64, _change: f64) {}

    /// Lowers β if the subproblem with the current β is solved to `error`. Returns `false` if nothing changed.
    fn tighten(&mut self, error: f64) -> bool;

    /// Reports whether a point that solves the last subproblem satisfies the inequalities.
    fn satisfied(&self) -> Satisfied;
}

/// State of the inequalities at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Satisfied {
    /// They hold, and the multipliers are complementary.
    Yes,
    /// They hold, and the multipliers are as accurate as rounding allows.
    ToRounding,
    /// They do not hold yet.
    NotYet,
    /// They cannot be satisfied: the point is a local minimum of their violation.
    Never,
}

/// No inequalities.
pub(crate) struct Unconstrained;

impl<const X: usize, const U: usize> Inequalities<X, U> for Unconstrained {
    const NONE: bool = true;

    fn add_state(
        &mut self,
        _: usize,
        _: &BodyState,
        _: f64,
        _: &mut SMatrix<f64, X, X>,
        _: &mut SVector<f64, X>,
    ) {
    }

    fn add_command(
        &mut self,
        _: usize,
        _: &SVector<f64, U>,
        _: &mut SMatrix<f64, U, U>,
        _: &mut SVector<f64, U>,
    ) {
    }

    fn state_force(&self, _: usize, _: &BodyState) -> SVector<f64, X> {
        SVector::zeros()
    }

    fn command_force(&self, _: usize, _: &SVector<f64, U>) -> SVector<f64, U> {
        SVector::zeros()
    }

    fn direct(&mut self, _: usize, _: &SVector<f64, X>, _: &SVector<f64, X>, _: &SVector<f64, U>) {}

    fn reach(&self) -> f64 {
        1.0
    }

    fn merit(&self, _: usize, _: [&BodyState; 2], _: &SVector<f64, U>) -> f64 {
        0.0
    }

    fn slope(&self) -> f64 {
        0.0
    }

    fn advance(&mut self, _: f64) {}

    fn residuals(&self) -> (f64, f64) {
        (0.0, 0.0)
    }

    fn tighten(&mut self, _: f64) -> bool {
        false
    }

    fn satisfied(&self) -> Satisfied {
        Satisfied::Yes
    }
}
