//! Rigid bodies under gravity, integrated on SE(3).
//!
//! ```
//! use lgvi_dynamics::gravity::Central;
//! use lgvi_dynamics::nalgebra::{Matrix3, Vector3};
//! use lgvi_dynamics::integrator::Rotor;
//! use lgvi_dynamics::{BodyState, Inertia, Load, Method, PointMass, RigidBody, Simulation, System};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A dumbbell on a circular orbit of period 2π, turning once an orbit.
//! let points = [0.1, -0.1].map(|x| PointMass { mass: 0.5, position: Vector3::new(x, 0.0, 0.0) });
//! let body = RigidBody::new(1.0, Inertia::principal([0.001, 0.01, 0.01])?, points.to_vec())?;
//! let (position, velocity, spin) = (Vector3::x(), Vector3::y(), Vector3::z());
//! let state = BodyState::from_velocities(&body, position, velocity, Matrix3::identity(), spin);
//!
//! let system = System::new(vec![body], vec![Box::new(Central { gm: 1.0 })]);
//! let mut simulation = Simulation::new(system, vec![state], Method::Lgvi(Rotor::Discrete), 0.01)?;
//! let before = simulation.invariants();
//! for _ in 0..10_000 {
//!     simulation.advance(&[Load::default()])?;
//! }
//! let after = simulation.invariants();
//! assert!((after.energy - before.energy).abs() < 1e-5);
//! assert!((after.angular_momentum - before.angular_momentum).norm() < 1e-12);
//! # Ok(())
//! # }
//! ```
//!
//! The crate is purely computational: no I/O, no clock, no threads. A [`System`] consists of bodies and the gravity
//! that acts on them. An [`Integrator`] advances their states by one step. A [`Simulation`] holds all three, counts the
//! steps, and omits the interactions that a [`Skip`] allows it to omit. Bodies may join on the way, see [`docking`].
//!
//! Any consistent system of units can be used. Vectors are 3-vectors: `x`, `γ` and forces in the inertial frame, `Ω`,
//! `Π` and moments in the body frame. Equation numbers refer to M. Leok, *An Overview of Lie Group Variational
//! Integrators and Their Applications to Optimal Control*.

mod accuracy;
pub mod auto;
mod body;
pub mod docking;
pub mod drag;
pub mod gravity;
mod inertia;
pub mod integrator;
mod invariants;
mod lane;
pub mod lanes;
mod load;
mod mobility;
mod quadrature;
mod range;
pub mod rotation;
mod simulation;
pub mod skip;
mod state;
mod system;
pub mod thrusters;
pub mod wheels;

pub use lgvi_lie::nalgebra;

pub use accuracy::Accuracy;
pub use body::{BodyError, MassDistribution, PointMass, RigidBody};
pub use inertia::{Inertia, InertiaError};
pub use integrator::{Integrator, Method, MethodError, StepError, StepReport};
pub use invariants::Invariants;
pub use load::Load;
pub use mobility::{Drive, Mobility};
pub use simulation::Simulation;
pub use skip::Skip;
pub use state::BodyState;
pub use system::{ActuatorStates, System};
