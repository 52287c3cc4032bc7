use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::{BodyError, BodyState, Mobility, RigidBody};
use lgvi_lie::log;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;
use thiserror::Error;

use super::off::Off;
use super::{
    Actuation, ActuationError, ByStep, Chances, Constraint, Dynamics, InequalitySet, MAX_COMMANDS,
    Motion, ParameterError, Terminal, TerminalSet,
};

/// A vector of components in the order `[x, γ, R, Π]`, three each.
pub(crate) type Vector12 = SVector<f64, 12>;

/// The discrete optimal control problem (§4.2): from a state into a terminal set in a fixed number of steps, with the
/// least cost `Σ (h/2) wᵀ W w` of the commands.
///
/// [`Transfer::new`] plans the full motion by Lie–Euler steps without inequalities; the `with_…` methods change that.
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
    /// The probability with which the inequalities on states hold, if they need not hold always.
    pub(crate) chances: Option<Chances>,
    /// Of a transfer by reaction wheels as it is solved: the positions of the body at `0 … N`, in the transfer's unit of length. The
    /// momentum of the wheels is then in the place of the linear momentum, and the commands act on both.
    pub(crate) orbit: Option<Arc<[Vector3<f64>]>>,
    /// Of such a transfer whose wheels have limits of speed, and exchange momenta among each other: `N` of the exchanged momenta `q̇ = N
    /// u`, which are in the place of positions in its states.
    pub(crate) exchange: Option<Arc<SMatrix<f64, 3, MAX_COMMANDS>>>,
    /// Of a transfer that uses propellant as it is solved: what changes with the mass.
    pub(crate) by_step: Option<Arc<ByStep>>,
    /// Rounding error of `[δx, δγ, ζ, δΠ]` at the end, or zero if it is not known.
    pub(crate) rounding: Vector12,
    /// The commands that are off in each step as it is stated, if any ever is.
    pub(crate) off: Option<Arc<[Off]>>,
}

