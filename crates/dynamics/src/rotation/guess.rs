use nalgebra::Vector3;

use super::branch::Sufficient;
use super::cayley::{General, Moments, Principal, residual};
use super::{Chart, RelativeRotation, Unsolvable};
use crate::Inertia;

/// Corrections of a guess after which [`Chart::solve`] goes on.
const MAX_CORRECTIONS: u32 = 5;

/// Solves one body's implicit equation again and again in the Cayley chart, each time from a good guess.
///
/// As the guess is good, corrections by an approximate derivative do, and one is the rule. A solution is taken if it
/// satisfies the equation to rounding and if what suffices for the branch holds; else [`Chart::solve`] goes on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FromGuess<M> {
    moments: M,
    sufficient: Sufficient,
    /// `1 / tr J`
    scale: f64,
}

impl FromGuess<Principal> {
    /// For an inertia whose axes are principal axes.
    pub(crate) fn principal(inertia: &Inertia) -> Option<Self> {
        Principal::of(inertia).map(|moments| Self::of(inertia, moments))
    }
}

impl FromGuess<General> {
    /// For any inertia.
    pub(crate) fn general(inertia: &Inertia) -> Self {
        Self::of(inertia, General::of(inertia))
    }
}

impl<M: Moments> FromGuess<M> {
    fn of(inertia: &Inertia, moments: M) -> Self {
        Self {
            moments,
            sufficient: Sufficient::of(inertia),
            scale: inertia.shape.trace.recip(),
        }
    }

    /// The solution of `F J_d − J_d Fᵀ = S(h p)` as a Cayley vector if one correction of `guess` finds it.
    #[inline(always)]
    pub(crate) fn at_once(
        &self,
        h: f64,
        p: &Vector3<f64>,
        guess: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let g = (h * self.scale) * p;
        let (left, _) = residual(&self.moments, &g, guess);
        let f = guess + self.moments.correction(guess, &left);
        let (_, solved) = residual(&self.moments, &g, &f);
        (solved & self.sufficient.holds(&g, &f)).then_some(f)
    }

    /// The same with as many corrections as it takes.
    pub(crate) fn solve(
        &self,
        inertia: &Inertia,
        h: f64,
        p: &Vector3<f64>,
        mut f: Vector3<f64>,
    ) -> Result<RelativeRotation, Unsolvable> {
        let g = (h * self.scale) * p;
        for iterations in 0..=MAX_CORRECTIONS {
            let (left, solved) = residual(&self.moments, &g, &f);
            if solved && self.sufficient.holds(&g, &f) {
                return Ok(RelativeRotation {
                    cayley: f,
                    iterations,
                });
            }
            f += self.moments.correction(&f, &left);
        }
        let found = Chart::Cayley.solve(inertia, &(h * p), Some(&f))?;
        Ok(RelativeRotation {
            iterations: found.iterations + MAX_CORRECTIONS,
            ..found
        })
    }
}
