use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::{BodyError, BodyState, Mobility, RigidBody};
use lgvi_lie::log;
use nalgebra::{Matrix3, SVector, Vector3};
use std::convert::Infallible;
use std::sync::Arc;
use thiserror::Error;

use super::{
    Actuation, ActuationError, Constraint, Dynamics, InequalitySet, Motion, ParameterError,
    Terminal, TerminalSet,
};

/// Components in the order `[x, γ, R, Π]`, three each.
pub(crate) type Vector12 = SVector<f64, 12>;

/// The discrete optimal control problem (§4.2): from a state into a terminal set in a fixed number of steps, at the least
/// cost `Σ (h/2) wᵀ W w` of the commands.
///
/// [`Transfer::new`] asks for a plan of the full motion by Lie–Euler steps without inequalities; the `with_…` methods
/// change that.
#[derive(Clone)]
pub struct Transfer {
    pub(crate) body: RigidBody,
    pub(crate) field: Arc<dyn Field>,
    pub(crate) h: f64,
    pub(crate) intervals: usize,
    pub(crate) initial: BodyState,
    pub(crate) target: Terminal,
    pub(crate) actuation: Actuation,
    pub(crate) dynamics: Dynamics,
    pub(crate) motion: Motion,
    pub(crate) terminal: TerminalSet,
    pub(crate) inequalities: InequalitySet,
    /// What rounding makes of `[δx, δγ, ζ, δΠ]` at the end, where that is known.
    pub(crate) rounding: Vector12,
}

/// Why a transfer is not a problem.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TransferError {
    /// The step is not a positive number.
    #[error("the step is {0}, expected a finite number > 0")]
    Step(f64),
    /// There are too few steps.
    #[error(
        "the transfer has {0} steps, expected at least 2: one interval cannot reach all twelve coordinates"
    )]
    Steps(usize),
    /// The body does not move as loads tell.
    #[error("the body is {0:?}, expected one that is free to move and turn")]
    Mobility(Mobility),
    /// The initial state is not finite.
    #[error("the initial state is {0:?}, expected finite numbers")]
    Initial(Box<BodyState>),
    /// The body is none.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The actuation is none.
    #[error(transparent)]
    Actuation(#[from] ActuationError),
    /// The target is none.
    #[error("the target's {0}")]
    Terminal(#[from] ParameterError),
}

impl From<Infallible> for TransferError {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

impl Transfer {
    /// From `initial` into `target` in `intervals` steps of `h`.
    ///
    /// # Errors
    /// A step that is not positive, fewer than two steps, a body that is held or driven, an initial state or a target that is
    /// none.
    pub fn new(
        body: RigidBody,
        field: impl Field + 'static,
        h: f64,
        intervals: usize,
        initial: BodyState,
        target: impl TryInto<Terminal, Error: Into<TransferError>>,
        actuation: Actuation,
    ) -> Result<Self, TransferError> {
        let target = target.try_into().map_err(Into::into)?;
        Self::in_field(
            body,
            Arc::new(field),
            h,
            intervals,
            initial,
            target,
            actuation,
        )
    }

    /// [`Transfer::new`] in a field that others may share.
    pub(crate) fn in_field(
        body: RigidBody,
        field: Arc<dyn Field>,
        h: f64,
        intervals: usize,
        initial: BodyState,
        target: Terminal,
        actuation: Actuation,
    ) -> Result<Self, TransferError> {
        if !(h.is_finite() && h > 0.0) {
            return Err(TransferError::Step(h));
        }
        if intervals < 2 {
            return Err(TransferError::Steps(intervals));
        }
        if *body.mobility() != Mobility::Free {
            return Err(TransferError::Mobility(*body.mobility()));
        }
        if !initial.is_finite() {
            return Err(TransferError::Initial(Box::new(initial)));
        }
        let terminal = TerminalSet::from(&target);
        Ok(Self {
            body,
            field,
            h,
            intervals,
            initial,
            target,
            actuation,
            dynamics: Dynamics::default(),
            motion: Motion::default(),
            terminal,
            inequalities: InequalitySet::default(),
            rounding: Vector12::zeros(),
        })
    }

    /// The same by other discrete dynamics.
    pub fn with_dynamics(self, dynamics: Dynamics) -> Self {
        Self { dynamics, ..self }
    }

    /// The same for other motions.
    pub fn with_motion(self, motion: Motion) -> Self {
        Self { motion, ..self }
    }

    /// The transfer under inequalities.
    pub fn with_constraints(self, constraints: &[Constraint]) -> Self {
        let inequalities =
            InequalitySet::new(constraints, &self.actuation, &self.initial, &self.terminal);
        Self {
            inequalities,
            ..self
        }
    }

    /// `W_f⁻¹` and `W_m⁻¹` of a problem whose necessary conditions are (4.19)–(4.26); `None` for all others.
    pub(crate) fn gains(&self) -> Option<&[Matrix3<f64>; 2]> {
        let plain = self.dynamics == Dynamics::LieEuler
            && self.motion == Motion::Full
            && self.inequalities.is_empty();
        self.actuation.gains().filter(|_| plain)
    }

    /// Number of control intervals `N`.
    pub fn intervals(&self) -> usize {
        self.intervals
    }

    /// The step `h`.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// Where it starts.
    pub fn initial(&self) -> &BodyState {
        &self.initial
    }

    /// Where it is to end.
    pub fn target(&self) -> &Terminal {
        &self.target
    }
}

/// By how much `end` misses `target`: `[x − x_d, γ − γ_d, log(R_dᵀ R), Π − Π_d]`.
pub fn miss(target: &BodyState, end: &BodyState) -> SVector<f64, 12> {
    let mut miss = Vector12::zeros();
    let parts = [
        end.position - target.position,
        end.linear_momentum - target.linear_momentum,
        log(&target.attitude.tr_mul(&end.attitude)),
        end.angular_momentum - target.angular_momentum,
    ];
    for (which, part) in parts.iter().enumerate() {
        miss.fixed_rows_mut::<3>(3 * which).copy_from(part);
    }
    miss
}

/// Block `which` (0 … 3) of a vector of twelve.
pub(crate) fn block(v: &Vector12, which: usize) -> Vector3<f64> {
    v.fixed_rows::<3>(3 * which).into_owned()
}

/// The inverse of a symmetric positive definite weight.
pub(crate) fn invert(
    which: &'static str,
    weight: &Matrix3<f64>,
) -> Result<Matrix3<f64>, ActuationError> {
    let refuse = || {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| weight[(i, j)]));
        ActuationError::Weight { which, rows }
    };
    if *weight != weight.transpose() {
        return Err(refuse());
    }
    weight
        .cholesky()
        .map(|factors| factors.inverse())
        .ok_or_else(refuse)
}

