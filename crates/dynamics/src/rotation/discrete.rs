//! The discrete rotation of one body: the implicit equation is solved in a few passes, starting from the solutions of
//! the previous steps.
//!
//! If `s = gᵀf` were known, the Cayley form `A f = g + g × f` with `A = 2J − s I` would be linear, with the solution
//! given in [`super::quartic`]. The previous steps determine s almost exactly. An error δ of s causes the residual δ f,
//! and changes `gᵀf` only by about δ times `s/(2J)`, so the iteration that replaces s by `gᵀf` converges fast. The
//! extrapolated quantity is the correction of s to its leading term `½ gᵀJ⁻¹g`, which is smaller by a factor `|f|²`.
//! All quantities are relative to `tr J` and in principal axes.

use lgvi_lie::Quaternion;
use nalgebra::{Matrix3, Vector3};

use super::{LaneQuaternion, PrincipalAxes, Unsolvable, newton};
use crate::lane::{Lane, Matrix, Vector};

/// Residual, relative to `|g|`, that counts as rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Square of [`ROUNDING`], by which `|g|²` is multiplied.
const SOLVED: f64 = ROUNDING * ROUNDING;

/// Largest number of passes after the first.
const MAX_PASSES: u32 = 4;

/// The equation `F J_d − J_d Fᵀ = S(h p)` of one body in every lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DiscreteRotation<T> {
    /// `2J`.
    moments: Vector<T>,
    /// `1/(2J)`.
    reciprocals: Vector<T>,
    /// `2 (J₃ − J₂), 2 (J₁ − J₃), 2 (J₂ − J₁)`.
    differences: Vector<T>,
    /// Principal axes as columns, or `None` if they are the body axes in every lane.
    axes: Option<Matrix<T>>,
    /// `d/e`, where e and d are the second coefficient and the determinant of `J / tr J`. For s below this limit, `p' ≥
    /// 8 (d − e s) + 2γ (1 − 2s)` is positive, so that a solution lies on the correct branch, and `A > J` is positive
    /// definite.
    limit: T,
    /// `1 / tr J`.
    scale: T,
}

/// A rotation, the correction of s, and a mask whose bit k is set if they are the solution in lane k.
#[derive(Clone, Copy)]
pub(crate) struct Solution<T> {
    pub(crate) rotation: LaneQuaternion<T>,
    pub(crate) correction: T,
    pub(crate) lanes: u32,
}

/// The data of the equation: `h p` scaled and in principal axes, its square, and the leading term of s.
struct Given<T> {
    g: Vector<T>,
    gamma: T,
    leading: T,
}

/// The solution for one system, with the number of passes or Newton corrections.
pub(crate) struct Solved {
    pub(crate) rotation: Quaternion,
    pub(crate) correction: f64,
    pub(crate) iterations: u32,
}

impl<T: Lane> DiscreteRotation<T> {
    /// Collects one body per lane. Lanes without a body hold zeros.
    pub(crate) fn gather(token: T::Token, bodies: &[DiscreteRotation<f64>]) -> Self {
        let zero = T::splat(token, 0.0);
        let none = Vector::splat(token, &Vector3::zeros());
        let mut all = Self {
            moments: none,
            reciprocals: none,
            differences: none,
            axes: (bodies.iter().any(|body| body.axes.is_some()))
                .then(|| Matrix::splat(token, &Matrix3::identity())),
            limit: zero,
            scale: zero,
        };
        for (k, body) in bodies.iter().enumerate() {
            all.moments.set_lane(k, &Vector3::from(body.moments));
            all.reciprocals
                .set_lane(k, &Vector3::from(body.reciprocals));
            all.differences
                .set_lane(k, &Vector3::from(body.differences));
            if let (Some(axes), Some(own)) = (&mut all.axes, &body.axes) {
                axes.set_lane(k, &own.lane(0));
            }
            all.limit.set_lane(k, body.limit);
            all.scale.set_lane(k, body.scale);
        }
        all
    }

    /// Solves the equation from guesses of the correction. Repeats until all of `lanes` are solved or the limit of
    /// passes is reached.
    #[inline(always)]
    pub(crate) fn solve(&self, h: f64, p: Vector<T>, guess: T, lanes: u32) -> Solution<T> {
        let (solution, _) = self.passes(&self.given(h, p), guess, lanes);
        self.in_body_axes(solution)
    }

