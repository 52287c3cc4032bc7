use std::fmt;

use lgvi_dynamics::{BodyState, Load};
use nalgebra::{SMatrix, SVector};

/// A solution of a transfer, with all that is needed to fly it, to correct it, to check it and to start the next from.
#[derive(Clone, PartialEq)]
pub struct Plan {
    /// The step `h`; where the final time is free, the step found.
    pub h: f64,
    /// States at `0 … N`.
    pub states: Vec<BodyState>,
    /// Commands `w_1 … w_N`; zero beyond those of the actuation.
    pub commands: Vec<SVector<f64, 6>>,
    /// Controls `u_1 … u_N`, `u = B w`.
    pub controls: Vec<Load>,
    /// Costate `λ_0 … λ_{N−1}` (4.26), pairing with `[δx, δγ, ζ, δΠ]` at the end of each step.
    pub multipliers: Vec<SVector<f64, 12>>,
    /// `K_0 … K_{N−1}` (6×12) of the neighboring extremals: `u_{k+1} = u*_{k+1} − K_k δz_k`.
    pub feedback: Vec<SMatrix<f64, 6, 12>>,
    /// The objective.
    pub cost: f64,
    /// How far it is from optimal.
    pub certificate: Certificate,
}

/// Without what there is of every step.
impl fmt::Debug for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Plan")
            .field("h", &self.h)
            .field("intervals", &self.commands.len())
            .field("cost", &self.cost)
            .field("certificate", &self.certificate)
            .finish_non_exhaustive()
    }
}

/// What can be checked of a plan without trusting the solver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Certificate {
    /// Largest component of the Lagrangian's gradient by the commands, each in units of `√W_ii`, relative to the largest of
    /// its terms. The gradient by the states is zero: the costate is computed so.
    pub stationarity: f64,
    /// Largest norm by which a state misses the step from the one before, relative to the size of each quantity.
    pub defect: f64,
    /// Norm by which the last state misses the terminal set, relative to the size of each quantity (see
    /// [`NewtonSettings::violation`](crate::NewtonSettings::violation)).
    pub terminal: f64,
    /// Largest amount by which an inequality is violated; 0 where none is.
    pub inequality: f64,
    /// Largest product of an inequality's slack and its multiplier, in parts of the cost.
    pub complementarity: f64,
    /// Condition number of the map from initial multipliers to terminal conditions, in the solver's scaling.
    pub condition: f64,
    /// Whether the Hessian of the Lagrangian is positive definite on what the constraints leave free: a strict local
    /// minimum.
    pub sufficient: bool,
}
