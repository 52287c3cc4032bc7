use nalgebra::{Matrix3, Vector3};

use crate::{BodyState, Load, Mobility, RigidBody, System};

/// State of a body, or its derivative, as 18 numbers in a row: x, γ, R by columns, Π.
pub(super) type Components = [f64; 18];

/// The numbers of a state.
#[inline]
pub(super) fn pack(state: &BodyState) -> Components {
    let mut y = [0.0; 18];
    y[0..3].copy_from_slice(state.position.as_slice());
    y[3..6].copy_from_slice(state.linear_momentum.as_slice());
    y[6..15].copy_from_slice(state.attitude.as_slice());
    y[15..18].copy_from_slice(state.angular_momentum.as_slice());
    y
}

/// The state of the numbers.
#[inline]
pub(super) fn unpack(y: &Components) -> BodyState {
    BodyState {
        position: Vector3::new(y[0], y[1], y[2]),
        linear_momentum: Vector3::new(y[3], y[4], y[5]),
        attitude: Matrix3::from_columns(&[
            Vector3::new(y[6], y[7], y[8]),
            Vector3::new(y[9], y[10], y[11]),
            Vector3::new(y[12], y[13], y[14]),
        ]),
        angular_momentum: Vector3::new(y[15], y[16], y[17]),
    }
}

/// The equations of motion as a vector field on R¹⁸ for each body:
/// `ẋ = γ/m`, `γ̇ = f + u_f`, `Ṙ = R S(J⁻¹Π)`, `Π̇ = Π × J⁻¹Π + M + u_m`.
///
/// R is nine free numbers: what a method does to its orthogonality is the method's own. Bodies that do not move as
/// told by forces have no derivative where they do not: a driven body is set on its path instead.
pub(super) struct Flow {
    /// Where the field is evaluated.
    states: Vec<BodyState>,
    loads: Vec<Load>,
    controls: Vec<Load>,
}

impl Flow {
    pub(super) fn new(bodies: usize) -> Self {
        Self {
            states: Vec::with_capacity(bodies),
            loads: vec![Load::default(); bodies],
            controls: vec![Load::default(); bodies],
        }
    }

    /// Controls that act from now on.
    pub(super) fn set_controls(&mut self, controls: &[Load]) {
        self.controls.copy_from_slice(controls);
    }

    pub(super) fn controls(&self) -> &[Load] {
        &self.controls
    }

    /// Sets `derivative` to the field at time `t` after the state `begun`, where `place` gives the numbers of a body,
    /// by its index.
    #[inline]
    pub(super) fn evaluate(
        &mut self,
        system: &mut System,
        begun: &[Components],
        t: f64,
        place: impl Fn(usize) -> Components,
        derivative: &mut [Components],
    ) {
        self.states.clear();
        for (index, (body, begun)) in system.bodies().iter().zip(begun).enumerate() {
            self.states.push(match body.mobility() {
                Mobility::Driven(drive) => drive.advance(body, &unpack(begun), t),
                _ => unpack(&place(index)),
            });
        }
        system.loads(&self.states, &mut self.loads);
        let loads = self.loads.iter().zip(&self.controls);
        let states = self.states.iter().zip(loads);
        for ((body, (state, (&load, &control))), derivative) in
            system.bodies().iter().zip(states).zip(derivative)
        {
            *derivative = field(body, state, &(load + control));
        }
    }
}

/// Where a body is at time `t` after `begun`: on its path if it is driven, else where `free` says.
#[inline]
pub(super) fn place(
    body: &RigidBody,
    begun: &Components,
    t: f64,
    free: impl FnOnce() -> Components,
) -> Components {
    match body.mobility() {
        Mobility::Driven(drive) => pack(&drive.advance(body, &unpack(begun), t)),
        _ => free(),
    }
}

#[inline]
fn field(body: &RigidBody, state: &BodyState, load: &Load) -> Components {
    let moves = *body.mobility() == Mobility::Free;
    if !moves && *body.mobility() != Mobility::Pivoted {
        return [0.0; 18];
    }
    let (velocity, force) = if moves {
        (state.linear_momentum / body.mass(), load.force)
    } else {
        (Vector3::zeros(), Vector3::zeros())
    };
    let omega = body.inertia().inverse() * state.angular_momentum;
    let r = &state.attitude;
    let (first, second, third) = (r.column(0), r.column(1), r.column(2));
    pack(&BodyState {
        position: velocity,
        linear_momentum: force,
        attitude: Matrix3::from_columns(&[
            omega.z * second - omega.y * third,
            omega.x * third - omega.z * first,
            omega.y * first - omega.x * second,
        ]),
        angular_momentum: state.angular_momentum.cross(&omega) + load.moment,
    })
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
        let derivative = unpack(&field(&body, &state, &load));
        let omega = state.angular_velocity(&body);
        let close = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm() < 1e-15;
        assert!(close(derivative.position, Vector3::new(0.1, -0.2, 0.4)));
        assert_eq!(derivative.linear_momentum, load.force);
        assert!((derivative.attitude - state.attitude * hat(&omega)).norm() < 1e-15);
        let turning = hat(&state.angular_momentum) * omega;
        assert!(close(derivative.angular_momentum, turning + load.moment));
    }
}
