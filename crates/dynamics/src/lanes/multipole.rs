use nalgebra::Matrix3;

use super::body::State;
use super::fourth_order::{Higher, fourth_order};
use super::pair::Exchange;
use crate::gravity;
use crate::lane::{Lane, Matrix, Vector};

/// A multipole in every lane, of second or fourth order.
pub(super) struct Multipole<T> {
    /// Mass or gravitational parameter.
    pub(super) strength: T,
    /// The matrix `½ Q`.
    pub(super) second: Matrix<T>,
    /// The terms of fourth order.
    higher: Option<Box<Higher<T>>>,
}

impl<T: Lane> Multipole<T> {
    pub(super) fn none(token: T::Token, order: u32) -> Self {
        let zero = Matrix::splat(token, &Matrix3::zeros());
        Self {
            strength: T::splat(token, 0.0),
            second: zero,
            higher: (order > 2).then(|| Box::new(Higher::none(zero))),
        }
    }

    pub(super) fn set_lane(&mut self, k: usize, from: &gravity::Multipole) {
        self.strength.set_lane(k, from.strength());
        let (second, higher) = from.tensors();
        self.second.set_lane(k, second);
        if let (Some(own), Some(from)) = (&mut self.higher, higher) {
            own.set_lane(k, from);
        }
    }

    /// The acceleration by the terms beyond the monopole.
    #[inline(always)]
    pub(super) fn aspherical(&self, e: Vector<T>) -> Vector<T> {
        let squared = e.norm_squared();
        let by_r2 = squared.constant(1.0) / squared;
        let root = squared.sqrt();
        let quadrupole = quadrupole(&self.second, e, by_r2, root);
        match &self.higher {
            None => quadrupole,
            Some(higher) => quadrupole + higher.acceleration(e, by_r2, root),
        }
    }

    /// The acceleration by all terms.
    #[inline(always)]
    pub(super) fn acceleration(&self, d: Vector<T>) -> Vector<T> {
        let squared = d.norm_squared();
        let by_r2 = squared.constant(1.0) / squared;
        let pull = self.strength * (by_r2 * by_r2) * squared.sqrt();
        d * -pull + self.aspherical(d)
    }
}

/// `−GM d/r³`, plus the quadrupole term.
#[inline(always)]
pub(super) fn acceleration<T: Lane>(gm: T, second: Option<&Matrix<T>>, d: Vector<T>) -> Vector<T> {
    let squared = d.norm_squared();
    let by_r2 = squared.constant(1.0) / squared;
    let root = squared.sqrt();
    let pull = gm * (by_r2 * by_r2) * root;
    let straight = d * -pull;
    match second {
        None => straight,
        Some(second) => straight + quadrupole(second, d, by_r2, root),
    }
}

/// The quadrupole term, given `1/r²` and r, as in `Harmonic::acceleration`.
#[inline(always)]
fn quadrupole<T: Lane>(second: &Matrix<T>, d: Vector<T>, by_r2: T, root: T) -> Vector<T> {
    let by_r5 = by_r2 * root * by_r2 * by_r2;
    let u = *second * d;
    let along = d * (d.dot(u) * 5.0 * by_r2);
    (u * u.x.constant(2.0) - along) * by_r5
}

/// The exchange of two multipoles.
#[inline(always)]
pub(super) fn between<T: Lane>(
    multipoles: [&Multipole<T>; 2],
    states: [&State<T>; 2],
) -> Exchange<T> {
    let [first, second] = multipoles;
    if first.higher.is_some() || second.higher.is_some() {
        fourth_order(multipoles, states)
    } else {
        second_order(multipoles, states)
    }
}

/// The quadrupole of each body interacts with the other's monopole.
#[inline(always)]
fn second_order<T: Lane>(
    [first, second]: [&Multipole<T>; 2],
    states: [&State<T>; 2],
) -> Exchange<T> {
    let d = states[0].position - states[1].position;
    let squared = d.norm_squared();
    let by_r2 = squared.constant(1.0) / squared;
    let by_r3 = by_r2 * by_r2 * squared.sqrt();
    let sight = Sight { d, by_r2, by_r3 };
    let (across, along, moment) = sight.of(first, states[0], second.strength);
    let (other_across, other_along, other_moment) = sight.of(second, states[1], first.strength);
    let straight = first.strength * second.strength * by_r3 + along + other_along;
    Exchange {
        force: across + other_across - d * straight,
        moments: [moment, other_moment],
    }
}

/// The separation of two bodies and powers of its length.
#[derive(Clone, Copy)]
struct Sight<T> {
    d: Vector<T>,
    by_r2: T,
    by_r3: T,
}

impl<T: Lane> Sight<T> {
    /// The force across and, as a factor, along the separation, and the moment, that a monopole exerts on the
    /// quadrupole of a body.
    #[inline(always)]
    fn of(self, body: &Multipole<T>, state: &State<T>, monopole: T) -> (Vector<T>, T, Vector<T>) {
        let e = state.attitude.tr_mul(self.d);
        let strength = monopole * 2.0 * self.by_r3 * self.by_r2;
        let slope = body.second * e * strength;
        (
            state.attitude * slope,
            self.by_r2 * 2.5 * e.dot(slope),
            slope.cross(e),
        )
    }
}
