use nalgebra::Vector3;

use super::fit::Shape;
use super::flight::Batch;
use super::multipole::Multipole;
use crate::integrator::Rotor;
use crate::lane::{Lane, Matrix, Vector};
use crate::rotation::{DiscreteRotation, FreeRotation, FreeRotations};
use crate::{BodyState, Load, MassDistribution, Mobility};

/// The state of one body in every lane.
#[derive(Clone, Copy)]
pub(super) struct State<T> {
    pub(super) position: Vector<T>,
    pub(super) linear_momentum: Vector<T>,
    pub(super) attitude: Matrix<T>,
    pub(super) angular_momentum: Vector<T>,
}

impl<T: Lane> State<T> {
    pub(super) fn zero(token: T::Token) -> Self {
        let zero = Vector::splat(token, &Vector3::zeros());
        Self {
            position: zero,
            linear_momentum: zero,
            attitude: Matrix([zero; 3]),
            angular_momentum: zero,
        }
    }

    pub(super) fn lane(&self, k: usize) -> BodyState {
        BodyState {
            position: self.position.lane(k),
            linear_momentum: self.linear_momentum.lane(k),
            attitude: self.attitude.lane(k),
            angular_momentum: self.angular_momentum.lane(k),
        }
    }

    pub(super) fn set_lane(&mut self, k: usize, state: &BodyState) {
        self.position.set_lane(k, &state.position);
        self.linear_momentum.set_lane(k, &state.linear_momentum);
        self.attitude.set_lane(k, &state.attitude);
        self.angular_momentum.set_lane(k, &state.angular_momentum);
    }

    #[inline(always)]
    pub(super) fn kick(&mut self, mobility: Motion, load: &Effect<T>, dt: f64) {
        if mobility == Motion::Free {
            self.linear_momentum = self.linear_momentum + load.scaled_force(dt);
        }
        if mobility != Motion::Held {
            self.angular_momentum = self.angular_momentum + load.scaled_moment(dt);
        }
    }

    /// Zero in the lanes whose state appears finite, with the same check as `drift::end`.
    #[inline(always)]
    pub(super) fn zero_if_finite(&self) -> T {
        let (x, u, p) = (self.position, self.linear_momentum, self.angular_momentum);
        let sum = x.x + x.y + x.z + u.x + u.y + u.z + p.x + p.y + p.z + self.attitude.0[2].z;
        sum * 0.0
    }
}

/// The load on a body in every lane.
#[derive(Clone, Copy)]
pub(super) struct Effect<T> {
    pub(super) force: Vector<T>,
    pub(super) moment: Vector<T>,
}

impl<T: Lane> Effect<T> {
    #[inline(always)]
    pub(super) fn splat(token: T::Token, load: &Load) -> Self {
        Self {
            force: Vector::splat(token, &load.force),
            moment: Vector::splat(token, &load.moment),
        }
    }

    /// Returns `load` in every lane.
    #[inline(always)]
    pub(super) fn constant(&self, load: &Load) -> Self {
        Self {
            force: self.force.constant(&load.force),
            moment: self.moment.constant(&load.moment),
        }
    }

    #[inline(always)]
    pub(super) fn component_mul(&self, factors: &Self) -> Self {
        Self {
            force: self.force.component_mul(factors.force),
            moment: self.moment.component_mul(factors.moment),
        }
    }

    #[inline(always)]
    pub(super) fn plus(&self, other: &Self) -> Self {
        Self {
            force: self.force + other.force,
            moment: self.moment + other.moment,
        }
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        let zero = self.force.x.constant(0.0);
        let zero = Vector::new(zero, zero, zero);
        (self.force, self.moment) = (zero, zero);
    }

    #[inline(always)]
    fn scaled_force(&self, dt: f64) -> Vector<T> {
        self.force * self.force.x.constant(dt)
    }

    #[inline(always)]
    fn scaled_moment(&self, dt: f64) -> Vector<T> {
        self.moment * self.moment.x.constant(dt)
    }
}

/// The kinds of motion that lanes support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Motion {
    Free,
    Pivoted,
    Held,
}

impl Motion {
    pub(super) fn of(mobility: &Mobility) -> Option<Self> {
        match mobility {
            Mobility::Free => Some(Self::Free),
            Mobility::Pivoted => Some(Self::Pivoted),
            Mobility::Fixed => Some(Self::Held),
            Mobility::Driven(_) => None,
        }
    }
}

/// A point mass in every lane.
#[derive(Clone, Copy)]
pub(super) struct Point<T> {
    pub(super) mass: T,
    pub(super) position: Vector<T>,
}

/// The mass distribution of one body in every lane.
pub(super) enum Mass<T> {
    Points(Vec<Point<T>>),
    Multipole(Multipole<T>),
}

/// The rotation of one body in every lane.
pub(super) enum Rotation<T> {
    Discrete(DiscreteRotation<T>),
    Free(FreeRotations<T>),
}

/// One body in every lane.
pub(super) struct Body<T> {
    pub(super) motion: Motion,
    /// `1/m`.
    pub(super) per_mass: T,
    pub(super) rotation: Rotation<T>,
    pub(super) mass: Mass<T>,
    /// Radius that no other body may enter.
    pub(super) radius: T,
}

impl<T: Lane> Body<T> {
    /// Collects the body with this index from each member.
    pub(super) fn new(token: T::Token, index: usize, batch: &Batch) -> Self {
        let zero = T::splat(token, 0.0);
        let point = Point {
            mass: zero,
            position: Vector::splat(token, &Vector3::zeros()),
        };
        let mass = match batch.layout.shapes[index] {
            Shape::Points(count) => Mass::Points(vec![point; count]),
            Shape::Multipole(order) => Mass::Multipole(Multipole::none(token, order)),
        };
        let inertias = batch.members.iter();
        let inertias = inertias.map(|member| member.system.bodies()[index].inertia());
        let rotation = match batch.layout.rotor {
            Rotor::Discrete => {
                let each: Vec<_> = inertias.map(|inertia| inertia.rotation).collect();
                Rotation::Discrete(DiscreteRotation::gather(token, &each))
            }
            Rotor::Exact => {
                let each = inertias.map(FreeRotation::new).collect();
                Rotation::Free(FreeRotations::gather(token, each))
            }
        };
        let mut body = Self {
            motion: batch.layout.motions[index],
            per_mass: zero,
            rotation,
            mass,
            radius: zero,
        };
        for (k, member) in batch.members.iter().enumerate() {
            let from = &member.system.bodies()[index];
            body.per_mass.set_lane(k, from.mass().recip());
            body.radius.set_lane(k, from.radius());
            match (&mut body.mass, from.distribution()) {
                (Mass::Multipole(multipole), MassDistribution::Multipole(from)) => {
                    multipole.set_lane(k, from);
                }
                (Mass::Points(points), _) => {
                    for (point, from) in points.iter_mut().zip(from.points()) {
                        point.mass.set_lane(k, from.mass);
                        point.position.set_lane(k, &from.position);
                    }
                }
                (Mass::Multipole(_), _) => {}
            }
        }
        body
    }
}
