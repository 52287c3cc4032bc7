use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::{LoadCurvature, LoadGradient};
use crate::gravity::Attractor;
use crate::{Load, PointMass};

/// Sums the force `m a(d)` over the body's point masses at `d = x + R ρ`.
#[inline]
pub(super) fn load<A: Attractor>(
    source: &A,
    points: &[PointMass],
    x: &Vector3<f64>,
    r: &Matrix3<f64>,
) -> Load {
    let mut force = Vector3::zeros();
    let mut torque = Vector3::zeros();
    for PointMass { mass, position } in points {
        let arm = r * position;
        let pull = *mass * source.acceleration(&(x + arm));
        force += pull;
        torque += arm.cross(&pull);
    }
    Load {
        force,
        moment: r.tr_mul(&torque),
    }
}

pub(super) fn potential<A: Attractor>(
    source: &A,
    points: &[PointMass],
    x: &Vector3<f64>,
    r: &Matrix3<f64>,
) -> f64 {
    let each = |point: &PointMass| point.mass * source.potential(&(x + r * point.position));
    points.iter().map(each).sum()
}

pub(super) fn gradient<A: Attractor>(
    source: &A,
    points: &[PointMass],
    x: &Vector3<f64>,
    r: &Matrix3<f64>,
) -> LoadGradient {
    let mut sum = LoadGradient::default();
    for PointMass { mass, position } in points {
        let d = x + r * position;
        let force = *mass * source.acceleration(&d);
        let g = *mass * source.gradient(&d);
        let arm = hat(position);
        let g_r = g * r;
        let by_attitude = g_r * arm;
        sum.force_by_position += g;
        sum.force_by_attitude -= by_attitude;
        sum.moment_by_attitude += arm * (hat(&r.tr_mul(&force)) - r.tr_mul(&by_attitude));
    }
    // Gravity has a potential.
    sum.moment_by_position = sum.force_by_attitude.transpose();
    sum
}

pub(super) fn curvature<A: Attractor>(
    source: &A,
    points: &[PointMass],
    x: &Vector3<f64>,
    r: &Matrix3<f64>,
    weights: &Load,
) -> LoadCurvature {
    let mut sum = LoadCurvature::default();
    for PointMass { mass, position } in points {
        let d = x + r * position;
        let arm = hat(position);
        let c = weights.moment.cross(position);
        let b = weights.force + r * c;
        let force = *mass * source.acceleration(&d);
        let g = *mass * source.gradient(&d);
        let t = *mass * source.curvature(&d, &b);
        let g_r = g * r;
        let turned = t * r * arm + g_r * hat(&c);
        sum.position_position += t;
        sum.position_attitude -= turned;
        sum.attitude_attitude += arm * (hat(&r.tr_mul(&(g * b))) - r.tr_mul(&turned))
            + hat(&c) * (hat(&r.tr_mul(&force)) - r.tr_mul(&(g_r * arm)));
    }
    sum
}
