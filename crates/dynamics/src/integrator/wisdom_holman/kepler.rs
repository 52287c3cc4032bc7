//! Kepler's motion for any time, in universal variables: no case of the ellipse, the parabola and the hyperbola.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use super::stumpff::{Stumpff, near};
use crate::StepError;

/// Most iterations for the universal anomaly.
const MOST: u32 = 200;

/// Iterations after which the bracket is halved every other time.
const PATIENT: u32 = 20;

/// From a point so near to the end that `|η u/r|`, `|ζ u²/r|` and `|β| u²` with `u = t/r` are below this, what remains
/// is found by the series of the universal anomaly in time and one correction.
const NEAR: f64 = 0.01;

/// Why Kepler's motion could not be followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Obstacle {
    /// The state at the end is not finite: it is a collision, or leaves the range of numbers.
    NotFinite,
    /// The universal anomaly was not found; the relative error of its time is left.
    NotConverged(f64),
}

impl Obstacle {
    /// The error of this body.
    pub(super) fn on(self, body: usize) -> StepError {
        match self {
            Self::NotFinite => StepError::NotFinite { body },
            Self::NotConverged(residual) => StepError::NotConverged {
                iterations: MOST,
                residual,
                tolerance: f64::EPSILON,
            },
        }
    }
}

/// The change of relative position and velocity over the time `t` of either sign in the field `−μ r/|r|³`, μ > 0.
///
/// With `r₀ = |r|`, `η = r·v`, `β = 2μ/r₀ − v²`, `ζ = μ − β r₀` and the functions of [`Stumpff`], the universal anomaly
/// X solves `t = r₀ X + η G₂ + ζ G₃`, where `dt/dX = r₀ + η G₁ + ζ G₂` is the distance, and the motion is
/// `r ← r + (f − 1) r + g v`, `v ← v + ḟ r + (ġ − 1) v`, `f − 1 = −μ G₂/r₀`, `g = r₀ G₁ + η G₂`, `ḟ = −μ G₁/(r₀ r)`,
/// `ġ − 1 = −μ G₂/r` (K. Stumpff, *Himmelsmechanik I*, 1959; H. Rein, D. Tamayo, MNRAS 452 (2015) 376–388). The time is
/// a monotonic function of X, so that a bracket guards the iteration of Laguerre and Conway (B. A. Conway, Celest.
/// Mech. 39 (1986) 199–211).
#[inline]
pub(super) fn advance(
    mu: f64,
    r: &Vector3<f64>,
    v: &Vector3<f64>,
    t: f64,
) -> Result<[Vector3<f64>; 2], Obstacle> {
    let r0 = r.norm();
    let eta = r.dot(v);
    let by_r0 = 1.0 / r0;
    let beta = 2.0 * mu * by_r0 - v.norm_squared();
    let t = within_a_period(mu, beta, t);
    // The motion backward is the motion forward of the reversed velocity.
    let (sign, t) = if t < 0.0 { (-1.0, -t) } else { (1.0, t) };
    let orbit = Orbit {
        mu,
        r0,
        by_r0,
        eta: sign * eta,
        beta,
        zeta: mu - beta * r0,
    };
    let [g1, g2] = orbit.solve(t)?;
    let distance = r0 + orbit.eta * g1 + orbit.zeta * g2;
    let by_distance = 1.0 / distance;
    let pull = -mu * g2;
    let g = sign * (r0 * g1 + orbit.eta * g2);
    let f_dot = sign * -mu * g1 * by_r0 * by_distance;
    let moved = (pull * by_r0) * r + g * v;
    let turned = f_dot * r + (pull * by_distance) * v;
    let zero = 0.0 * (moved.sum() + turned.sum() + t);
    if zero == 0.0 && distance > 0.0 && r0 > 0.0 {
        Ok([moved, turned])
    } else {
        Err(Obstacle::NotFinite)
    }
}

/// The time without whole periods, at most half a period of either sign.
#[inline]
fn within_a_period(mu: f64, beta: f64, t: f64) -> f64 {
    // The mean anomaly passed is β^{3/2} t/μ.
    let [passed, half] = [beta * t, PI * mu];
    if beta * (passed * passed) > half * half {
        reduced(mu, beta, t)
    } else {
        t
    }
}

#[cold]
fn reduced(mu: f64, beta: f64, t: f64) -> f64 {
    let period = TAU * mu / (beta * beta.sqrt());
    let periods = (t / period).round_ties_even();
    // One rounding instead of two: the product is as great as the time.
    libm::fma(-periods, period, t)
}

