//! The mass that flows out, and what it does to the body.

use nalgebra::{Matrix3, Vector3};

use super::{Condition, Firing, Thrusters};
use crate::{BodyError, BodyState, Inertia, InertiaError, MassDistribution, Mobility, RigidBody};

/// A body with all its propellant.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Loaded {
    mass: f64,
    inertia: Matrix3<f64>,
    distribution: MassDistribution,
    /// The propellant's inertia.
    propellant: Matrix3<f64>,
}

impl Thrusters {
    /// Takes the properties of the body with all its propellant.
    ///
    /// # Errors
    /// Returns an error if the propellant is not part of the body.
    pub(crate) fn load(
        &mut self,
        mass: f64,
        inertia: &Inertia,
        distribution: &MassDistribution,
    ) -> Result<(), BodyError> {
        let propellant = self.propellant;
        if propellant.mass == 0.0 {
            self.loaded = None;
            return Ok(());
        }
        if propellant.mass >= mass {
            return Err(BodyError::Propellant {
                propellant: propellant.mass,
                mass,
            });
        }
        if matches!(distribution, MassDistribution::Polyhedron(_)) {
            return Err(BodyError::Heavier);
        }
        let loaded = Loaded {
            mass,
            inertia: *inertia.matrix(),
            distribution: distribution.clone(),
            propellant: (propellant.inertia)
                .unwrap_or_else(|| inertia.matrix() * (propellant.mass / mass)),
        };
        loaded.inertia(1.0)?;
        self.loaded = Some(loaded);
        Ok(())
    }
}

impl Loaded {
    /// The inertia after a share of the propellant has flowed out.
    fn inertia(&self, share: f64) -> Result<Inertia, InertiaError> {
        Inertia::new(self.inertia - share * self.propellant)
    }
}

impl RigidBody {
    /// Sets the mass of the propellant that is left, and with it the mass, the inertia and the mass distribution. A body
    /// without propellant remains as it is.
    pub fn set_propellant(&mut self, left: f64) {
        let Some(thrusters) = &mut self.thrusters else {
            return;
        };
        let Some(loaded) = &thrusters.loaded else {
            return;
        };
        if thrusters.condition.propellant == left {
            return;
        }
        thrusters.condition.propellant = left;
        let used = thrusters.propellant.mass - left;
        // Both ends are inertias of rigid bodies, and so is what is between them.
        if let Ok(inertia) = loaded.inertia(used / thrusters.propellant.mass) {
            self.inertia = inertia;
        }
        self.mass = loaded.mass - used;
        let factor = self.mass / loaded.mass;
        match (&mut self.distribution, &loaded.distribution) {
            (MassDistribution::Points(points), MassDistribution::Points(all)) => {
                for (point, full) in points.iter_mut().zip(all) {
                    point.mass = factor * full.mass;
                }
            }
            (MassDistribution::Multipole(multipole), MassDistribution::Multipole(full)) => {
                *multipole = full.scaled(factor);
            }
            // It has no propellant.
            (_, _) => {}
        }
    }

    /// Acts on `state` as the thrusters do in the first half of a step, of length `h/2`.
    pub(crate) fn begin_thrust(&mut self, state: &mut BodyState, firing: &Firing, half: f64) {
        let before = state.velocity(self);
        self.eject(state, firing, half);
        self.push(state, firing, half);
        self.note_velocity_change(state.velocity(self) - before);
        state.linear_momentum += half * firing.engine;
    }

    /// The same in the second half, which is the reverse of the first.
    pub(crate) fn end_thrust(&mut self, state: &mut BodyState, firing: &Firing, half: f64) {
        state.linear_momentum += half * firing.engine;
        let before = state.velocity(self);
        self.push(state, firing, half);
        self.eject(state, firing, half);
        self.note_velocity_change(state.velocity(self) - before);
    }

    fn note_velocity_change(&mut self, change: Vector3<f64>) {
        if let Some(thrusters) = &mut self.thrusters {
            thrusters.condition.velocity_change += change;
        }
    }

    fn push(&self, state: &mut BodyState, firing: &Firing, dt: f64) {
        if self.mobility == Mobility::Free {
            state.linear_momentum += dt * (state.attitude * firing.force);
        }
        state.angular_momentum += dt * firing.moment;
    }

    /// Lets gas flow out at the attitude of `state`, by the trapezoidal rule.
    fn eject(&mut self, state: &mut BodyState, firing: &Firing, dt: f64) {
        if !firing.flows() {
            return;
        }
        let Some(thrusters) = &self.thrusters else {
            return;
        };
        let left = thrusters.condition.propellant - dt * firing.mass_flow;
        let (mass, velocity) = (self.mass, state.velocity(self));
        let before = state.angular_velocity(self);
        self.set_propellant(left.max(0.0));
        let damping = (0.5 * dt) * firing.damping;
        let of_gas = damping * self.inertia.inverse();
        let without = state.angular_momentum - damping * before;
        // The sum of the identity and a product of two positive matrices.
        if let Some(solved) = (Matrix3::identity() + of_gas).lu().solve(&without) {
            state.angular_momentum = solved;
        }
        if self.mobility == Mobility::Free {
            let rate = 0.5 * (before + state.angular_velocity(self));
            let coriolis = (2.0 * dt) * rate.cross(&firing.lever);
            let mean = 0.5 * (mass + self.mass);
            state.linear_momentum = self.mass * (velocity - state.attitude * (coriolis / mean));
        }
    }

    /// Returns to a condition of the thrusters.
    pub(crate) fn restore_thrusters(&mut self, condition: &Condition) {
        self.set_propellant(condition.propellant);
        if let Some(thrusters) = &mut self.thrusters {
            thrusters.condition.clone_from(condition);
        }
    }
}
