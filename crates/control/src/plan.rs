use std::fmt;

use lgvi_dynamics::{BodyState, Load};
use nalgebra::{SMatrix, SVector};

use crate::{Command, MAX_COMMANDS, Sweep};

/// A solution of a transfer, with the data to fly it, to correct it, to check it and to start the next solution from
/// it.
#[derive(Clone, PartialEq)]
pub struct Plan {
    /// The step size `h`; for a free final time, the one found.
    pub h: f64,
    /// States at `0 … N`.
    pub states: Vec<BodyState>,
    /// Commands `w_1 … w_N`; zero beyond the commands of the actuation.
    pub commands: Vec<Command>,
    /// Controls `u_1 … u_N`, `u = B w`. Forces are in the inertial frame, or in the body frame if the actuators are fixed to
    /// the body.
    pub controls: Vec<Load>,
    /// Costate `λ_0 … λ_{N−1}` (4.26), paired with `[δx, δγ, ζ, δΠ]` at the end of each step.
    pub multipliers: Vec<SVector<f64, 12>>,
    /// Gains `K_0 … K_{N−1}` (6×12) of the neighboring extremals: `u_{k+1} = u*_{k+1} − K_k δz_k`, in the axes of the controls.
    pub feedback: Vec<SMatrix<f64, 6, 12>>,
    /// Gains of the commands where these are of thrusters or wheels, `w_{k+1} = w*_{k+1} − K_k δz_k`; empty otherwise, and at minimum
    /// fuel. They are those of the linearized dynamics without inequalities. Wheels do not answer to position and velocity.
    pub actuator_feedback: Vec<SMatrix<f64, MAX_COMMANDS, 12>>,
    /// The cost of the commands.
    pub cost: f64,
    /// What violations of constraints with a price cost.
    pub paid: f64,
    /// The errors of the optimality conditions.
    pub certificate: Certificate,
    /// What the next plan can start from; the default is to start from the rest of the plan alone.
    pub sweep: Sweep,
}

impl Plan {
    /// The objective: the cost of the commands and of violations with a price.
    pub fn total_cost(&self) -> f64 {
        self.cost + self.paid
    }
}

/// Omits the data of each step.
impl fmt::Debug for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Plan")
            .field("h", &self.h)
            .field("intervals", &self.commands.len())
            .field("cost", &self.cost)
            .field("paid", &self.paid)
            .field("certificate", &self.certificate)
            .finish_non_exhaustive()
    }
}

/// The switching structure of a plan at minimum fuel, of all commands with a price together (of force components, their norm).
///
/// By Pontryagin's principle a command is off where its switching function `|Bᵀ λ|/(h p) − 1` is negative, and at a limit where
/// it is positive. In discrete time a command switches within a step, where it is between.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Switching {
    /// Number of times that a command goes on or off.
    pub switches: usize,
    /// Number of steps, of all commands, at a limit.
    pub at_limit: usize,
    /// Number of steps, of all commands, between 0 and a limit.
    pub between: usize,
    /// Largest number of steps in a row that a command is between: 1 or 2 at a switch, more along a singular arc.
    pub longest: usize,
    /// Largest value of a switching function of the wrong sign, and its largest magnitude where the command is between.
    pub contradiction: f64,
}

impl fmt::Display for Switching {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            switches,
            at_limit,
            between,
            longest,
            contradiction,
        } = self;
        write!(
            f,
            "commands switch {switches} times; {at_limit} of their steps are at a limit, {between} between, {longest} of these in a \
             row; switching functions contradict them by {contradiction:.1e} at most"
        )
    }
}

/// Errors of a plan that can be checked independently of the solver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Certificate {
    /// Largest component of the gradient of the Lagrangian by the commands, in units of `√W_ii`, relative to the
    /// largest of its terms. The gradient by the states is zero by construction of the costate.
    pub stationarity: f64,
    /// Largest norm of the difference between a state and the step from the previous state, relative to the size of
    /// each quantity.
    pub defect: f64,
    /// Norm of the miss of the terminal set, relative to the size of each quantity (see
    /// [`NewtonSettings::violation`](crate::NewtonSettings::violation)).
    pub terminal: f64,
    /// Largest violation of an inequality, or 0 if there is none: of those on states, at the ends of steps and between them.
    pub inequality: f64,
    /// Largest violation of a constraint that has a price, or 0 if there is none.
    pub priced: f64,
    /// Largest product of an inequality's slack and its multiplier, relative to the cost.
    pub complementarity: f64,
    /// Condition number of the map from initial multipliers to terminal conditions, in the solver's scaling.
    pub condition: f64,
    /// True if the Hessian of the Lagrangian is positive definite on the tangent space of the constraints. The plan is
    /// then a strict local minimum.
    pub sufficient: bool,
    /// How the commands switch; `None` unless the cost is that of fuel.
    pub switching: Option<Switching>,
}