/// The reason why a transfer is invalid.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum TransferError {
    /// The step size is not a finite positive number.
    #[error("the step is {0}, expected a finite number > 0")]
    Step(f64),
    /// The number of steps is less than 2.
    #[error(
        "the transfer has {0} steps, expected at least 2: one interval cannot reach all twelve coordinates"
    )]
    Steps(usize),
    /// The body is not free to move and turn.
    #[error("the body is {0:?}, expected one that is free to move and turn")]
    Mobility(Mobility),
    /// The initial state is not finite.
    #[error("the initial state is {0:?}, expected finite numbers")]
    Initial(Box<BodyState>),
    /// The commands are not the torques of all wheels of the body.
    #[error(
        "the body has {wheels} reaction wheels and the actuation commands {commands} of them, expected all"
    )]
    Wheels {
        /// Number of wheels of the body.
        wheels: usize,
        /// Number of commands that are torques of wheels.
        commands: usize,
    },
    /// The actuation's torque on a wheel is not about the axis of the body's wheel.
    #[error(
        "torque {wheel} of the actuation does not act about the axis of the body's wheel {wheel}"
    )]
    WheelAxis {
        /// Index of the wheel.
        wheel: usize,
    },
    /// A bearing has friction.
    #[error("the body's wheels have friction, expected none: plans do not know it")]
    WheelFriction,
    /// There are not as many finite momenta as wheels.
    #[error("the momenta of {wheels} wheels are {momenta:?}, expected one finite number for each")]
    WheelMomenta {
        /// Number of wheels of the body.
        wheels: usize,
        /// The momenta.
        momenta: Vec<f64>,
    },
    /// There are not as many commands as thrusters that use propellant.
    #[error(
        "the body has {thrusters} thrusters and the actuation commands {commands} of them, expected all: they use propellant"
    )]
    Thrusters {
        /// Number of thrusters of the body.
        thrusters: usize,
        /// Number of commands.
        commands: usize,
    },
    /// Actuators exert forces on a body whose engine exerts them.
    #[error(
        "the commands are actuators that exert forces, expected force and moment: the body has an engine"
    )]
    EngineActuators,
    /// The propellant has an inertia that is not in proportion to its mass.
    #[error(
        "the propellant has an inertia of its own, expected none: plans let the body's inertia be in proportion to its mass"
    )]
    PropellantInertia,
    /// The propellant that is left is more than all of it, or negative.
    #[error("the propellant that is left is {left}, expected a number from 0 to {most}")]
    Propellant {
        /// Mass of the propellant that is left.
        left: f64,
        /// Mass of all propellant.
        most: f64,
    },
    /// Steps in which commands are off do not exist.
    #[error(
        "commands are off in steps {steps:?}, expected steps of the {intervals} of the transfer"
    )]
    OffSteps {
        /// The steps.
        steps: Range<usize>,
        /// Number of steps of the transfer.
        intervals: usize,
    },
    /// A command that is off does not exist.
    #[error("command {command} is off, expected one of the {count} commands, from 0")]
    OffCommand {
        /// Index of the command.
        command: usize,
        /// Number of commands.
        count: usize,
    },
    /// The body is invalid.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The actuation is invalid.
    #[error(transparent)]
    Actuation(#[from] ActuationError),
    /// The target is invalid.
    #[error("the target's {0}")]
    Terminal(#[from] ParameterError),
}

impl From<Infallible> for TransferError {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

impl Transfer {
    /// A transfer from `initial` into `target` in `intervals` steps of size `h`.
    ///
    /// # Errors
    /// Returns an error if the step size is not positive and finite, if there are fewer than two steps, if the body is
    /// held or driven, or if the initial state or the target is invalid.
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

    /// [`Transfer::new`] in a field that may be shared.
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
        let wheels = body.wheels().map_or(0, |wheels| wheels.wheels().len());
        let commands = match actuation.is_of_wheels() {
            true => actuation.commands(),
            false => 0,
        };
        if wheels != commands {
            return Err(TransferError::Wheels { wheels, commands });
        }
        if let Some(wheels) = body.wheels() {
            if let Some(wheel) = actuation.aside(wheels) {
                return Err(TransferError::WheelAxis { wheel });
            }
            if wheels.have_friction() {
                return Err(TransferError::WheelFriction);
            }
        }
        if let Some(all) = body.thrusters()
            && all.engine().is_some()
        {
            let pushes = actuation.matrix().fixed_rows::<3>(0).amax() > 0.0;
            if pushes && !actuation.is_of_loads() {
                return Err(TransferError::EngineActuators);
            }
            if all.propellant().inertia.is_some() {
                return Err(TransferError::PropellantInertia);
            }
        }
        if let Some(all) = body.thrusters()
            && actuation.is_fixed_to_body()
            && all
                .thrusters()
                .iter()
                .any(|one| one.exhaust_velocity.is_finite())
        {
            let (thrusters, commands) = (all.thrusters().len(), actuation.commands());
            if thrusters != commands {
                return Err(TransferError::Thrusters {
                    thrusters,
                    commands,
                });
            }
            if all.propellant().inertia.is_some() {
                return Err(TransferError::PropellantInertia);
            }
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
            chances: None,
            orbit: None,
            exchange: None,
            by_step: None,
            rounding: Vector12::zeros(),
            off: None,
        })
    }

    /// The position at the start.
    pub(crate) fn place(&self) -> Vector3<f64> {
        match (&self.exchange, &self.orbit) {
            (Some(_), Some(orbit)) => orbit[0],
            _ => self.initial.position,
        }
    }

    /// The transfer with other discrete dynamics.
    pub fn with_dynamics(self, dynamics: Dynamics) -> Self {
        Self { dynamics, ..self }
    }

    /// The transfer for another part of the motion.
    pub fn with_motion(self, motion: Motion) -> Self {
        Self { motion, ..self }
    }

    /// The transfer under inequalities, of which those on states hold at the ends of steps and between them.
    pub fn with_constraints(self, constraints: &[Constraint]) -> Self {
        let inequalities = InequalitySet::new(
            constraints,
            &self.actuation,
            &self.initial,
            &self.terminal,
            self.intervals,
        );
        Self {
            inequalities,
            ..self
        }
    }

    /// [`Transfer::with_constraints`], of which those on states hold at the ends of steps only: the discrete problem, as other
    /// programs state it.
    pub fn with_constraints_at_ends(self, constraints: &[Constraint]) -> Self {
        let mut transfer = self.with_constraints(constraints);
        transfer.inequalities.only_at_ends = true;
        transfer
    }

    /// `W_f⁻¹` and `W_m⁻¹` if the necessary conditions of the problem are (4.19)–(4.26), otherwise `None`.
    pub(crate) fn gains(&self) -> Option<&[Matrix3<f64>; 2]> {
        let plain = self.dynamics == Dynamics::LieEuler
            && self.motion == Motion::Full
            && self.inequalities.is_empty()
            && self.body.drag().is_none()
            && self.off.is_none();
        self.actuation.gains().filter(|_| plain)
    }

    /// The number of control intervals `N`.
    pub fn intervals(&self) -> usize {
        self.intervals
    }

    /// The step size `h`.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// The initial state.
    pub fn initial(&self) -> &BodyState {
        &self.initial
    }

    /// The terminal set.
    pub fn target(&self) -> &Terminal {
        &self.target
    }
}

/// The amount by which `end` misses `target`: `[x − x_d, γ − γ_d, log(R_dᵀ R), Π − Π_d]`.
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

/// Block `which` (0 … 3) of a vector of twelve components.
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
pub(super) mod tests {
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

    /// A transfer of ten steps.
    pub(in crate::problem) fn resting() -> Transfer {
        transfer(Mobility::Free, at_rest()).unwrap()
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
