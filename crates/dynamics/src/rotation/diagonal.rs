//! The implicit equation for a body whose axes are principal axes, cheaper than the general one.
//!
//! The smallest root `s` of the quartic of the branch, by Newton's method on one number, gives the Cayley vector. For a thin
//! rod the quartic is nearly a square, and its root says little; then Newton's method on (2.6) is left.

use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::branch::Quartic;
use super::{MAX_ITERATIONS, RelativeRotation, solve_3x3};

/// Residual, relative to the terms it is the sum of, that is rounding: component by component, for thin rods, where small
/// moments make small terms.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The solution on the branch that starts at `F = I` for the inverse moments `inverse` and `g`, in units of one another;
/// where there is none, how far the quartic's maximum stays below zero, relative to its value at 0.
#[inline]
pub(super) fn solve(inverse: &Vector3<f64>, g: &Vector3<f64>) -> Result<RelativeRotation, f64> {
    let [a, b, c] = (*inverse).into();
    // J / tr J is the adjugate of J⁻¹ over its trace.
    let adjugate = Vector3::new(b * c, c * a, a * b);
    let reciprocal = adjugate.sum().recip();
    let j = reciprocal * adjugate;
    let relative = a * b * c * reciprocal;
    let half_turn = 0.5 * inverse.component_mul(g);
    let g = relative * g;

    let squares = g.component_mul(&g);
    let minors = Vector3::new(j.y * j.z, j.z * j.x, j.x * j.y);
    let gamma = squares.sum();
    let p = Quartic {
        e: minors.sum(),
        d: j.x * minors.x,
        gamma,
        c: 4.0 * squares.dot(&minors) + gamma * gamma,
    };
    let (start, iterations) = match root(&p) {
        Some((s, iterations)) => (cayley_vector(&j, &g, gamma, s), iterations),
        None => (half_turn, 0),
    };
    let on_branch = |start| newton(&j, &g, start).filter(|(cayley, _)| p.rises_to(g.dot(cayley)));
    if let Some((cayley, corrections)) = on_branch(start) {
        return Ok(RelativeRotation {
            cayley,
            iterations: iterations + corrections,
        });
    }
    let unpolished = cayley_vector(&j, &g, gamma, p.root()?);
    Ok(RelativeRotation {
        cayley: on_branch(unpolished).map_or(unpolished, |(cayley, _)| cayley),
        iterations: MAX_ITERATIONS,
    })
}

/// The smallest root of `p` by Newton's method, and its corrections; `None` where the root is poorly determined.
///
/// Without its last terms `s³(2 − s)`, p is a parabola below it, whose root lies just past p's; from there the tangents
/// of a concave p lead to the root from below.
#[inline]
fn root(p: &Quartic) -> Option<(f64, u32)> {
    let half_slope = 4.0 * p.d + p.gamma;
    let curvature = 4.0 * p.e + 2.0 * p.gamma;
    let discriminant = half_slope * half_slope - curvature * p.c;
    let mut s = p.c / (half_slope + discriminant.max(0.0).sqrt());
    for iterations in 1..=MAX_ITERATIONS {
        let slope = p.slope(s);
        let correction = p.value(s) / slope;
        // Rounding of p, about ε c, would move the root by 1e4 ε s.
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
#[inline]
fn cayley_vector(j: &Vector3<f64>, g: &Vector3<f64>, gamma: f64, s: f64) -> Vector3<f64> {
    let [u, v, w] = (2.0 * j - Vector3::repeat(s)).into();
    let a_g = Vector3::new(u * g.x, v * g.y, w * g.z);
    let adjugate_g = Vector3::new(v * w * g.x, w * u * g.y, u * v * g.z);
    (adjugate_g + gamma * g - g.cross(&a_g)) / (u * v * w + g.dot(&a_g))
}

/// Newton's method on (2.6) from `f`: the solution and the corrections made; `None` when it does not converge.
#[inline]
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Inertia;
    use crate::rotation::Chart;

    /// From small turns to past the limit of solvability, for spheres, flat bodies and rods: the same rotation, or the same
    /// refusal, as the general solver.
    #[test]
    fn answers_are_those_of_the_general_solver() {
        let mut rng = fastrand::Rng::with_seed(11);
        let mut unsolvable = 0;
        // The thinnest rod's fold is rounding, so that nothing can be said there.
        for (moments, turns) in [
            ([1.0, 1.0, 1.0], 8),
            ([1.0, 2.0, 3.0], 8),
            ([2.0, 1.5, 0.8], 8),
            ([1e-3, 0.7, 0.7], 8),
            ([0.7, 0.700_001, 1e-6], 8),
            ([0.5, 1e-10, 0.5], 5),
        ] {
            let inertia = Inertia::principal(moments).unwrap();
            let inverse = Vector3::from(moments).map(f64::recip);
            for n in 0..400 {
                let direction = Vector3::from_fn(|_, _| 2.0 * rng.f64() - 1.0).normalize();
                let turn = [1e-9, 1e-3, 0.1, 0.5, 0.9, 1.2, 1.5, 2.5][n % turns];
                let g = inertia.matrix() * direction * turn;
                match (solve(&inverse, &g), Chart::Cayley.solve(&inertia, &g, None)) {
                    (Ok(found), Ok(expected)) => {
                        let difference = (found.cayley - expected.cayley).norm();
                        // Rounding turns a thin rod by the ratio of moments more; near the fold, by its square root.
                        let (rounding, solved) = match turn < 1.0 {
                            true => (1e-12 + 8.0 * f64::EPSILON * inverse.max(), 2e-15),
                            false => (1e-2, 1e-13),
                        };
                        let bound = rounding * expected.cayley.norm();
                        assert!(difference < bound, "{moments:?} {turn}: {difference:e}");
                        let residual = found.matrix() * inertia.nonstandard()
                            - inertia.nonstandard() * found.matrix().transpose()
                            - hat(&g);
                        let size = inertia.matrix().norm() + g.norm();
                        assert!(residual.norm() < solved * size, "{moments:?} {turn}");
                    }
                    (Err(margin), Err(expected)) => {
                        unsolvable += 1;
                        assert!((margin - expected.margin).abs() < 1e-12);
                    }
                    (found, expected) => panic!("{moments:?} {turn}: {found:?}, {expected:?}"),
                }
            }
        }
        assert!(
            unsolvable > 400,
            "the sweep must pass the limit, {unsolvable} did"
        );
    }

    #[test]
    fn no_turn_is_the_identity() {
        let found = solve(&Vector3::new(1.0, 0.5, 0.4), &Vector3::zeros()).unwrap();
        assert_eq!(found.cayley, Vector3::zeros());
    }
}
