//! Whether steps are short enough for what they follow, and whether energy says that they were.

use std::f64::consts::TAU;

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Invariants, Mobility, System};
use nalgebra::Vector3;

use crate::{Integration, Scene, Scheme};

/// Angle in a step above which methods of second order are inaccurate (rad): its cube over 24 is about the error.
const FAR: f64 = 0.3;

/// The same of methods of higher order, which look at the motion several times a step, for each order of eight.
const FAR_OF_HIGH_ORDER: f64 = 1.0;

/// Change of energy, of the kinetic and potential energy together, that bounded errors of steps short enough stay below.
const ENERGY: f64 = 1e-2;

/// The same where the energy changes its sign: what was bound is not.
const SIGN: f64 = 1e-6;

/// How fast the bodies of a scene move round something, in the scene's units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rates {
    /// The greatest angular velocity of a body that turns by itself.
    pub turn: f64,
    /// The greatest angular velocity of a circular orbit at a body's place, about the attractor or another body.
    pub orbit: f64,
}

impl Rates {
    /// The greater of each.
    pub fn max(self, other: Self) -> Self {
        Self {
            turn: self.turn.max(other.turn),
            orbit: self.orbit.max(other.orbit),
        }
    }
}

/// Energy in its two kinds, in the scene's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energies {
    /// Of motion.
    pub kinetic: f64,
    /// Of place.
    pub potential: f64,
}

impl Energies {
    /// Those of `states`.
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
    /// How fast its bodies move in `states`.
    pub fn rates(&self, states: &[BodyState]) -> Rates {
        let mut squared: f64 = 0.0;
        let mut turn: f64 = 0.0;
        for (index, (named, state)) in self.bodies.iter().zip(states).enumerate() {
            let body = &named.body;
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
            for (other_index, (other, at)) in self.bodies.iter().zip(states).enumerate() {
                if other_index != index {
                    let gm = constant * (body.mass() + other.body.mass());
                    squared = squared.max(kepler(gm, &(state.position - at.position)));
                }
            }
        }
        Rates {
            turn,
            orbit: squared.sqrt(),
        }
    }

    /// What is to be said where a body turns so far in a step of `scheme` that the method is inaccurate.
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

    /// The same where a step of `scheme` is a great part of an orbit.
    pub fn long_orbit(&self, scheme: Scheme, rates: Rates) -> Option<String> {
        if self.subdivides(scheme) {
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

    /// What is to be said of a flight without controls whose energy has changed by more than sound steps let it.
    pub fn changed_energy(&self, [start, end]: [Energies; 2]) -> Option<String> {
        if self.is_driven() {
            return None;
        }
        let change = end.total() - start.total();
        let size = start.size().max(end.size());
        let reversed = start.total() * end.total() < 0.0;
        // What is no number is no small change.
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

    /// Whether a body is moved whatever acts on it.
    fn is_driven(&self) -> bool {
        let mut bodies = self.bodies.iter();
        bodies.any(|named| matches!(named.body.mobility(), Mobility::Driven(_)))
    }

    fn substep(&self, scheme: Scheme) -> f64 {
        self.h() / f64::from(scheme.substeps)
    }

    /// Angle in a step from which the method is inaccurate; none where it measures its errors or has none.
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

/// The square of the angular velocity of a circular orbit.
fn kepler(gm: f64, from: &Vector3<f64>) -> f64 {
    let distance = from.norm();
    gm.abs() / (distance * distance * distance)
}
