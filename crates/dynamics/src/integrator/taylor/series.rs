//! The Taylor series of a system's motion.

use fearless_simd::{Level, Simd};

use super::body::{Body, greater};
use super::jet::{Integral, Lanes};
use super::multipoles::Multipoles;
use super::oblate::Oblate;
use super::places::{Place, Places};
use super::points::Pairs;
use crate::BodyState;
use crate::lane::vectorize;

/// The Taylor coefficients of a system's motion, and of all that its forces depend on.
pub(super) struct Series {
    pub(super) order: usize,
    /// Unit of time of the coefficients, a power of two near the step, so that they neither overflow nor underflow.
    pub(super) unit: f64,
    pub(super) bodies: Vec<Body>,
    pub(super) places: Places,
    pub(super) pairs: Vec<Pairs>,
    pub(super) oblates: Vec<Oblate>,
    pub(super) multipoles: Vec<Multipoles>,
}

impl Series {
    /// Sets the unit of time near `time`.
    pub(super) fn set_unit(&mut self, time: f64) {
        // Without the mantissa.
        let unit = f64::from_bits(time.to_bits() & f64::INFINITY.to_bits());
        self.unit = if unit.is_normal() { unit } else { 1.0 };
    }

    /// Sets the unit of time by the velocities and accelerations at order 0.
    pub(super) fn guess_unit(&mut self, level: Level) {
        self.unit = 1.0;
        self.expand_to(level, 1);
        let rates = self.bodies.iter().map(Body::rate);
        self.set_unit(1.0 / rates.fold(0.0, f64::max).sqrt());
    }

    /// The first body whose last coefficient is not finite.
    pub(super) fn not_finite(&self) -> Option<usize> {
        let infinite = |body: &Body| !body.size(self.order, f64::INFINITY).is_finite();
        self.bodies.iter().position(infinite)
    }

    /// Computes all coefficients from those of order 0.
    pub(super) fn expand(&mut self, level: Level) {
        self.expand_to(level, self.order);
    }

    fn expand_to(&mut self, level: Level, order: usize) {
        vectorize!(level, simd => expand(simd, self, order));
    }

    /// Begins all bodies at time t of the expansion.
    pub(super) fn begin_at(&mut self, level: Level, t: f64) {
        let t = t / self.unit;
        vectorize!(level, simd => begin_at(simd, &mut self.bodies, t));
    }

    /// Sets `states` to those at time t of the expansion, but leaves rotations that are not expanded.
    pub(super) fn show(&self, level: Level, t: f64, states: &mut [BodyState]) {
        let t = t / self.unit;
        vectorize!(level, simd => show(simd, &self.bodies, t, states));
    }

    /// The step in which the last two terms are at most `tolerance`, infinity if nothing moves, or NaN if the
    /// coefficients are not finite. `time` is the last step, or
    /// infinity, for which velocities do not count.
    pub(super) fn step(&self, tolerance: f64, time: f64) -> f64 {
        let [before, last] = [self.order - 1, self.order].map(|k| {
            let sizes = self.bodies.iter().map(|body| body.size(k, time));
            let largest = sizes.fold(0.0, greater);
            libm::log(tolerance * tolerance / largest) / (2 * k) as f64
        });
        let step = if before < last || before.is_nan() {
            before
        } else {
            last
        };
        self.unit * libm::exp(step)
    }
}

#[inline(always)]
fn expand<S: Simd>(simd: S, series: &mut Series, order: usize) {
    let Series {
        unit,
        bodies,
        places,
        pairs,
        oblates,
        multipoles,
        ..
    } = series;
    for n in 0..order {
        let integral = Integral::new(*unit, n);
        for body in bodies.iter_mut() {
            body.turn(simd, n, integral);
        }
        places.force.fill(Lanes::default());
        for (place, at) in places.all.iter().zip(&mut places.at) {
            *at = match place {
                Place::Fixed(position) if n == 0 => Lanes::vector((*position).into()),
                Place::Fixed(_) => Lanes::default(),
                Place::Body(body, point) => bodies[*body].place(simd, n, point),
            };
        }
        for pairs in pairs.iter_mut() {
            pairs.add_forces(simd, n, places);
        }
        for oblate in oblates.iter_mut() {
            oblate.add_forces(simd, n, places);
        }
        for multipoles in multipoles.iter_mut() {
            multipoles.add_loads(simd, n, places, bodies);
        }
        for body in bodies.iter_mut() {
            body.accelerate(simd, n, integral, places);
        }
    }
}

#[inline(always)]
fn begin_at<S: Simd>(simd: S, bodies: &mut [Body], t: f64) {
    for body in bodies {
        body.begin_at(simd, t);
    }
}

#[inline(always)]
fn show<S: Simd>(simd: S, bodies: &[Body], t: f64, states: &mut [BodyState]) {
    for (body, state) in bodies.iter().zip(states) {
        body.show(simd, t, state);
    }
}
