//! The implicit equation solved without a Newton iteration, for steps that follow each other closely.
//!
//! Were `s = gᵀf` known, the Cayley form `A f = g + g × f` with `A = 2J − s I` would be linear, with the solution that
//! [`super::branch`] states. And s is all but known from the last steps: an error δ of it leaves the residual δ f, and
//! `gᵀf` misses s by δ times about `s/(2J)` only, so that repeating with `gᵀf` converges fast. What is extrapolated is the
//! correction of s to its leading term `½ gᵀJ⁻¹g`, smaller by `|f|²`. All is relative to `tr J`.

use lgvi_lie::Quaternion;
use nalgebra::{Matrix3, Vector3};

use super::{Chart, RelativeRotation, Unsolvable, principal};
use crate::Inertia;

/// Residual, relative to `|g|`, that is rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Its square, by which `|g|²` is multiplied.
pub(crate) const SOLVED: f64 = ROUNDING * ROUNDING;

/// Repetitions after which [`Chart::solve`] takes over.
pub(crate) const MAX_PASSES: u32 = 4;

/// `J / tr J` of a body as the equation needs it.
pub(crate) trait Moments {
    /// The solution `f = u/w` of `(2J − s I) f = g + g × f` as the quaternion `(w, u)`, without a division; given `|g|²` too.
    fn solution(&self, g: &Vector3<f64>, gamma: f64, s: f64) -> Quaternion;

    /// `½ gᵀJ⁻¹g`, which s is for small g.
    fn leading(&self, g: &Vector3<f64>) -> f64;
}

/// Moments about principal axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Principal {
    /// `2J`
    pub(crate) moments: Vector3<f64>,
    /// `1/(2J)`
    pub(crate) reciprocals: Vector3<f64>,
    /// `2 (J₃ − J₂), 2 (J₁ − J₃), 2 (J₂ − J₁)`
    pub(crate) differences: Vector3<f64>,
}

impl Principal {
    fn of(moments: &Vector3<f64>) -> Self {
        let j = 2.0 * moments;
        Self {
            moments: j,
            reciprocals: j.map(f64::recip),
            differences: Vector3::new(j.z - j.y, j.x - j.z, j.y - j.x),
        }
    }
}

impl Moments for Principal {
    #[inline(always)]
    fn solution(&self, g: &Vector3<f64>, gamma: f64, s: f64) -> Quaternion {
        let (j, k) = (&self.moments, &self.differences);
        let (a, b, c) = (j.x - s, j.y - s, j.z - s);
        let (bc, ca, ab) = (b * c, c * a, a * b);
        let form = a * (g.x * g.x) + b * (g.y * g.y) + c * (g.z * g.z);
        let u = Vector3::new(
            (bc + gamma) * g.x - k.x * (g.y * g.z),
            (ca + gamma) * g.y - k.y * (g.z * g.x),
            (ab + gamma) * g.z - k.z * (g.x * g.y),
        );
        let w = a * bc + form;
        Quaternion { w, u }
    }

    #[inline(always)]
    fn leading(&self, g: &Vector3<f64>) -> f64 {
        self.reciprocals.dot(&g.component_mul(g))
    }
}

/// Moments about any axes: by the principal ones, for the adjugate of an ill-conditioned matrix loses digits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct General {
    pub(crate) principal: Principal,
    /// Principal axes, in columns.
    pub(crate) axes: Matrix3<f64>,
}

impl Moments for General {
    #[inline(always)]
    fn solution(&self, g: &Vector3<f64>, gamma: f64, s: f64) -> Quaternion {
        let Quaternion { w, u } = self.principal.solution(&self.axes.tr_mul(g), gamma, s);
        let u = self.axes * u;
        Quaternion { w, u }
    }

    #[inline(always)]
    fn leading(&self, g: &Vector3<f64>) -> f64 {
        self.principal.leading(&self.axes.tr_mul(g))
    }
}

/// One body's implicit equation in the Cayley chart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Direct<M> {
    pub(crate) moments: M,
    /// `d/e`, second coefficient and determinant of `J / tr J`: up to there `p' ≥ 8 (d − e s) + 2γ (1 − 2s)` is positive,
    /// so that a solution lies on the branch, and `A > J` is positive definite.
    pub(crate) limit: f64,
    /// `1 / tr J`
    pub(crate) scale: f64,
}

impl Direct<Principal> {
    /// For an inertia whose axes are principal axes.
    pub(crate) fn principal(inertia: &Inertia) -> Option<Self> {
        let moments = inertia.unit.diagonal();
        (inertia.unit == Matrix3::from_diagonal(&moments))
            .then(|| Self::of(inertia, Principal::of(&moments)))
    }
}

impl Direct<General> {
    /// For any inertia.
    pub(crate) fn general(inertia: &Inertia) -> Self {
        let (moments, axes) = principal::axes(&inertia.unit);
        let principal = Principal::of(&moments);
        let axes = lgvi_lie::polish(&axes);
        Self::of(inertia, General { principal, axes })
    }
}

impl<M: Moments> Direct<M> {
    fn of(inertia: &Inertia, moments: M) -> Self {
        Self {
            moments,
            limit: inertia.shape.determinant / inertia.shape.second,
            scale: inertia.shape.trace.recip(),
        }
    }

