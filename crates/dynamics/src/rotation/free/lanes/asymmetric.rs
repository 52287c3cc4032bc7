//! The free rotation with three different moments, in lanes.

use super::super::asymmetric;
use super::super::polhode::Ratio;
use super::Turn;
use super::angles::cos_sinc;
use super::attitude::{Across, Complex, least_then_about};
use super::polhode::Polhode;
use crate::lane::{Lane, Matrix, Vector};
use crate::rotation::LaneQuaternion;

/// Range of `|Π|²` that neither overflows nor underflows.
const LEAST: f64 = 1e-280;
const GREATEST: f64 = 1e280;

/// As [`asymmetric::Asymmetric`].
pub(super) struct Asymmetric<T> {
    axes: Matrix<T>,
    reciprocal: Vector<T>,
    rate: T,
    near: Ratio<T>,
    far: Ratio<T>,
}

impl<T: Lane> Asymmetric<T> {
    pub(super) fn none(one: T, axes: Matrix<T>) -> Self {
        let ratio = Ratio {
            value: one,
            root: one,
        };
        Self {
            axes,
            reciprocal: Vector::new(one, one, one),
            rate: one,
            near: ratio,
            far: ratio,
        }
    }

    pub(super) fn set_lane(&mut self, k: usize, from: &asymmetric::Asymmetric) {
        self.axes.set_lane(k, &from.axes);
        self.reciprocal.set_lane(k, &from.reciprocal);
        self.rate.set_lane(k, from.rate);
        self.near.value.set_lane(k, from.near.value);
        self.near.root.set_lane(k, from.near.root);
        self.far.value.set_lane(k, from.far.value);
        self.far.root.set_lane(k, from.far.root);
    }

    #[inline(always)]
    pub(super) fn flow(&self, pi: Vector<T>, t: f64, lanes: u32) -> Turn<T> {
        let squared = pi.norm_squared();
        let usual =
            squared.constant(LEAST).at_most(squared) & squared.below(squared.constant(GREATEST));
        let magnitude = squared.sqrt();
        let a = self.axes.tr_mul(pi / magnitude);
        let polhode = Polhode::through(&a, &self.near, &self.far);
        let lanes = lanes & usual & polhode.moving;

        let phase = polhode.phase(magnitude * self.rate * polhode.rate(), t, lanes);
        let theta = magnitude * self.reciprocal.x * t - polhode.nu / polhode.rate() * phase.third;

        let mut change = polhode.change(&phase.functions, lanes);
        let across = Across::new(&a, &change, polhode.first_squared);
        let ratios = (&self.near, &self.far);
        let half_chi = across.half_chi(&polhode, ratios, &a, &change, &phase.functions);
        let mut half_epsilon = across.half_epsilon(polhode.first_squared, &a, &change);
        let mut odd = odd(phase.half_turns, lanes);
        let b = a + change;
        let turned = lanes & !polhode.same_side(&a, &b);
        if turned != 0 {
            change = (polhode.turned(&b) - a).where_in(turned, change);
            let across = Across::new(&a, &change, polhode.first_squared);
            half_epsilon = across.half_epsilon(polhode.first_squared, &a, &change);
            odd ^= turned;
        }
        let (cos, sinc) = cos_sinc(theta * 0.25 * theta, lanes);
        let half_theta = Complex {
            re: cos,
            im: theta * 0.5 * sinc,
        };
        let half_angle = half_theta.times(half_chi.times(half_epsilon).conj());

        let mut relative = least_then_about(half_angle, &a, &change);
        let mut momentum = pi + self.axes * (change * magnitude);
        if odd != 0 {
            let (turn, b) = half_turned(polhode.round_pole, half_angle, &a, &change);
            relative.w = turn.w.where_in(odd, relative.w);
            relative.u = turn.u.where_in(odd, relative.u);
            momentum = (self.axes * (b * magnitude)).where_in(odd, momentum);
        }
        let rotation = LaneQuaternion {
            w: relative.w,
            u: self.axes * relative.u,
        };
        Turn {
            lanes,
            ..Turn::of(rotation, momentum)
        }
    }
}

/// Mask of those `lanes` whose number of half turns is odd.
#[inline(always)]
fn odd<T: Lane>(half_turns: T, lanes: u32) -> u32 {
    let zero = half_turns.constant(0.0);
    let mut odd = lanes & !half_turns.abs().at_most(zero);
    if odd != 0 {
        for k in 0..T::COUNT {
            if half_turns.lane(k) % 2.0 == 0.0 {
                odd &= !(1 << k);
            }
        }
    }
    odd
}

/// The relative rotation and `b` after an odd number of half turns about the major axis.
#[inline(always)]
fn half_turned<T: Lane>(
    round_pole: u32,
    half_angle: Complex<T>,
    a: &Vector<T>,
    change: &Vector<T>,
) -> (LaneQuaternion<T>, Vector<T>) {
    let (zero, one) = (a.x.constant(0.0), a.x.constant(1.0));
    let half_turn = LaneQuaternion {
        w: zero,
        u: Vector::new(
            zero.where_in(round_pole, one),
            zero,
            one.where_in(round_pole, zero),
        ),
    };
    // A half turn about axis 1 reverses the pole, which shifts the precession by a half turn.
    let shifted = Complex {
        re: half_angle.im,
        im: -half_angle.re,
    };
    let half_angle = half_angle.or(shifted, round_pole);
    let relative = least_then_about(half_angle, a, change).product(&half_turn);
    (relative, half_turn.rotate_back(*a + *change))
}