    /// Solves the equation in principal axes, and returns the number of passes.
    #[inline(always)]
    fn passes(&self, given: &Given<T>, guess: T, lanes: u32) -> (Solution<T>, u32) {
        let mut solution = self.pass(given, guess);
        let mut guess = solution.correction;
        for passes in 1..=MAX_PASSES {
            let open = lanes & !solution.lanes;
            if open == 0 {
                return (solution, passes);
            }
            let next = self.pass(given, guess);
            guess = next.correction;
            solution = next.or(solution, open);
        }
        (solution, MAX_PASSES + 1)
    }

    #[inline(always)]
    fn given(&self, h: f64, p: Vector<T>) -> Given<T> {
        let g = p * (self.scale * h);
        let g = match &self.axes {
            Some(axes) => axes.tr_mul(g),
            None => g,
        };
        Given {
            g,
            gamma: g.norm_squared(),
            leading: self.reciprocals.dot(g.component_mul(g)),
        }
    }

    /// The solution of `(2J − s I) f = g + g × f` for a guess of the correction, in principal axes.
    #[inline(always)]
    fn pass(&self, given: &Given<T>, guess: T) -> Solution<T> {
        let Given { g, gamma, leading } = *given;
        let (j, k) = (&self.moments, &self.differences);
        let guess = leading + guess;
        let (a, b, c) = (j.x - guess, j.y - guess, j.z - guess);
        let (bc, ca, ab) = (b * c, c * a, a * b);
        let u = Vector::new(
            (bc + gamma) * g.x - k.x * (g.y * g.z),
            (ca + gamma) * g.y - k.y * (g.z * g.x),
            (ab + gamma) * g.z - k.z * (g.x * g.y),
        );
        let w = a * bc + (a * (g.x * g.x) + b * (g.y * g.y) + c * (g.z * g.z));
        let reciprocal = gamma.constant(1.0) / w;
        let s = reciprocal * g.dot(u);
        let miss = (s - guess) * reciprocal;
        let residual = miss * miss * u.norm_squared();
        Solution {
            rotation: LaneQuaternion { w, u },
            correction: s - leading,
            lanes: residual.at_most(gamma * SOLVED) & s.below(self.limit),
        }
    }

    #[inline(always)]
    fn in_body_axes(&self, mut solution: Solution<T>) -> Solution<T> {
        if let Some(axes) = &self.axes {
            solution.rotation.u = *axes * solution.rotation.u;
        }
        solution
    }
}

impl<T: Lane> Solution<T> {
    /// This solution in the `open` lanes that it solves, the other one elsewhere.
    #[inline(always)]
    fn or(self, other: Self, open: u32) -> Self {
        let solved = open & self.lanes;
        let (u, others) = (self.rotation.u, other.rotation.u);
        Self {
            rotation: LaneQuaternion {
                w: self.rotation.w.where_in(solved, other.rotation.w),
                u: Vector::new(
                    u.x.where_in(solved, others.x),
                    u.y.where_in(solved, others.y),
                    u.z.where_in(solved, others.z),
                ),
            },
            correction: self.correction.where_in(solved, other.correction),
            lanes: other.lanes | solved,
        }
    }
}

impl DiscreteRotation<f64> {
    pub(crate) fn new(trace: f64, principal: &PrincipalAxes) -> Self {
        let moments = principal.moments / trace;
        let j = 2.0 * moments;
        let minors = Vector3::new(
            moments.y * moments.z,
            moments.z * moments.x,
            moments.x * moments.y,
        );
        Self {
            moments: (&j).into(),
            reciprocals: (&j.map(f64::recip)).into(),
            differences: Vector::new(j.z - j.y, j.x - j.z, j.y - j.x),
            axes: (principal.axes).map(|axes| Matrix::splat((), &axes)),
            limit: moments.x * minors.x / minors.sum(),
            scale: trace.recip(),
        }
    }

