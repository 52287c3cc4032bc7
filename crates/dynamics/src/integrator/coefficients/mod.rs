//! Coefficients of splitting methods, each checked against its order conditions.
//!
//! A step of length h is split into kicks `K` (change momenta at fixed configuration) and drifts `D` (free motion).
//! There are three families:
//!
//! - [`Composition`]: weights for *any* symmetric step of second order, whether it is a splitting or not.
//! - [`Nystrom`]: fewer force evaluations for the same error, but `D` must be the exact flow of a kinetic energy
//!   quadratic in the momenta, and kicks must depend only on the configuration. Then `[B, [B, [B, A]]] = 0` (A free
//!   motion, B kicks), and the order conditions that contain this commutator are dropped. A freely rotating rigid body
//!   qualifies (½ Π·J⁻¹Π) if its drift is exact. If the drift itself is a second-order approximation, the order drops
//!   to 2.
//! - [`NearIntegrable`](near_integrable::NearIntegrable): `D` is the exact flow of nearly all of the motion
//!   and `K` that of a small perturbation, in whose powers the conditions are sorted.

mod composition;
#[cfg(test)]
mod convergence;
mod near_integrable;
mod nystrom;
#[cfg(test)]
mod order_conditions;

pub(crate) use composition::{
    Composition, SOFRONIOU_SPALETTA_6, SOFRONIOU_SPALETTA_8, SOFRONIOU_SPALETTA_10, SUZUKI_4,
};
#[cfg(test)]
use near_integrable::NearIntegrable;
pub(crate) use near_integrable::{ABA_82, ABA_864, ABA_1064, LEAPFROG};
pub(crate) use nystrom::{Nystrom, RKN_A19, SRKN_6B, SRKN_14A};

/// Stages of a symmetric step of length h, `K(b₀h) D(a₀h) K(b₁h) … D(aₛ₋₁h) K(bₛh)`.
///
/// The first and the last kick may be 0: a scheme that begins with a drift needs no force there.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Scheme {
    /// `b`, one more than `drifts`.
    pub(crate) kicks: Vec<f64>,
    /// `a`.
    pub(crate) drifts: Vec<f64>,
}

impl Scheme {
    /// Steps `K(γ/2) D(γ) K(γ/2)` in succession for the `weights` γ, with adjacent kicks merged.
    pub(crate) fn composed(weights: &[f64]) -> Self {
        let halves = || weights.iter().map(|weight| weight / 2.0);
        let ends = std::iter::once(0.0);
        let kicks = halves()
            .chain(ends.clone())
            .zip(ends.chain(halves()))
            .map(|(next, last)| last + next)
            .collect();
        Self {
            kicks,
            drifts: weights.to_vec(),
        }
    }

    /// Alternating kicks and drifts, beginning with a kick.
    fn alternating(stages: &[f64]) -> Self {
        Self {
            kicks: stages.iter().copied().step_by(2).collect(),
            drifts: stages.iter().copied().skip(1).step_by(2).collect(),
        }
    }
}

/// The palindrome with the first half `half`, which includes the middle element.
fn mirrored(half: &[f64]) -> Vec<f64> {
    half.iter()
        .chain(half.iter().rev().skip(1))
        .copied()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kicks_that_meet_are_made_one() {
        let scheme = Scheme::composed(&[0.5, -0.25, 0.75]);
        assert_eq!(scheme.kicks, [0.25, 0.125, 0.25, 0.375]);
        assert_eq!(scheme.drifts, [0.5, -0.25, 0.75]);
    }

    #[test]
    fn a_scheme_that_drifts_first_has_kicks_of_zero_at_its_ends() {
        let scheme = Scheme::alternating(&mirrored(&[0.0, 0.5, 1.0]));
        assert_eq!(scheme.kicks, [0.0, 1.0, 0.0]);
        assert_eq!(scheme.drifts, [0.5, 0.5]);
    }
}
