//! The free rotation with two or three equal moments, in lanes.

use super::super::axisymmetric;
use super::angles::{cos_sinc, cos_sinc_pair};
use super::{Turn, UNIT};
use crate::lane::{Lane, Vector};
use crate::rotation::LaneQuaternion;

/// As [`axisymmetric::Axisymmetric`].
#[derive(Clone, Copy)]
pub(super) struct Axisymmetric<T> {
    pub(super) axis: Vector<T>,
    /// `1/J_t`.
    pub(super) precession_rate: T,
    /// `1/J_a − 1/J_t`.
    pub(super) spin_rate: T,
}

impl<T: Lane> Axisymmetric<T> {
    pub(super) fn set_lane(&mut self, k: usize, from: &axisymmetric::Axisymmetric) {
        self.axis.set_lane(k, &from.axis);
        self.precession_rate.set_lane(k, from.precession_rate);
        self.spin_rate.set_lane(k, from.spin_rate);
    }

    /// The flow if the axis of symmetry is a body axis.
    #[inline(always)]
    pub(super) fn flow_about<const AXIS: usize>(
        &self,
        pi: Vector<T>,
        t: f64,
        lanes: u32,
    ) -> Turn<T> {
        let half = 0.5 * t;
        let half_precession = pi * (self.precession_rate * half);
        let [pi_i, pi_j, pi_k] = from_axis::<AXIS, T>(pi);
        let half_spin = (self.spin_rate * half) * pi_i;
        let squared = [half_precession.norm_squared(), half_spin * half_spin];
        let (cos, sinc) = cos_sinc_pair(squared, lanes);
        let sin = sinc[1] * half_spin;
        let (double, w) = (sin + sin, cos[0]);
        let (across, along) = (double * cos[1], double * sin);
        let turned_j = pi_j + (across * pi_k - along * pi_j);
        let turned_k = pi_k - (across * pi_j + along * pi_k);
        let [u_i, u_j, u_k] = from_axis::<AXIS, T>(half_precession * sinc[0]);
        let cos = cos[1];
        let product = [
            w * sin + cos * u_i,
            cos * u_j + sin * u_k,
            cos * u_k - sin * u_j,
        ];
        Turn {
            rotation: LaneQuaternion {
                w: w * cos - sin * u_i,
                u: to_axis::<AXIS, T>(product),
            },
            factor: w.constant(UNIT),
            momentum: to_axis::<AXIS, T>([pi_i, turned_j, turned_k]),
            lanes: u32::MAX,
        }
    }

    /// The flow about any axis.
    #[inline(always)]
    pub(super) fn flow(&self, pi: Vector<T>, t: f64, lanes: u32) -> Turn<T> {
        let precession = from_rotation_vector(pi * (self.precession_rate * t), lanes);
        let angle = self.spin_rate * self.axis.dot(pi) * t;
        let spin = from_rotation_vector(self.axis * angle, lanes);
        Turn::of(precession.product(&spin), spin.rotate_back(pi))
    }
}

/// The flow with three equal moments.
#[inline(always)]
pub(super) fn spherical<T: Lane>(moment: T, pi: Vector<T>, t: f64, lanes: u32) -> Turn<T> {
    let vector = pi * (moment.constant(t) / moment);
    Turn::of(from_rotation_vector(vector, lanes), pi)
}

/// As [`lgvi_lie::Quaternion::from_rotation_vector`].
#[inline(always)]
fn from_rotation_vector<T: Lane>(v: Vector<T>, lanes: u32) -> LaneQuaternion<T> {
    let (cos, sinc) = cos_sinc(v.norm_squared() * 0.25, lanes);
    LaneQuaternion {
        w: cos,
        u: v * (sinc * 0.5),
    }
}

/// The components from the axis on, in cyclic order.
#[inline(always)]
fn from_axis<const AXIS: usize, T>(v: Vector<T>) -> [T; 3] {
    match AXIS {
        0 => [v.x, v.y, v.z],
        1 => [v.y, v.z, v.x],
        _ => [v.z, v.x, v.y],
    }
}

#[inline(always)]
fn to_axis<const AXIS: usize, T>([i, j, k]: [T; 3]) -> Vector<T> {
    match AXIS {
        0 => Vector::new(i, j, k),
        1 => Vector::new(k, i, j),
        _ => Vector::new(j, k, i),
    }
}