    /// The solution, or `None` if the first pass does not find it.
    #[inline(always)]
    pub(crate) fn first_pass(
        &self,
        h: f64,
        p: &Vector3<f64>,
        guess: f64,
    ) -> Option<(Quaternion, f64)> {
        let solution = self.pass(&self.given(h, p.into()), guess);
        (solution.lanes == 1).then(|| {
            let LaneQuaternion { w, u } = self.in_body_axes(solution).rotation;
            (Quaternion { w, u: u.into() }, solution.correction)
        })
    }

    /// The solution, with as many iterations as needed.
    pub(crate) fn find(&self, h: f64, p: &Vector3<f64>, guess: f64) -> Result<Solved, Unsolvable> {
        let given = self.given(h, p.into());
        let (mut solution, mut iterations) = self.passes(&given, guess, 1);
        if solution.lanes == 0 {
            let g = given.g.into();
            let moments = 0.5 * Vector3::from(self.moments);
            let (cayley, corrections) =
                newton::solve(&moments, &g).map_err(|margin| Unsolvable {
                    turn: g.component_div(&moments).norm(),
                    margin,
                })?;
            iterations = corrections;
            solution.rotation = LaneQuaternion {
                w: 1.0,
                u: (&cayley).into(),
            };
            solution.correction = g.dot(&cayley) - given.leading;
        }
        let LaneQuaternion { w, u } = self.in_body_axes(solution).rotation;
        Ok(Solved {
            rotation: Quaternion { w, u: u.into() },
            correction: solution.correction,
            iterations,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Inertia;

    /// The first pass from a guess of s itself.
    fn first(inertia: &Inertia, p: &Vector3<f64>, s: f64) -> Option<Vector3<f64>> {
        let rotation = &inertia.rotation;
        let leading = rotation.given(0.01, p.into()).leading;
        let (found, _) = rotation.first_pass(0.01, p, s - leading)?;
        Some(found.u / found.w)
    }

    /// The first pass succeeds only with the correct s, and later passes from any guess. Beyond the limit, no wrong
    /// solution is accepted.
    #[test]
    fn a_good_guess_is_solved_at_once_and_a_bad_one_later() {
        let turned = lgvi_lie::exp(&Vector3::new(0.3, 0.5, -0.2));
        let mut rng = fastrand::Rng::with_seed(9);
        let mut solved = 0;
        for moments in [[1.0, 1.0, 1.0], [1.0, 2.0, 3.0], [1e-3, 0.7, 0.7]] {
            let j = Matrix3::from_diagonal(&Vector3::from(moments));
            for j in [j, turned * j * turned.transpose()] {
                let inertia = Inertia::new(j).unwrap();
                for _ in 0..300 {
                    let rate = Vector3::from_fn(|_, _| 10.0 * (2.0 * rng.f64() - 1.0));
                    let p = inertia.matrix() * rate;
                    let g: Vector3<f64> = inertia.rotation.given(0.01, (&p).into()).g.into();
                    let moments = inertia.principal.moments / inertia.matrix().trace();
                    let (newton, _) = newton::solve(&moments, &g).unwrap();
                    let s = g.dot(&newton);
                    let expected = inertia.principal.axes.map_or(newton, |axes| axes * newton);
                    // The residual of the equation, because J may be ill-conditioned, especially near the limit.
                    let miss = |f: &Vector3<f64>| {
                        (inertia.matrix() * (f - expected)).norm() / (0.01 * p).norm()
                    };
                    if s < 0.9 * inertia.rotation.limit {
                        solved += 1;
                        assert!(miss(&first(&inertia, &p, s).unwrap()) < 1e-14);
                        assert_eq!(first(&inertia, &p, s + 1e-12), None);
                    }
                    assert_eq!(first(&inertia, &p, f64::NAN), None);
                    for guess in [0.0, 1.1 * s, 0.3] {
                        let found = inertia.rotation.find(0.01, &p, guess).unwrap();
                        let f = found.rotation.u / found.rotation.w;
                        assert!(miss(&f) < 1e-12, "{guess} for {s}");
                    }
                }
                let beyond = inertia.matrix() * Vector3::new(0.0, 0.0, 101.0);
                for n in 0..2000 {
                    assert_eq!(first(&inertia, &beyond, 1e-3 * f64::from(n)), None);
                }
            }
        }
        assert!(solved > 800, "{solved} were below the limit");
    }
}
