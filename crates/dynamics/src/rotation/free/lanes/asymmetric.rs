//! The free rotation with three different moments, in lanes.

use super::super::asymmetric;
use super::super::polhode::Ratio;
use super::Turn;
use super::angles::cos_sinc;
use super::attitude::{Complex, half_angles, least_then_about};
use super::polhode::Polhode;
use super::third::incomplete;
use crate::lane::{Lane, Matrix, Vector};
use crate::rotation::LaneQuaternion;

/// Range of `|Π|²` that neither overflows nor underflows.
const LEAST: f64 = 1e-280;
const GREATEST: f64 = 1e280;

/// As [`asymmetric::Asymmetric`], for arguments u up to [`Jacobi::SMALL`](super::super::elliptic::Jacobi::SMALL).
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

        let u = magnitude * self.rate * polhode.rate() * t;
        let (functions, small) = polhode.functions(u, lanes);
        let lanes = lanes & small;
        let third = incomplete(&functions, polhode.nu, lanes);
        let theta = magnitude * self.reciprocal.x * t - polhode.nu / polhode.rate() * third;

        let (change, valid) = polhode.change(&functions);
        let lanes = lanes & valid & polhode.same_side(&a, &(a + change));
        let ratios = (&self.near, &self.far);
        let [half_chi, half_epsilon] = half_angles(&polhode, ratios, &a, &change, &functions);
        let (cos, sinc) = cos_sinc(theta * 0.25 * theta, lanes);
        let half_theta = Complex {
            re: cos,
            im: theta * 0.5 * sinc,
        };
        let half_angle = half_theta.times(half_chi.times(half_epsilon).conj());
        let relative = least_then_about(half_angle, &a, &change);
        let rotation = LaneQuaternion {
            w: relative.w,
            u: self.axes * relative.u,
        };
        Turn {
            lanes,
            ..Turn::of(rotation, pi + self.axes * (change * magnitude))
        }
    }
}
