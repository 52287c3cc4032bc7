use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::{LoadCurvature, LoadGradient};
use crate::Load;
use crate::gravity::{Attractor, Monopole, Multipole};

/// The source's `GM` and the position of its monopole in the body frame, `e = Rᵀ(x_s − x)`, with `δe = −Rᵀδx + S(e) ζ`.
///
/// The asphericity of the body acts on this monopole, and the body feels the reaction. For the rest of the source's
/// field, the body is a point at its center of mass.
fn sight<A: Attractor>(
    source: &A,
    x: &Vector3<f64>,
    r: &Matrix3<f64>,
) -> Option<(f64, Vector3<f64>)> {
    let Monopole { gm, position, .. } = source.monopole()?;
    Some((gm, r.tr_mul(&(position - x))))
}

/// `f = m a_s − R a`, `M = a × e`, where a is the acceleration of the source's monopole due to the body's asphericity.
#[inline]
pub(super) fn load<A: Attractor>(
    source: &A,
    body: &Multipole,
    x: &Vector3<f64>,
    r: &Matrix3<f64>,
) -> Load {
    let mut load = Load {
        force: body.strength() * source.acceleration(x),
        moment: Vector3::zeros(),
    };
    if let Some((gm, e)) = sight(source, x, r) {
        let a = gm * body.asphericity().acceleration(&e);
        load.force -= r * a;
        load.moment = a.cross(&e);
    }
    load
}

pub(super) fn potential<A: Attractor>(
    source: &A,
    body: &Multipole,
    x: &Vector3<f64>,
    r: &Matrix3<f64>,
) -> f64 {
    let aspherical = sight(source, x, r).map(|(gm, e)| gm * body.asphericity().potential(&e));
    body.strength() * source.potential(x) + aspherical.unwrap_or(0.0)
}

/// With `K = S(a) − S(e) G`: `F_x = R G Rᵀ`, `F_R = −R Kᵀ`, `M_x = −K Rᵀ`, `M_R = K S(e)`.
pub(super) fn gradient<A: Attractor>(
    source: &A,
    body: &Multipole,
    x: &Vector3<f64>,
    r: &Matrix3<f64>,
) -> LoadGradient {
    let mut sum = LoadGradient {
        force_by_position: body.strength() * source.gradient(x),
        ..LoadGradient::default()
    };
    if let Some((gm, e)) = sight(source, x, r) {
        let a = gm * body.asphericity().acceleration(&e);
        let g = gm * body.asphericity().gradient(&e);
        let k = hat(&a) - hat(&e) * g;
        let rk = r * k.transpose();
        sum.force_by_position += r * g * r.transpose();
        sum.force_by_attitude = -rk;
        sum.moment_by_position = -rk.transpose();
        sum.moment_by_attitude = k * hat(&e);
    }
    sum
}

/// With `β = Rᵀb`, `w = β + c × e`, `s = G w + a × c`: `p = R s`, `q = e × s + β × a`, and
/// `δs = N δe + G S(β) ζ`, `N = T(w) + G S(c) − S(c) G`.
pub(super) fn curvature<A: Attractor>(
    source: &A,
    body: &Multipole,
    x: &Vector3<f64>,
    r: &Matrix3<f64>,
    weights: &Load,
) -> LoadCurvature {
    let mut sum = LoadCurvature {
        position_position: body.strength() * source.curvature(x, &weights.force),
        ..LoadCurvature::default()
    };
    if let Some((gm, e)) = sight(source, x, r) {
        let c = &weights.moment;
        let beta = r.tr_mul(&weights.force);
        let w = beta + c.cross(&e);
        let a = gm * body.asphericity().acceleration(&e);
        let g = gm * body.asphericity().gradient(&e);
        let t = gm * body.asphericity().curvature(&e, &w);
        let s = g * w + a.cross(c);
        let (hat_e, hat_beta) = (hat(&e), hat(&beta));
        let g_beta = g * hat_beta;
        let gc = g * hat(c);
        let n = t + gc + gc.transpose();
        sum.position_position -= r * n * r.transpose();
        sum.position_attitude = r * (n * hat_e + g_beta - hat(&s));
        sum.attitude_attitude =
            (hat_e * n + hat_beta * g - hat(&s)) * hat_e + hat_e * g_beta - hat(&a) * hat_beta;
    }
    sum
}
