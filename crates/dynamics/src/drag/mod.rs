//! Drag in the atmosphere of a fixed attractor.

mod atmosphere;
mod derivatives;

use std::sync::Arc;

use nalgebra::Vector3;
use thiserror::Error;

use crate::{BodyState, RigidBody};

pub use atmosphere::Atmosphere;
pub use derivatives::{Blocks, GlideDerivatives};

/// Reasons why numbers do not describe drag.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DragError {
    /// There are no layers.
    #[error("there are no densities, expected at least one")]
    NoLayers,
    /// A layer is not above the one before it.
    #[error(
        "layer {index} begins at {altitude}, expected a finite number above that of the layer before it"
    )]
    Altitude {
        /// Index of the layer, from 0.
        index: usize,
        /// Altitude of its lower end.
        altitude: f64,
    },
    /// A density is not a positive number.
    #[error("the density of layer {index} is {density}, expected a finite number > 0")]
    Density {
        /// Index of the layer, from 0.
        index: usize,
        /// Density at its lower end.
        density: f64,
    },
    /// The scale height is not a positive number.
    #[error("the scale height is {0}, expected a finite number > 0")]
    ScaleHeight(f64),
    /// The center, the radius, the rotation or a layer is not finite.
    #[error("the center, the radius, the rotation or a layer of the atmosphere is not finite")]
    NotFinite,
    /// The area is not a positive number.
    #[error("the drag area is {0}, expected a finite number > 0")]
    Area(f64),
}

/// The drag of a body, `F = −½ ρ C_D A |v| v` with the velocity v relative to the air.
///
/// # Assumptions and limitations
/// The drag area does not depend on the attitude, and the drag exerts no moment about the center of mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Drag {
    atmosphere: Arc<Atmosphere>,
    area: f64,
}

impl Drag {
    /// Creates the drag of a body with this drag area, `C_D A`.
    ///
    /// # Errors
    /// Returns an error if the area is not a positive number.
    pub fn new(atmosphere: Arc<Atmosphere>, area: f64) -> Result<Self, DragError> {
        if area.is_finite() && area > 0.0 {
            Ok(Self { atmosphere, area })
        } else {
            Err(DragError::Area(area))
        }
    }

    /// The atmosphere.
    pub fn atmosphere(&self) -> &Arc<Atmosphere> {
        &self.atmosphere
    }

    /// The drag area, `C_D A`.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// The drag in other units, of these sizes.
    #[must_use]
    pub fn in_units(&self, length: f64, mass: f64, time: f64) -> Self {
        Self {
            atmosphere: Arc::new(self.atmosphere.in_units(length, mass, time)),
            area: self.area / (length * length),
        }
    }

    /// The drag of two bodies in one atmosphere that are joined, which acts at their center of mass.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            area: self.area + other.area,
            ..self
        }
    }

    /// The drag on a body with this position and velocity, inertial frame.
    pub fn force(&self, position: &Vector3<f64>, velocity: &Vector3<f64>) -> Vector3<f64> {
        let relative = velocity - self.atmosphere.wind(position);
        let density = self.atmosphere.density(position);
        (-0.5 * density * self.area * relative.norm()) * relative
    }

    /// `κ = ρ C_D A/(2m)`
    fn rate(&self, mass: f64, position: &Vector3<f64>) -> f64 {
        0.5 * self.atmosphere.density(position) * self.area / mass
    }

    /// Slows a body of this mass down for a time, which may be negative, at a fixed position, in air of `factor` times the
    /// density. The velocity relative to the air becomes `v/(1 + κ |v| t)` with `κ = ρ C_D A/(2m)`, the exact solution of
    /// `v̇ = −κ |v| v`.
    ///
    /// Backwards in time the speed diverges after `1/(κ |v|)`. From then on the momentum is not a number.
    fn slow(&self, mass: f64, state: &mut BodyState, time: f64, factor: f64) {
        let wind = self.atmosphere.wind(&state.position);
        let relative = state.linear_momentum / mass - wind;
        let rate = factor * self.rate(mass, &state.position);
        let braked = rate * relative.norm() * time;
        let slower = if braked > -1.0 {
            1.0 + braked
        } else {
            f64::NAN
        };
        state.linear_momentum -= (mass * (braked / slower)) * relative;
    }
}

impl RigidBody {
    /// The drag in this state, inertial frame; 0 without [`drag`](Self::drag).
    #[inline]
    pub fn drag_force(&self, state: &BodyState) -> Vector3<f64> {
        let force = |drag: &Drag| drag.force(&state.position, &state.velocity(self));
        self.drag().map_or_else(Vector3::zeros, force)
    }

