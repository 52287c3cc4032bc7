//! The discrete rotation in cases where the passes of `discrete` do not converge: large rotations and thin rods.
//!
//! The smallest root `s` of the quartic, computed by a scalar Newton iteration, gives the Cayley vector, which Newton's
//! method on (2.6) refines. For a thin rod the quartic is nearly a square, and its root is poorly determined. Newton's
//! method on (2.6) then starts from the solution for small rotations. If neither converges to the correct branch, the
//! root is found by bisection.

use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::quartic::Quartic;

/// Residual, relative to the terms of its sum, that counts as rounding. The comparison is by component, because the
/// small moments of thin rods make small terms.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Limit of Newton corrections.
const MAX_ITERATIONS: u32 = 12;

/// The Cayley vector on the branch that starts at `F = I`, and the number of corrections. `j` are the principal moments
/// of `J / tr J`, and `g` is in principal axes and relative to `tr J`.
///
/// # Errors
/// If no solution exists, returns the (negative) maximum of the quartic, relative to the magnitude of its value at 0.
pub(super) fn solve(j: &Vector3<f64>, g: &Vector3<f64>) -> Result<(Vector3<f64>, u32), f64> {
    let p = Quartic::new(j, g);
    let (start, iterations) = match root(&p) {
        Some((s, iterations)) => (cayley_vector(j, g, p.gamma, s), iterations),
        None => (0.5 * g.component_div(j), 0),
    };
    let on_branch = |start| newton(j, g, start).filter(|(cayley, _)| p.rises_to(g.dot(cayley)));
    if let Some((cayley, corrections)) = on_branch(start) {
        return Ok((cayley, iterations + corrections));
    }
    let unpolished = cayley_vector(j, g, p.gamma, p.root()?);
    let cayley = on_branch(unpolished).map_or(unpolished, |(cayley, _)| cayley);
    Ok((cayley, MAX_ITERATIONS))
}

/// The smallest root of `p` by Newton's method, and the number of corrections. Returns `None` if the root is poorly
/// determined.
///
/// Without its last terms `s³(2 − s)`, p is a parabola that lies below it and whose root is slightly larger. From there
/// the tangents of the concave p lead to the root from below.
fn root(p: &Quartic) -> Option<(f64, u32)> {
    let half_slope = 4.0 * p.d + p.gamma;
    let curvature = 4.0 * p.e + 2.0 * p.gamma;
    let discriminant = half_slope * half_slope - curvature * p.c;
    let mut s = p.c / (half_slope + discriminant.max(0.0).sqrt());
    for iterations in 1..=MAX_ITERATIONS {
        let slope = p.slope(s);
        let correction = p.value(s) / slope;
        // The rounding error of p, about ε c, would move the root by 1e4 ε s.
        if slope * s < 1e-4 * p.c {
            return None;
        }
        s -= correction;
        if correction.abs() <= 1e-8 * s {
            return Some((s, iterations));
        }
    }
    None
}

/// `f = [adj(A) g + |g|² g − g × A g] / (det A + gᵀA g)`, `A = 2J − s I`.
fn cayley_vector(j: &Vector3<f64>, g: &Vector3<f64>, gamma: f64, s: f64) -> Vector3<f64> {
    let [u, v, w] = (2.0 * j - Vector3::repeat(s)).into();
    let a_g = Vector3::new(u * g.x, v * g.y, w * g.z);
    let adjugate_g = Vector3::new(v * w * g.x, w * u * g.y, u * v * g.z);
    (adjugate_g + gamma * g - g.cross(&a_g)) / (u * v * w + g.dot(&a_g))
}

/// Solves (2.6) by Newton's method from `f`. Returns the solution and the number of corrections, or `None` if it does
/// not converge.
fn newton(j: &Vector3<f64>, g: &Vector3<f64>, mut f: Vector3<f64>) -> Option<(Vector3<f64>, u32)> {
    let magnitude = g.amax();
    let two_j = 2.0 * j;
    for corrections in 0..=MAX_ITERATIONS {
        let s = g.dot(&f);
        let two_j_f = two_j.component_mul(&f);
        let residual = g + g.cross(&f) + s * f - two_j_f;
        let terms = (g.abs() + two_j_f.abs()).add_scalar(magnitude * f.amax());
        if residual.abs() <= ROUNDING * terms {
            return Some((f, corrections));
        }
        let jacobian = hat(g) + f * g.transpose() + Matrix3::from_diagonal_element(s)
            - Matrix3::from_diagonal(&two_j);
        f -= solve_3x3(&jacobian, &residual)?;
    }
    None
}

/// `M⁻¹ v` by Cramer's rule, or `None` if `M` is singular.
fn solve_3x3(m: &Matrix3<f64>, v: &Vector3<f64>) -> Option<Vector3<f64>> {
    let (a, b, c) = (m.column(0), m.column(1), m.column(2));
    let bc = b.cross(&c);
    let reciprocal = a.dot(&bc).recip();
    let solution = Vector3::new(v.dot(&bc), a.dot(&v.cross(&c)), a.dot(&b.cross(v))) * reciprocal;
    solution.sum().is_finite().then_some(solution)
}