    /// The quaternion of the F that solves `F J_d − J_d Fᵀ = S(h p)`, and the correction of s, from a guess of it; `None`
    /// where s is not found at once or may not be on the branch.
    #[inline(always)]
    pub(crate) fn solve(&self, h: f64, p: &Vector3<f64>, guess: f64) -> Option<(Quaternion, f64)> {
        let g = (h * self.scale) * p;
        let gamma = g.norm_squared();
        let leading = self.moments.leading(&g);
        let guess = leading + guess;
        let turn = self.moments.solution(&g, gamma, guess);
        let reciprocal = 1.0 / turn.w;
        let s = reciprocal * g.dot(&turn.u);
        let miss = (s - guess) * reciprocal;
        let residual = miss * miss * turn.u.norm_squared();
        let solved = residual <= SOLVED * gamma;
        (solved & (s < self.limit)).then_some((turn, s - leading))
    }

    /// The same whatever it takes, and the number of repetitions and Newton corrections.
    pub(crate) fn solve_on(
        &self,
        inertia: &Inertia,
        h: f64,
        p: &Vector3<f64>,
        guess: f64,
    ) -> Result<(RelativeRotation, f64), Unsolvable> {
        let g = (h * self.scale) * p;
        let leading = self.moments.leading(&g);
        let mut guess = guess;
        for iterations in 1..=MAX_PASSES {
            guess = g.dot(&self.near(&g, leading + guess)) - leading;
            if let Some((turn, correction)) = self.solve(h, p, guess) {
                let cayley = turn.u / turn.w;
                return Ok((RelativeRotation { cayley, iterations }, correction));
            }
        }
        self.solve_in(Chart::Cayley, inertia, h, p, guess)
    }

    /// The same by Newton's method in a chart.
    pub(crate) fn solve_in(
        &self,
        chart: Chart,
        inertia: &Inertia,
        h: f64,
        p: &Vector3<f64>,
        guess: f64,
    ) -> Result<(RelativeRotation, f64), Unsolvable> {
        let g = (h * self.scale) * p;
        let leading = self.moments.leading(&g);
        let found = chart.solve(inertia, &(h * p), Some(&self.near(&g, leading + guess)))?;
        Ok((found, g.dot(&found.cayley) - leading))
    }

    /// The Cayley vector for a value of s.
    fn near(&self, g: &Vector3<f64>, s: f64) -> Vector3<f64> {
        let Quaternion { w, u } = self.moments.solution(g, g.norm_squared(), s);
        u / w
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bodies() -> impl Iterator<Item = Inertia> {
        let turned = lgvi_lie::exp(&Vector3::new(0.3, 0.5, -0.2));
        let moments = [
            [1.0, 1.0, 1.0],
            [1.0, 2.0, 3.0],
            [1e-3, 0.7, 0.7],
            [2.0, 1.5, 0.8],
        ];
        moments.into_iter().flat_map(move |moments| {
            let j = Matrix3::from_diagonal(&Vector3::from(moments));
            [j, turned * j * turned.transpose()].map(|j| Inertia::new(j).unwrap())
        })
    }

    /// For a guess of s.
    fn found(inertia: &Inertia, p: &Vector3<f64>, s: f64) -> Option<Vector3<f64>> {
        fn solve(direct: Direct<impl Moments>, p: &Vector3<f64>, s: f64) -> Option<Vector3<f64>> {
            let correction = s - direct.moments.leading(&(0.01 * direct.scale * p));
            let (turn, _) = direct.solve(0.01, p, correction)?;
            Some(turn.u / turn.w)
        }
        match Direct::principal(inertia) {
            Some(direct) => solve(direct, p, s),
            None => solve(Direct::general(inertia), p, s),
        }
    }

    /// Given the right s it is what Newton's method finds, and with s wrong by more than rounding it is not found at once
    /// but later.
    #[test]
    fn a_good_guess_is_solved_at_once_and_a_bad_one_not() {
        let mut rng = fastrand::Rng::with_seed(9);
        let mut solved = 0;
        for inertia in bodies() {
            for _ in 0..300 {
                let rate = Vector3::from_fn(|_, _| 10.0 * (2.0 * rng.f64() - 1.0));
                let p = inertia.matrix() * rate;
                let newton = Chart::Cayley
                    .solve(&inertia, &(0.01 * p), None)
                    .unwrap()
                    .cayley;
                let s = 0.01 * inertia.shape.trace.recip() * p.dot(&newton);
                // Relative to what the equation tells apart: J may be ill-conditioned, and more so near the limit.
                let miss =
                    |f: &Vector3<f64>| (inertia.matrix() * (f - newton)).norm() / (0.01 * p).norm();
                let direct = Direct::general(&inertia);
                if s < 0.9 * direct.limit {
                    solved += 1;
                    assert!(miss(&found(&inertia, &p, s).unwrap()) < 1e-14);
                    assert_eq!(found(&inertia, &p, s + 1e-12), None);
                }
                assert_eq!(found(&inertia, &p, f64::NAN), None);
                for guess in [0.0, 1.1 * s, 0.3] {
                    let (relative, _) = direct.solve_on(&inertia, 0.01, &p, guess).unwrap();
                    let bound = if s < 0.9 * direct.limit { 1e-13 } else { 1e-12 };
                    assert!(miss(&relative.cayley) < bound, "{guess} for {s}");
                }
            }
        }
        assert!(
            solved > 1200,
            "half of the sweep must be below the limit, {solved} was"
        );
    }

    #[test]
    fn what_is_past_the_limit_of_solvability_is_not_found_at_once() {
        for inertia in bodies() {
            for n in 0..2000 {
                let p = inertia.matrix() * Vector3::new(0.0, 0.0, 101.0);
                assert_eq!(found(&inertia, &p, 1e-3 * f64::from(n)), None);
            }
        }
    }
}
