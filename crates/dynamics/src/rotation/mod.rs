//! The implicit equation of a Lie group variational step (2.1): given `g`, find the rotation `F` with
//! `F J_d − J_d Fᵀ = S(g)`.
//!
//! Both charts end at the same `F`, which is returned as its Cayley vector. Several `F` satisfy the equation; the one
//! wanted is the one that grows from `F = I` as `g` grows from 0. It exists up to a limit only (on a principal axis, 90°
//! a step), and past that limit a Newton iteration may wander off to another solution or to none. So each solution is
//! checked to lie on the wanted branch, and where it does not, the branch itself is asked (`branch`).

mod branch;
mod cayley;
mod diagonal;
mod direct;
mod exponential;
mod free;
mod preprocessed;
mod principal;

use lgvi_lie::{cay, to_cayley, to_rotation_vector};
use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

pub use free::FreeRotation;
pub use preprocessed::{PreprocessedDmv, PreprocessedError, PreprocessedOrder};

use crate::Inertia;
pub(crate) use direct::{Direct, General, MAX_PASSES, Moments, Principal, SOLVED};

/// The chart in which the implicit equation is solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Chart {
    /// `F = cay(f)` (2.5), (2.6): polynomial, no transcendental functions.
    #[default]
    Cayley,
    /// `F = exp S(f)` (2.2), (2.3).
    Exponential,
}

/// The solution of an implicit equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeRotation {
    /// Cayley vector `f` of `F = cay(f)`.
    pub cayley: Vector3<f64>,
    /// Newton corrections made.
    pub iterations: u32,
}

impl RelativeRotation {
    /// The matrix `F`.
    pub fn matrix(&self) -> Matrix3<f64> {
        cay(&self.cayley)
    }
}

/// The implicit equation has no solution: the body would turn too far in one step.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error(
    "the body would turn by about {turn:.3} rad in one step, past the limit of solvability: \
     expected |J⁻¹ g| ≤ 1 (always solvable), margin {margin:.1e} (solvable when ≥ 0)"
)]
pub struct Unsolvable {
    /// `|J⁻¹ g|`, about the angle that the body would turn by.
    pub turn: f64,
    /// Greatest value of the solvability quartic before its fold, relative to its value at 0; negative past the limit.
    pub margin: f64,
}

/// Newton corrections after which the branch is asked instead.
const MAX_ITERATIONS: u32 = 12;

impl Chart {
    /// Solves `F J_d − J_d Fᵀ = S(g)` for finite `g`, starting from the Cayley vector `guess` or, without one, from the
    /// solution for small `g`.
    pub fn solve(
        self,
        inertia: &Inertia,
        g: &Vector3<f64>,
        guess: Option<&Vector3<f64>>,
    ) -> Result<RelativeRotation, Unsolvable> {
        let small = || inertia.inverse * g;
        // Relative to tr J, no unit can over- or underflow what the convergence test compares.
        let relative = &(g * inertia.shape.trace.recip());
        let newton = match self {
            Self::Cayley => {
                let start = guess.copied().unwrap_or_else(|| 0.5 * small());
                cayley::newton(inertia, relative, start)
            }
            Self::Exponential => {
                let start = guess.map_or_else(small, to_rotation_vector);
                exponential::newton(inertia, relative, start).map(
                    |(rotation_vector, iterations)| RelativeRotation {
                        cayley: to_cayley(&rotation_vector),
                        iterations,
                    },
                )
            }
        };
        match newton {
            Some(found) if branch::contains(inertia, relative, &found.cayley) => Ok(found),
            _ => branch::solve(inertia, relative).map_err(|margin| Unsolvable {
                turn: small().norm(),
                margin,
            }),
        }
    }
}

/// `M⁻¹ v` by Cramer's rule; `None` when `M` is singular.
fn solve_3x3(m: &Matrix3<f64>, v: &Vector3<f64>) -> Option<Vector3<f64>> {
    let (a, b, c) = (m.column(0), m.column(1), m.column(2));
    let bc = b.cross(&c);
    let reciprocal = a.dot(&bc).recip();
    let solution = Vector3::new(v.dot(&bc), a.dot(&v.cross(&c)), a.dot(&b.cross(v))) * reciprocal;
    solution.sum().is_finite().then_some(solution)
}

#[cfg(test)]
mod tests {
    use lgvi_lie::hat;

    use super::*;

