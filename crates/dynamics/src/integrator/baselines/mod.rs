//! Baseline methods for comparison. Nothing else depends on them.

mod anderson;
mod crouch_grossman;
mod implicit_midpoint;
mod runge_kutta;

pub use crouch_grossman::CrouchGrossman;
pub use implicit_midpoint::ImplicitMidpoint;
pub use runge_kutta::RungeKutta;
