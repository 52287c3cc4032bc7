//! Checks that the steps are short enough for the motion, before a flight from its rates and afterwards from its
//! energy.

use std::f64::consts::TAU;

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::wheels::Wheels;
use lgvi_dynamics::{BodyState, Invariants, Method, Mobility, System};
use nalgebra::Vector3;

use crate::{Integration, Scene, Scheme};

/// Angle per step above which methods of second order are inaccurate (rad). The error is about its cube over 24.
const FAR: f64 = 0.3;

/// Angle per step above which methods of higher order are inaccurate (rad). They evaluate the motion several times a
/// step, so the limit grows in proportion to the order above order 8.
const FAR_OF_HIGH_ORDER: f64 = 1.0;

/// Relative change of energy, with respect to kinetic plus potential energy, that steps short enough do not exceed.
const ENERGY: f64 = 1e-2;

/// Limit on the relative change of energy if the energy changes its sign, as a bound system becomes unbound or vice
/// versa.
const SIGN: f64 = 1e-6;

/// Angular velocities of the motion of a scene's bodies, in the scene's units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// Largest angular velocity of a body whose rotation is not prescribed.
    pub turn: f64,
    /// Largest angular velocity of a circular orbit at a body's position, about the attractor or another body.
    pub orbit: f64,
}

impl Rates {
    /// Returns the maximum of each rate.
    pub fn max(self, other: Self) -> Self {
        Self {
            turn: self.turn.max(other.turn),
            orbit: self.orbit.max(other.orbit),
        }
    }
}

/// Kinetic and potential energy, in the scene's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energies {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Potential energy.
    pub potential: f64,
}

impl Energies {
    /// Computes the energies of `states`.
    pub fn of(system: &System, states: &[BodyState]) -> Self {
        let potential = system.potential(states);
        Self {
            kinetic: Invariants::of(system, states).energy - potential,
            potential,
        }
    }

    fn total(self) -> f64 {
        self.kinetic + self.potential
    }

    fn size(self) -> f64 {
        self.kinetic.abs() + self.potential.abs()
    }
}

impl Scene {
    /// Computes the rates of the scene's bodies, which `system` has as they are now, in `states`.
    pub fn rates(&self, system: &System, states: &[BodyState]) -> Rates {
        let mut squared: f64 = 0.0;
        let mut turn: f64 = 0.0;
        let bodies = system.bodies();
        for (index, (body, state)) in bodies.iter().zip(states).enumerate() {
            if body.mobility().is_given() {
                continue;
            }
            turn = turn.max(state.angular_velocity(body).norm());
            if *body.mobility() == Mobility::Pivoted {
                continue;
            }
            if let Some(central) = &self.gravity.central {
                squared = squared.max(kepler(central.gm, &(state.position - central.position)));
            }
            let Some(constant) = self.gravity.mutual else {
                continue;
            };
            for (other_index, (other, at)) in bodies.iter().zip(states).enumerate() {
                if other_index != index {
                    let gm = constant * (body.mass() + other.mass());
                    squared = squared.max(kepler(gm, &(state.position - at.position)));
                }
            }
        }
        Rates {
            turn,
            orbit: squared.sqrt(),
        }
    }

    /// Returns a warning if a body turns so far in a step of `scheme` that the method is inaccurate.
    pub fn long_turn(&self, scheme: Scheme, rates: Rates) -> Option<String> {
        let turn = self.substep(scheme) * rates.turn;
        let exact = scheme.method.rotor() == Some(Rotor::Exact);
        let far = self.far(scheme, exact)?;
        (turn > far).then(|| {
            format!(
                "a body turns by {turn:.2} rad in a step, {:.1} steps a turn, too far for {} to be accurate: \
                 more `steps` or `substeps` would make it less",
                TAU / turn,
                scheme.method
            )
        })
    }

    /// Returns a warning if a step of `scheme` covers so much of an orbit that the method is inaccurate.
    pub fn long_orbit(&self, scheme: Scheme, rates: Rates) -> Option<String> {
        if self.subdivides(scheme) {
            return None;
        }
        if let Method::WisdomHolman { .. } = scheme.method {
            // It solves orbits exactly.
            return None;
        }
        let angle = self.substep(scheme) * rates.orbit;
        let far = self.far(scheme, false)?;
        (angle > far).then(|| {
            format!(
                "at the bodies' least distance there are {:.1} steps to an orbit, fewer than the {:.0} that {} needs to be \
                 accurate: more `steps` or `substeps` would make them more, `subdivide` where they are needed",
                TAU / angle,
                (TAU / far).ceil(),
                scheme.method
            )
        })
    }

    /// Returns a warning if the energy of a flight without controls has changed by more than sound steps allow.
    pub fn changed_energy(&self, [start, end]: [Energies; 2]) -> Option<String> {
        if self.is_driven() || self.has_friction() || self.has_drag() {
            return None;
        }
        let change = end.total() - start.total();
        let size = start.size().max(end.size());
        let reversed = start.total() * end.total() < 0.0;
        // A NaN compares false and counts as unsound.
        let sound = change.abs() <= if reversed { SIGN } else { ENERGY } * size;
        let unit = self.units.energy();
        (!sound).then(|| {
            let bound = match reversed {
                true if start.total() < 0.0 => ", what was bound has come loose",
                true => ", what was loose has been bound",
                false => "",
            };
            format!(
                "without controls the energy has changed from {:.6e} J to {:.6e} J{bound}, which is the error of steps that \
                 are too long: the motion is not that of the bodies",
                start.total() * unit,
                end.total() * unit
            )
        })
    }

    /// Returns true if the motion of a body is prescribed.
    fn is_driven(&self) -> bool {
        let mut bodies = self.bodies.iter();
        bodies.any(|named| matches!(named.body.mobility(), Mobility::Driven(_)))
    }

    /// Returns true if bearings of wheels take energy out.
    fn has_friction(&self) -> bool {
        let mut wheels = self.bodies.iter().filter_map(|named| named.body.wheels());
        wheels.any(Wheels::have_friction)
    }

    fn substep(&self, scheme: Scheme) -> f64 {
        self.h() / f64::from(scheme.substeps)
    }

    /// Returns the angle per step above which the method is inaccurate, or `None` if the method controls its error or
    /// has no order, or if the rotation is `exact` and the method of higher order.
    fn far(&self, scheme: Scheme, exact: bool) -> Option<f64> {
        if scheme.method.has_error_control() || matches!(self.integration, Integration::Auto { .. })
        {
            return None;
        }
        match scheme.method.order()? {
            ..=2 => Some(FAR),
            _ if exact => None,
            order => Some(FAR_OF_HIGH_ORDER * (f64::from(order) / 8.0).max(1.0)),
        }
    }
}

/// Returns the square of the angular velocity of a circular orbit.
fn kepler(gm: f64, from: &Vector3<f64>) -> f64 {
    let distance = from.norm();
    gm.abs() / (distance * distance * distance)
}
