//! Rigid bodies under gravity, integrated on SE(3).
//!
//! Pure mathematics: no I/O, no clock, no thread. A [`System`] is bodies and the gravity that acts on them; an
//! [`Integrator`] advances their states by one step; a [`Simulation`] holds all three together, counts the steps, and leaves
//! out what a [`Skip`] allows.
//!
//! Any consistent system of units will do. Vectors are 3-vectors: `x`, `γ` and forces in the inertial frame, `Ω`, `Π`
//! and moments in the body frame. Equation numbers are those of M. Leok, *An Overview of Lie Group Variational
//! Integrators and Their Applications to Optimal Control*.

pub mod auto;
mod body;
pub mod gravity;
mod inertia;
pub mod integrator;
mod invariants;
mod lane;
pub mod lanes;
mod load;
mod mobility;
mod range;
pub mod rotation;
mod simulation;
pub mod skip;
mod state;
mod system;

pub use body::{BodyError, MassDistribution, PointMass, RigidBody};
pub use inertia::{Inertia, InertiaError};
pub use integrator::{Integrator, Method, MethodError, StepError, StepReport};
pub use invariants::Invariants;
pub use load::Load;
pub use mobility::{Drive, Mobility};
pub use simulation::Simulation;
pub use skip::Skip;
pub use state::BodyState;
pub use system::System;