    /// Moves the center of mass for a time without other forces: half of the drag acts before, and half after. The air has
    /// `factor` times its density.
    #[inline]
    pub fn glide(&self, state: &mut BodyState, time: f64, factor: f64) {
        let per_mass = time / self.mass;
        match self.drag() {
            None => state.position += per_mass * state.linear_momentum,
            Some(drag) => {
                drag.slow(self.mass, state, 0.5 * time, factor);
                state.position += per_mass * state.linear_momentum;
                drag.slow(self.mass, state, 0.5 * time, factor);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::atmosphere::tests::{above, atmosphere};
    use super::*;
    use crate::Inertia;
    use nalgebra::Matrix3;

    /// Against many steps of the classical Runge–Kutta method, forwards and backwards.
    #[test]
    fn a_body_slows_down_by_its_force() {
        let air = Arc::new(atmosphere(&[[0.0, 1.5]], 2.0).unwrap());
        let drag = Drag::new(air, 0.7).unwrap();
        let inertia = Inertia::principal([1.0; 3]).unwrap();
        let body = RigidBody::new(2.0, inertia, vec![]).unwrap();
        for time in [0.8, -0.1] {
            let (position, velocity) = (above(1.0), Vector3::new(1.0, -2.0, 0.5));
            let mut state = BodyState::from_velocities(
                &body,
                position,
                velocity,
                Matrix3::identity(),
                Vector3::zeros(),
            );
            let steps = 1000;
            let h = time / f64::from(steps);
            let rate = |v: Vector3<f64>| drag.force(&position, &v) / body.mass();
            let mut v = velocity;
            for _ in 0..steps {
                let k1 = rate(v);
                let k2 = rate(v + 0.5 * h * k1);
                let k3 = rate(v + 0.5 * h * k2);
                let k4 = rate(v + h * k3);
                v += h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
            }
            drag.slow(body.mass(), &mut state, time, 1.0);
            let error = (state.velocity(&body) - v).norm();
            assert!(error < 1e-13, "{error:e}");
            assert!((v - velocity).norm() > 0.1);
            drag.slow(body.mass(), &mut state, -time, 1.0);
            assert!((state.velocity(&body) - velocity).norm() < 1e-14);
        }
    }

    #[test]
    fn a_speed_that_diverges_is_not_a_number() {
        let air = Arc::new(atmosphere(&[[0.0, 1.0]], 1.0).unwrap());
        let drag = Drag::new(air, 2.0).unwrap();
        let inertia = Inertia::principal([1.0; 3]).unwrap();
        let body = RigidBody::new(1.0, inertia, vec![]).unwrap();
        let velocity = Vector3::new(3.0, 0.0, 0.0);
        let mut state = BodyState::from_velocities(
            &body,
            above(0.0),
            velocity,
            Matrix3::identity(),
            Vector3::zeros(),
        );
        drag.slow(1.0, &mut state, -10.0, 1.0);
        assert!(!state.is_finite());
    }

    /// By central differences of glides.
    #[test]
    fn glides_change_with_the_density_and_the_wind() {
        let layers = [[-20.0, 1.5]];
        let body = |rotation: f64| {
            let turning = rotation * Vector3::new(0.0, 0.1, 0.2);
            let air = Atmosphere::new(Vector3::zeros(), turning, 10.0, &layers, 4.0).unwrap();
            let inertia = Inertia::principal([1.0; 3]).unwrap();
            let body = RigidBody::new(2.0, inertia, vec![]).unwrap();
            body.with_drag(Drag::new(Arc::new(air), 0.7).unwrap())
        };
        let (place, velocity) = (Vector3::new(3.0, -9.0, 4.0), Vector3::new(1.0, -2.0, 0.5));
        let (upright, still) = (Matrix3::identity(), Vector3::zeros());
        let start = BodyState::from_velocities(&body(1.0), place, velocity, upright, still);
        let end = |rotation: f64, density: f64| {
            let mut state = start;
            body(rotation).glide(&mut state, 0.6, density);
            [state.position, state.linear_momentum]
        };
        let step = 1e-5;
        let derivatives = body(1.0).glide_derivatives(&start, 0.6, 1.0).unwrap();
        for (found, more, less) in [
            (
                derivatives.by_density(),
                end(1.0, libm::exp(step)),
                end(1.0, libm::exp(-step)),
            ),
            (
                derivatives.by_rotation(),
                end(1.0 + step, 1.0),
                end(1.0 - step, 1.0),
            ),
        ] {
            for ((found, more), less) in found.iter().zip(more).zip(less) {
                let difference = (more - less) / (2.0 * step);
                let error = (found - difference).norm();
                assert!(error < 1e-9 && difference.norm() > 1e-3, "{error:e}");
            }
        }
    }
}
