//! The implicit equation solved without a Newton iteration, for steps that follow each other closely.
//!
//! Were `s = gᵀf` known, the Cayley form `A f = g + g × f` with `A = 2J − s I` would be linear, with the solution that
//! [`super::branch`] states. And s is all but known from the last steps: an error δ of it leaves the residual δ f, and
//! `gᵀf` misses s by δ times about `s/(2J)` only, so that repeating with `gᵀf` converges fast. All is relative to `tr J`.

use nalgebra::{Matrix3, Vector3};

use super::{Chart, RelativeRotation, Unsolvable};
use crate::Inertia;
use crate::inertia::adjugate;

/// Residual, relative to `|g|`, that is rounding.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Repetitions after which [`Chart::solve`] takes over.
const MAX_PASSES: u32 = 4;

/// `J / tr J` of a body as the equation needs it.
pub(crate) trait Moments {
    /// The solution of `(2J − s I) f = g + g × f`, given `|g|²` too.
    fn solution(&self, g: &Vector3<f64>, gamma: f64, s: f64) -> Vector3<f64>;
}

/// Moments about principal axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Principal {
    /// `2J`
    moments: Vector3<f64>,
    /// `2 (J₃ − J₂), 2 (J₁ − J₃), 2 (J₂ − J₁)`
    differences: Vector3<f64>,
}

impl Moments for Principal {
    #[inline(always)]
    fn solution(&self, g: &Vector3<f64>, gamma: f64, s: f64) -> Vector3<f64> {
        let (j, k) = (&self.moments, &self.differences);
        let (a, b, c) = (j.x - s, j.y - s, j.z - s);
        let (bc, ca, ab) = (b * c, c * a, a * b);
        let form = a * (g.x * g.x) + b * (g.y * g.y) + c * (g.z * g.z);
        let reciprocal = 1.0 / (a * bc + form);
        Vector3::new(
            reciprocal * ((bc + gamma) * g.x - k.x * (g.y * g.z)),
            reciprocal * ((ca + gamma) * g.y - k.y * (g.z * g.x)),
            reciprocal * ((ab + gamma) * g.z - k.z * (g.x * g.y)),
        )
    }
}

impl Moments for Matrix3<f64> {
    #[inline(always)]
    fn solution(&self, g: &Vector3<f64>, gamma: f64, s: f64) -> Vector3<f64> {
        let a = 2.0 * self - Self::from_diagonal_element(s);
        let ag = a * g;
        let adjugate = adjugate(&a);
        let determinant = a.column(0).dot(&adjugate.column(0));
        (adjugate * g + gamma * g - g.cross(&ag)) / (determinant + g.dot(&ag))
    }
}

/// One body's implicit equation in the Cayley chart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Direct<M> {
    moments: M,
    /// `d/e`, second coefficient and determinant of `J / tr J`: up to there `p' ≥ 8 (d − e s) + 2γ (1 − 2s)` is positive,
    /// so that a solution lies on the branch, and `A > J` is positive definite.
    limit: f64,
    /// `1 / tr J`
    scale: f64,
}

impl Direct<Principal> {
    /// For an inertia whose axes are principal axes.
    pub(crate) fn principal(inertia: &Inertia) -> Option<Self> {
        let j = 2.0 * inertia.unit.diagonal();
        let moments = Principal {
            moments: j,
            differences: Vector3::new(j.z - j.y, j.x - j.z, j.y - j.x),
        };
        (inertia.unit == Matrix3::from_diagonal(&inertia.unit.diagonal()))
            .then(|| Self::of(inertia, moments))
    }
}

impl Direct<Matrix3<f64>> {
    /// For any inertia.
    pub(crate) fn general(inertia: &Inertia) -> Self {
        Self::of(inertia, inertia.unit)
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

    /// The Cayley vector that solves `F J_d − J_d Fᵀ = S(h p)`, and s, from a guess of s; `None` where s is not found at
    /// once or may not be on the branch.
    #[inline(always)]
    pub(crate) fn solve(
        &self,
        h: f64,
        p: &Vector3<f64>,
        guess: f64,
    ) -> Option<(Vector3<f64>, f64)> {
        let g = (h * self.scale) * p;
        let gamma = g.norm_squared();
        let f = self.moments.solution(&g, gamma, guess);
        let s = g.dot(&f);
        let residual = (s - guess) * (s - guess) * f.norm_squared();
        let solved = residual <= (ROUNDING * ROUNDING) * gamma;
        (solved & (s < self.limit)).then_some((f, s))
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
        let mut s = guess;
        for iterations in 1..=MAX_PASSES {
            s = g.dot(&self.moments.solution(&g, g.norm_squared(), s));
            if let Some((cayley, s)) = self.solve(h, p, s) {
                return Ok((RelativeRotation { cayley, iterations }, s));
            }
        }
        self.solve_in(Chart::Cayley, inertia, h, p, s)
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
        let near = self.moments.solution(&g, g.norm_squared(), guess);
        let found = chart.solve(inertia, &(h * p), Some(&near))?;
        Ok((found, g.dot(&found.cayley)))
    }
}
