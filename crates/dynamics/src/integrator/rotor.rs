//! The rotation of one body over a drift, for each kind of rotor.

use lgvi_lie::Quaternion;
use nalgebra::{Matrix3, Vector3};

use super::warm_start::Solutions;
use crate::rotation::{DiscreteRotation, FreeRotation, Gyrostat, Unsolvable};
use crate::{BodyState, Inertia, RigidBody};

/// The computation of a body's rotation over a drift.
pub(super) trait BodyRotation {
    /// Sets `next` to `R F` and `Fᵀ p` for the rotation over `h` from attitude R and angular momentum p. Returns false
    /// if the first pass does not find the rotation.
    fn carry(
        &self,
        from: (&Matrix3<f64>, &Vector3<f64>),
        h: f64,
        solutions: &mut Solutions<f64>,
        next: &mut BodyState,
    ) -> bool;

    /// Rotates `state` over `h`, with as many iterations as needed. Returns their number.
    fn carry_any(
        &self,
        state: &mut BodyState,
        h: f64,
        solutions: &mut Solutions<f64>,
    ) -> Result<u32, Unsolvable>;
}

impl BodyRotation for DiscreteRotation<f64> {
    #[inline(always)]
    fn carry(
        &self,
        (r, p): (&Matrix3<f64>, &Vector3<f64>),
        h: f64,
        solutions: &mut Solutions<f64>,
        next: &mut BodyState,
    ) -> bool {
        let Some((rotation, correction)) = self.first_pass(h, p, solutions.extrapolate()) else {
            return false;
        };
        solutions.note(correction);
        (next.attitude, next.angular_momentum) = rotation.carry(r, p);
        true
    }

    fn carry_any(
        &self,
        state: &mut BodyState,
        h: f64,
        solutions: &mut Solutions<f64>,
    ) -> Result<u32, Unsolvable> {
        let p = &state.angular_momentum;
        let found = self.find(h, p, solutions.extrapolate())?;
        solutions.note(found.correction);
        (state.attitude, state.angular_momentum) = found.rotation.carry(&state.attitude, p);
        Ok(found.iterations)
    }
}

impl BodyRotation for FreeRotation {
    #[inline(always)]
    fn carry(
        &self,
        (r, p): (&Matrix3<f64>, &Vector3<f64>),
        h: f64,
        _: &mut Solutions<f64>,
        next: &mut BodyState,
    ) -> bool {
        self.carry(r, p, h, (&mut next.attitude, &mut next.angular_momentum));
        true
    }

    fn carry_any(
        &self,
        state: &mut BodyState,
        h: f64,
        _: &mut Solutions<f64>,
    ) -> Result<u32, Unsolvable> {
        let p = &state.angular_momentum;
        let (rotation, _): (Quaternion, _) = self.flow(p, h);
        (state.attitude, state.angular_momentum) = rotation.carry(&state.attitude, p);
        Ok(0)
    }
}

/// The rotation of a body in a system in which some bodies have wheels or thrusters.
pub(super) struct ActuatedRotation<T> {
    /// Its rotation without wheels.
    plain: T,
    /// The data of a body with wheels.
    gyrostat: Option<Gyrostat>,
}

/// The rotors of gyrostats.
pub(super) trait GyrostatRotation: BodyRotation + Sized {
    /// The rotation of a body without wheels.
    fn of_body(inertia: &Inertia) -> Self;

    /// The rotation over `h` from the momentum `Π`, and the number of iterations.
    fn of(
        gyrostat: &Gyrostat,
        h: f64,
        momentum: &Vector3<f64>,
    ) -> Result<(Quaternion, u32), Unsolvable>;
}

impl GyrostatRotation for DiscreteRotation<f64> {
    fn of_body(inertia: &Inertia) -> Self {
        inertia.rotation
    }

    fn of(
        gyrostat: &Gyrostat,
        h: f64,
        momentum: &Vector3<f64>,
    ) -> Result<(Quaternion, u32), Unsolvable> {
        gyrostat.discrete(h, momentum)
    }
}

impl GyrostatRotation for FreeRotation {
    fn of_body(inertia: &Inertia) -> Self {
        Self::new(inertia)
    }

    fn of(
        gyrostat: &Gyrostat,
        h: f64,
        momentum: &Vector3<f64>,
    ) -> Result<(Quaternion, u32), Unsolvable> {
        Ok((gyrostat.exact(h, momentum)?, 0))
    }
}

impl<T: GyrostatRotation> ActuatedRotation<T> {
    pub(super) fn new(body: &RigidBody) -> Self {
        let wheels = body.wheels();
        Self {
            plain: T::of_body(body.inertia()),
            gyrostat: wheels.map(|wheels| Gyrostat::new(body.inertia(), wheels.momentum())),
        }
    }

    /// Takes the present momentum of the wheels.
    pub(super) fn update(&mut self, body: &RigidBody) {
        if let (Some(gyrostat), Some(wheels)) = (&mut self.gyrostat, body.wheels()) {
            gyrostat.stored = wheels.momentum();
        }
    }
}

impl<T: GyrostatRotation> BodyRotation for ActuatedRotation<T> {
    fn carry(
        &self,
        from: (&Matrix3<f64>, &Vector3<f64>),
        h: f64,
        solutions: &mut Solutions<f64>,
        next: &mut BodyState,
    ) -> bool {
        // A gyrostat is carried from `next`, which the caller has kicked.
        self.gyrostat.is_none() && self.plain.carry(from, h, solutions, next)
    }

    fn carry_any(
        &self,
        state: &mut BodyState,
        h: f64,
        solutions: &mut Solutions<f64>,
    ) -> Result<u32, Unsolvable> {
        let Some(gyrostat) = &self.gyrostat else {
            return self.plain.carry_any(state, h, solutions);
        };
        let (rotation, iterations) = T::of(gyrostat, h, &state.angular_momentum)?;
        let total = state.angular_momentum + gyrostat.stored;
        let (attitude, total) = rotation.carry(&state.attitude, &total);
        state.attitude = attitude;
        state.angular_momentum = total - gyrostat.stored;
        Ok(iterations)
    }
}