/// The constants of an orbit, seen forward in time.
struct Orbit {
    mu: f64,
    r0: f64,
    by_r0: f64,
    eta: f64,
    beta: f64,
    zeta: f64,
}

impl Orbit {
    /// `G₁` and `G₂` at the universal anomaly of the time t ≥ 0, at most half a period.
    ///
    /// At any X the motion starts anew: with the distance `r = r₀ + η G₁ + ζ G₂`, with `dr/dX = η G₀ + ζ G₁` for η and
    /// with `d²r/dX² = ζ G₀ − β η G₁` for ζ. Where little time remains, it is followed from there by an anomaly δ, and
    /// the sum `X + δ` is never rounded.
    #[inline]
    fn solve(&self, t: f64) -> Result<[f64; 2], Obstacle> {
        let &Self {
            r0,
            eta,
            beta,
            zeta,
            ..
        } = self;
        let [mut low, mut high] = [0.0, f64::INFINITY];
        let mut x = self.guess(t);
        let mut left = f64::NAN;
        for iteration in 0..MOST {
            let Stumpff([g0, g1, g2, g3]) = Stumpff::at(beta, x);
            left = t - (r0 * x + eta * g2 + zeta * g3);
            let distance = r0 + eta * g1 + zeta * g2;
            let slope = eta * g0 + zeta * g1;
            let bend = zeta * g0 - beta * eta * g1;
            let by_distance = 1.0 / distance;
            let u = left * by_distance;
            let (a, b) = (slope * u * by_distance, bend * u * u * by_distance);
            let z = beta * u * u;
            if a.abs() < NEAR && b.abs() < NEAR && z.abs() < NEAR {
                let delta = u * series(a, b, z);
                let [_, d1, d2, d3] = near(beta, delta);
                let missed = left - (distance * delta + slope * d2 + bend * d3);
                let delta = delta + missed / (distance + slope * d1 + bend * d2);
                let [d0, d1, d2, _] = near(beta, delta);
                return Ok([g1 * d0 + g0 * d1, g2 + g1 * d1 + g0 * d2]);
            }
            // A time that is not a number is beyond the range of numbers, and too great.
            if left >= 0.0 {
                low = x;
            } else {
                high = x;
            }
            if high.is_finite() && high - low <= f64::EPSILON * high {
                return Ok([g1, g2]);
            }
            let root = (16.0 * distance * distance + 20.0 * left * slope).abs();
            x += 5.0 * left / (distance + root.sqrt());
            // A comparison that is false for NaN, too.
            let inside = low < x && x < high;
            if !inside || (iteration > PATIENT && iteration % 2 == 0) {
                x = if high.is_finite() {
                    0.5 * (low + high)
                } else {
                    2.0 * low.max(t / r0)
                };
            }
        }
        Err(if left.is_finite() {
            Obstacle::NotConverged((left / t).abs())
        } else {
            Obstacle::NotFinite
        })
    }

    /// The universal anomaly as a series in time where it converges fast, else of the mean motion or of the asymptote.
    #[inline]
    fn guess(&self, t: f64) -> f64 {
        let u = t * self.by_r0;
        let a = self.eta * u * self.by_r0;
        let b = self.zeta * u * u * self.by_r0;
        if a.abs() < 0.5 && b.abs() < 1.0 {
            u * series(a, b, self.beta * u * u)
        } else {
            self.far(t)
        }
    }

    #[cold]
    fn far(&self, t: f64) -> f64 {
        let mean = self.beta * t / self.mu;
        if self.beta > 0.0 {
            return mean;
        }
        // t ≈ (η w + ζ) exp(w X)/(2 w³) with w² = −β.
        let w = (-self.beta).sqrt();
        let grown = 2.0 * w * w * w * t / (self.eta * w + self.zeta);
        let asymptote = libm::log(grown) / w;
        if asymptote > 0.0 && asymptote.is_finite() {
            asymptote
        } else {
            // The parabola that falls from here, X³ μ/6.
            libm::cbrt(6.0 * t / self.mu)
        }
    }
}

/// `X/u` for a short time `t = r u`, to third order: with `a = η u/r`, `b = ζ u²/r`, `z = β u²` the derivatives of X
/// are those of `dX/dt = 1/r`, where `dη/dt = ζ/r` and `dζ/dt = −β η/r`.
#[inline(always)]
fn series(a: f64, b: f64, z: f64) -> f64 {
    let square = a * a;
    1.0 - 0.5 * a
        + (0.5 * square - b * (1.0 / 6.0))
        + a * (z + 10.0 * b - 15.0 * square) * (1.0 / 24.0)
}

#[cfg(test)]
mod references;
#[cfg(test)]
mod tests;