    /// Inertias from spherical over slender (axial moment 1/700 of the others) to flat, one of them off axes.
    fn inertias() -> Vec<Inertia> {
        let turned = lgvi_lie::exp(&Vector3::new(0.3, 0.5, -0.2));
        let diagonal = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 2.5));
        let mut all: Vec<_> = [
            [1.0, 1.0, 1.0],
            [1.0, 2.0, 3.0],
            [0.1, 1.0, 1.0],
            [1e-3, 0.7, 0.7],
            [2.0, 1.5, 0.8],
        ]
        .into_iter()
        .map(|moments| Inertia::principal(moments).unwrap())
        .collect();
        all.push(Inertia::new(turned * diagonal * turned.transpose()).unwrap());
        all
    }

    fn directions() -> impl Iterator<Item = Vector3<f64>> {
        let mut rng = fastrand::Rng::with_seed(7);
        (0..300).map(move |_| Vector3::from_fn(|_, _| 2.0 * rng.f64() - 1.0).normalize())
    }

    fn residual(inertia: &Inertia, g: &Vector3<f64>, f: &Matrix3<f64>) -> f64 {
        let j_d = inertia.nonstandard();
        (f * j_d - j_d * f.transpose() - hat(g)).norm() / (inertia.matrix().norm() + g.norm())
    }

    #[test]
    fn both_charts_solve_the_equation_up_to_the_sufficient_bound() {
        for inertia in inertias() {
            for direction in directions() {
                for turn in [1e-9, 1e-3, 0.1, 0.5, 0.999] {
                    let g = inertia.matrix() * direction * turn;
                    let cayley = Chart::Cayley.solve(&inertia, &g, None).unwrap();
                    let exponential = Chart::Exponential.solve(&inertia, &g, None).unwrap();
                    assert!(residual(&inertia, &g, &cayley.matrix()) < 2e-15);
                    assert!(residual(&inertia, &g, &exponential.matrix()) < 2e-15);
                    assert!((cayley.cayley - exponential.cayley).norm() < 1e-10 * turn);
                }
            }
        }
    }

    /// The same rotation whatever the unit of inertia, near the ends of the range of numbers too.
    #[test]
    fn solutions_do_not_depend_on_the_unit() {
        for chart in [Chart::Cayley, Chart::Exponential] {
            let solve = |unit: f64| {
                let inertia = Inertia::principal([unit, 2.0 * unit, 2.5 * unit]).unwrap();
                let g = inertia.matrix() * Vector3::new(0.1, 0.2, -0.3);
                chart.solve(&inertia, &g, None).unwrap().cayley
            };
            let expected = solve(1.0);
            for unit in [1e-170, 1e-160, 1e160, 1e170, 1e250, 1e-290] {
                assert!((solve(unit) - expected).norm() < 1e-15, "{unit:e}");
            }
        }
    }

    #[test]
    fn on_a_principal_axis_the_limit_is_a_quarter_turn() {
        let inertia = Inertia::principal([1.0, 2.0, 2.5]).unwrap();
        for (axis, moment) in [1.0, 2.0, 2.5].into_iter().enumerate() {
            for chart in [Chart::Cayley, Chart::Exponential] {
                let solvable = Vector3::ith(axis, moment * (1.0 - 1e-9));
                let f = chart.solve(&inertia, &solvable, None).unwrap().cayley;
                let angle = 2.0 * f.norm().atan();
                assert!(
                    (angle.sin() - (1.0 - 1e-9)).abs() < 1e-14
                        && angle < std::f64::consts::FRAC_PI_2
                );

                let error = chart.solve(&inertia, &Vector3::ith(axis, moment * 1.0001), None);
                let Unsolvable { turn, margin } = error.unwrap_err();
                assert!((turn - 1.0001).abs() < 1e-12 && margin < 0.0);
            }
        }
    }

    /// Whatever the size of `g` and the starting guess, the answer is the solution on the branch or an error, and which
    /// of them does not depend on chart or guess.
    #[test]
    fn answers_do_not_depend_on_chart_or_guess_up_to_and_past_the_limit() {
        let mut unsolvable = 0;
        for inertia in inertias() {
            for (n, direction) in directions().enumerate() {
                let g = inertia.matrix() * direction * (0.5 + 0.01 * n as f64);
                let wild = Vector3::new(3.0, -2.0, 5.0) * direction.x;
                let answers = [
                    Chart::Cayley.solve(&inertia, &g, None),
                    Chart::Cayley.solve(&inertia, &g, Some(&wild)),
                    Chart::Exponential.solve(&inertia, &g, None),
                    branch::solve(&inertia, &(g * inertia.shape.trace.recip())).map_err(|margin| {
                        Unsolvable {
                            turn: (inertia.inverse * g).norm(),
                            margin,
                        }
                    }),
                ];
                unsolvable += usize::from(answers[0].is_err());
                for answer in &answers {
                    match (answer, &answers[3]) {
                        (Ok(found), Ok(expected)) => {
                            let difference = (found.cayley - expected.cayley).norm();
                            assert!(
                                difference < 1e-5 * expected.cayley.norm(),
                                "{g}: {answers:?}"
                            );
                            assert!(residual(&inertia, &g, &found.matrix()) < 1e-13);
                        }
                        (Err(found), Err(expected)) => assert_eq!(found, expected),
                        _ => panic!("{g}: {answers:?}"),
                    }
                }
            }
        }
        assert!(
            unsolvable > 500,
            "the sweep must pass the limit, {unsolvable} did"
        );
    }
}
