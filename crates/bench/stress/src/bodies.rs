//! Bodies and flights that trials are made of.

use lgvi_dynamics::gravity::Gravity;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, StepError, System};
use nalgebra::{Matrix3, Vector3};

use crate::TrialError;

/// The method that most trials are about.
pub(crate) const LGVI: Method = Method::Lgvi(Rotor::Discrete);

/// The unit of rounding: the distance of 1 from the next number.
pub(crate) const ULP: f64 = f64::EPSILON;

/// A body of mass 1 with these principal moments.
pub(crate) fn body(moments: [f64; 3]) -> Result<RigidBody, TrialError> {
    Ok(RigidBody::new(1.0, Inertia::principal(moments)?, vec![])?)
}

/// A sphere of this mass.
pub(crate) fn sphere(mass: f64) -> Result<RigidBody, TrialError> {
    let inertia = Inertia::principal([0.4 * mass; 3])?;
    Ok(RigidBody::new(mass, inertia, vec![])?)
}

/// At rest at the origin but for its turning, with the attitude I.
pub(crate) fn turning(body: &RigidBody, omega: Vector3<f64>) -> BodyState {
    let zero = Vector3::zeros();
    BodyState::from_velocities(body, zero, zero, Matrix3::identity(), omega)
}

/// Moving without turning, with the attitude I.
pub(crate) fn moving(
    body: &RigidBody,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
) -> BodyState {
    let (r, zero) = (Matrix3::identity(), Vector3::zeros());
    BodyState::from_velocities(body, position, velocity, r, zero)
}

/// One free body.
pub(crate) fn free(
    body: RigidBody,
    state: BodyState,
    method: Method,
    h: f64,
) -> Result<Simulation, TrialError> {
    Ok(Simulation::new(
        System::new(vec![body], vec![]),
        vec![state],
        method,
        h,
    )?)
}

/// Bodies under one kind of gravity.
pub(crate) fn under(
    gravity: impl Gravity + 'static,
    bodies: Vec<RigidBody>,
    states: Vec<BodyState>,
    method: Method,
    h: f64,
) -> Result<Simulation, TrialError> {
    let system = System::new(bodies, vec![Box::new(gravity)]);
    Ok(Simulation::new(system, states, method, h)?)
}

/// Makes steps without controls.
pub(crate) fn fly(simulation: &mut Simulation, steps: u64) -> Result<(), StepError> {
    let controls = [Load::default(); 2];
    let controls = &controls[..simulation.states().len()];
    for _ in 0..steps {
        simulation.advance(controls)?;
    }
    Ok(())
}

/// `|a − b| / |b|`
pub(crate) fn relative(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    (a - b).norm() / b.norm()
}

/// Keeps the greatest of values; one that is no number is greater than any.
pub(crate) fn keep(greatest: &mut f64, value: f64) {
    if !greatest.is_nan() && (value > *greatest || value.is_nan()) {
        *greatest = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_is_no_number_is_kept() {
        let mut greatest = 0.0;
        for (value, expected) in [(2.0, 2.0), (1.0, 2.0)] {
            keep(&mut greatest, value);
            assert_eq!(greatest, expected);
        }
        keep(&mut greatest, f64::NAN);
        keep(&mut greatest, 3.0);
        assert!(greatest.is_nan());
    }
}