#[cfg(test)]
mod tests {
    use lgvi_dynamics::Inertia;
    use lgvi_dynamics::gravity::Sources;

    use super::*;

    fn transfer(mobility: Mobility, initial: BodyState) -> Result<Transfer, TransferError> {
        let inertia = Inertia::principal([1.0, 1.0, 1.0]).unwrap();
        let body = RigidBody::new(1.0, inertia, Vec::new()).unwrap();
        let weight = Matrix3::identity();
        Transfer::new(
            body.with_mobility(mobility),
            Sources::new(Vec::new()),
            0.1,
            10,
            initial,
            at_rest(),
            Actuation::full(&weight, &weight).unwrap(),
        )
    }

    fn at_rest() -> BodyState {
        BodyState {
            position: Vector3::zeros(),
            linear_momentum: Vector3::zeros(),
            attitude: Matrix3::identity(),
            angular_momentum: Vector3::zeros(),
        }
    }

    #[test]
    fn only_free_bodies_in_finite_states_are_planned() {
        assert!(transfer(Mobility::Free, at_rest()).is_ok());
        for held in [Mobility::Pivoted, Mobility::Fixed] {
            let refused = transfer(held, at_rest()).err();
            assert_eq!(refused, Some(TransferError::Mobility(held)));
        }
        let mut nowhere = at_rest();
        nowhere.angular_momentum.y = f64::NAN;
        let refused = transfer(Mobility::Free, nowhere).err();
        assert!(matches!(refused, Some(TransferError::Initial(_))));
    }

    #[test]
    fn only_symmetric_positive_definite_weights_are_weights() {
        let definite = Matrix3::new(2.0, 0.5, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 3.0);
        assert!(
            (invert("force", &definite).unwrap() * definite - Matrix3::identity()).norm() < 1e-15
        );
        let mut skewed = definite;
        skewed[(0, 2)] = 0.1;
        let indefinite = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
        let not_a_number = Matrix3::from_diagonal_element(f64::NAN);
        for bad in [skewed, indefinite, Matrix3::zeros(), not_a_number] {
            assert!(matches!(
                invert("moment", &bad),
                Err(ActuationError::Weight {
                    which: "moment",
                    ..
                })
            ));
        }
    }
}
