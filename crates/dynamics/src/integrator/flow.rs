use nalgebra::{Matrix3, Vector3};

use crate::{BodyState, Load, Mobility, RigidBody, System};

/// The state of a body, or its derivative, as 18 numbers: x, γ, R by columns, Π.
pub(super) type Components = [f64; 18];

/// Converts a state to components.
#[inline]
pub(super) fn pack(state: &BodyState) -> Components {
    let mut y = [0.0; 18];
    y[0..3].copy_from_slice(state.position.as_slice());
    y[3..6].copy_from_slice(state.linear_momentum.as_slice());
    y[6..15].copy_from_slice(state.attitude.as_slice());
    y[15..18].copy_from_slice(state.angular_momentum.as_slice());
    y
}

/// Sets `state` from components.
#[inline]
pub(super) fn unpack_to(y: &Components, state: &mut BodyState) {
    state.position.as_mut_slice().copy_from_slice(&y[0..3]);
    state
        .linear_momentum
        .as_mut_slice()
        .copy_from_slice(&y[3..6]);
    state.attitude.as_mut_slice().copy_from_slice(&y[6..15]);
    state
        .angular_momentum
        .as_mut_slice()
        .copy_from_slice(&y[15..18]);
}

/// Converts components to a state.
pub(super) fn unpack(y: &Components) -> BodyState {
    let mut state = BodyState {
        position: Vector3::zeros(),
        linear_momentum: Vector3::zeros(),
        attitude: Matrix3::zeros(),
        angular_momentum: Vector3::zeros(),
    };
    unpack_to(y, &mut state);
    state
}

/// The equations of motion as a vector field on R¹⁸ for each body: `ẋ = γ/m`, `γ̇ = f + u_f` and drag, `Ṙ = R S(J⁻¹Π)`, `Π̇ =
/// Π × J⁻¹Π + M + u_m`.
///
/// R is treated as nine independent numbers, and the integrator is responsible for its orthogonality. Derivatives of
/// components that do not follow the equations of motion are zero. A driven body is placed on its prescribed path
/// instead.
pub(super) struct Flow {
    /// States at which the field is evaluated.
    states: Vec<BodyState>,
    loads: Vec<Load>,
    controls: Vec<Load>,
}

impl Flow {
    pub(super) fn new(bodies: usize) -> Self {
        Self {
            states: vec![unpack(&[0.0; 18]); bodies],
            loads: vec![Load::default(); bodies],
            controls: vec![Load::default(); bodies],
        }
    }

    /// Sets the controls.
    pub(super) fn set_controls(&mut self, controls: &[Load]) {
        self.controls.copy_from_slice(controls);
    }

    pub(super) fn controls(&self) -> &[Load] {
        &self.controls
    }

    /// Sets `derivative` to the field at time `t` after the state `begun`. `place` sets the components of the body with
    /// the given index.
    #[inline]
    pub(super) fn evaluate(
        &mut self,
        system: &mut System,
        begun: &[Components],
        t: f64,
        place: impl Fn(usize, &mut Components),
        derivative: &mut [Components],
    ) {
        let mut y = [0.0; 18];
        for (index, (body, state)) in system.bodies().iter().zip(&mut self.states).enumerate() {
            if let Mobility::Driven(drive) = body.mobility() {
                *state = drive.advance(body, &unpack(&begun[index]), t);
            } else {
                place(index, &mut y);
                unpack_to(&y, state);
            }
        }
        system.loads(&self.states, &mut self.loads);
        let loads = self.loads.iter().zip(&self.controls);
        let states = self.states.iter().zip(loads);
        for ((body, (state, (load, control))), derivative) in
            system.bodies().iter().zip(states).zip(derivative)
        {
            field(body, state, load, control, derivative);
        }
    }
}

/// Sets `end` to the components of a body at time `t` after `begun`: on its prescribed path if it is driven, else as
/// `free` sets them.
#[inline]
pub(super) fn place(
    body: &RigidBody,
    begun: &Components,
    t: f64,
    end: &mut Components,
    free: impl FnOnce(&mut Components),
) {
    match body.mobility() {
        Mobility::Driven(drive) => *end = pack(&drive.advance(body, &unpack(begun), t)),
        _ => free(end),
    }
}

#[inline]
fn field(
    body: &RigidBody,
    state: &BodyState,
    load: &Load,
    control: &Load,
    derivative: &mut Components,
) {
    match body.mobility() {
        Mobility::Free => {
            let velocity = state.linear_momentum / body.mass();
            let mut force = load.force + control.force;
            if let Some(drag) = body.drag() {
                force += drag.force(&state.position, &velocity);
            }
            derivative[0..3].copy_from_slice(velocity.as_slice());
            derivative[3..6].copy_from_slice(force.as_slice());
        }
        Mobility::Pivoted => derivative[0..6].fill(0.0),
        Mobility::Fixed | Mobility::Driven(_) => {
            derivative.fill(0.0);
            return;
        }
    }
    let omega = body.inertia().inverse() * state.angular_momentum;
    let r = &state.attitude;
    for i in 0..3 {
        derivative[6 + i] = omega.z * r[(i, 1)] - omega.y * r[(i, 2)];
        derivative[9 + i] = omega.x * r[(i, 2)] - omega.z * r[(i, 0)];
        derivative[12 + i] = omega.y * r[(i, 0)] - omega.x * r[(i, 1)];
    }
    let mut momentum = state.angular_momentum;
    if let Some(wheels) = body.wheels() {
        momentum += wheels.momentum();
    }
    let moment = momentum.cross(&omega) + (load.moment + control.moment);
    derivative[15..18].copy_from_slice(moment.as_slice());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Inertia;
    use lgvi_lie::hat;

    #[test]
    fn the_field_is_the_equations_of_motion() {
        let inertia = Matrix3::new(2.0, 0.1, -0.2, 0.1, 3.0, 0.3, -0.2, 0.3, 2.5);
        let body = RigidBody::new(4.0, Inertia::new(inertia).unwrap(), vec![]).unwrap();
        let state = BodyState {
            position: Vector3::new(1.0, 2.0, 3.0),
            linear_momentum: Vector3::new(0.4, -0.8, 1.6),
            attitude: lgvi_lie::exp(&Vector3::new(0.3, 1.0, -0.4)),
            angular_momentum: Vector3::new(-0.5, 0.7, 0.2),
        };
        assert_eq!(unpack(&pack(&state)), state);
        let load = Load {
            force: Vector3::new(1.0, -1.0, 2.0),
            moment: Vector3::new(0.1, 0.2, 0.3),
        };
        let mut derivative = [0.0; 18];
        field(&body, &state, &load, &Load::default(), &mut derivative);
        let derivative = unpack(&derivative);
        let omega = state.angular_velocity(&body);
        let close = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm() < 1e-15;
        assert!(close(derivative.position, Vector3::new(0.1, -0.2, 0.4)));
        assert_eq!(derivative.linear_momentum, load.force);
        assert!((derivative.attitude - state.attitude * hat(&omega)).norm() < 1e-15);
        let turning = hat(&state.angular_momentum) * omega;
        assert!(close(derivative.angular_momentum, turning + load.moment));
    }
}
