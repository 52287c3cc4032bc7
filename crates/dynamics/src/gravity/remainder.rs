use std::ops::Add;

use super::Level;

/// Bounds on what is left out of an interaction, by the distance of the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remainder {
    /// Sum of the radii about the two origins within which all mass is.
    pub(super) reach: f64,
    /// On the body, and on the other; none on what is not moved by it.
    pub(super) sides: [Option<Side>; 2],
}

/// What one of the two feels of the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Side {
    /// `GM` of the other.
    pub(super) strength: f64,
    /// Sum of the absolute eigenvalues of `GH` of the other, whose second harmonic is `−e·GHe/r⁵`, where it is given as a series.
    pub(super) harmonic: f64,
    /// The same of its own, per mass and without G.
    pub(super) own_harmonic: f64,
    /// Mean squares of the distance of mass from the origin, of its own and of the other.
    pub(super) own: f64,
    pub(super) other: f64,
    /// `ℓ = Σ m |J⁻¹ S(ρ)| |ρ|`, or `‖H‖ |J⁻¹|` of a series.
    pub(super) leverage: f64,
    /// `δ`, the sum of the distances of both centers of mass from the origins, and `m |J⁻¹|` times its own.
    pub(super) offset: f64,
    pub(super) arm: f64,
}

/// What is left out of the acceleration of a body (length per time squared), and of its angular acceleration (rad per time
/// squared).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Neglect {
    /// `|Δa|` at most.
    pub acceleration: f64,
    /// `|J⁻¹ ΔM|` at most.
    pub angular_acceleration: f64,
}

impl Remainder {
    /// Whether the body, and the other, are moved by it.
    pub fn moves(&self) -> [bool; 2] {
        self.sides.map(|side| side.is_some())
    }

    /// What a level leaves out at most of the motion of the body, and of the other, at this distance of their origins:
    /// infinite where their masses may meet. Derived in `docs/skipping.md`.
    ///
    /// With `d` the distance less the sum `s` of both reaches, `k²`, `k'²` the mean squares of the distance of mass from its
    /// origin, own and the other's, and `Λ`, `Λ'` the sums of the absolute eigenvalues of the second harmonics of what is given
    /// as a series, and `ℓ = Σ m |J⁻¹ S(ρ)| |ρ|` what turns the body:
    ///
    /// | Left out | of the acceleration | of the angular acceleration |
    /// | --- | --- | --- |
    /// | all | `GM'/d²` and the next row | the next row |
    /// | all but the monopole | `3 GM' (k² + k'²)/d⁴ + 20 GΛ' k²/d⁶` | `ℓ (2 GM'/d³ + 8 GΛ'/d⁵)` |
    /// | what is beyond second order | `4 GM' s (k² + k'²)/d⁵ + 20 (GΛ' k² + GM' (Λ/m) k'²)/d⁶` | `ℓ (6 GM' s/d⁴ + (8 GΛ' + 42 GM' k'²)/d⁵)`, the last where Λ is not 0 |
    ///
    /// Where the centers of mass are off the origins by rounding, `δ` in sum, `δ₁` its own, both rows below the first have
    /// `(2 GM' + 8 GΛ'/d²) δ/d³` and `m |J⁻¹| δ₁ (GM' + 2 GΛ'/d²)/d²` more.
    pub fn neglect(&self, level: Level, distance: f64) -> [Neglect; 2] {
        let d = distance - self.reach;
        self.sides.map(|side| match (side, level) {
            (None, _) | (_, Level::Full) => Neglect::default(),
            (Some(_), _) if d <= 0.0 => Neglect {
                acceleration: f64::INFINITY,
                angular_acceleration: f64::INFINITY,
            },
            (Some(side), Level::Quadrupole) => {
                side.beyond_second_order(self.reach, d) + side.off_center(d)
            }
            (Some(side), level) => {
                side.beyond_monopole(level == Level::Dropped, d) + side.off_center(d)
            }
        })
    }
}

impl Add for Neglect {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            acceleration: self.acceleration + other.acceleration,
            angular_acceleration: self.angular_acceleration + other.angular_acceleration,
        }
    }
}

impl Side {
    fn beyond_monopole(&self, dropped: bool, d: f64) -> Neglect {
        let by_d2 = 1.0 / (d * d);
        let monopole = if dropped { self.strength * by_d2 } else { 0.0 };
        let second = 3.0 * self.strength * (self.own + self.other);
        let higher = 20.0 * self.harmonic * self.own * by_d2;
        let moment = 2.0 * self.strength + 8.0 * self.harmonic * by_d2;
        Neglect {
            acceleration: monopole + (second + higher) * by_d2 * by_d2,
            angular_acceleration: self.leverage * moment * by_d2 / d,
        }
    }

    fn off_center(&self, d: f64) -> Neglect {
        let by_d2 = 1.0 / (d * d);
        let gradient = 2.0 * self.strength + 8.0 * self.harmonic * by_d2;
        let force = self.strength + 2.0 * self.harmonic * by_d2;
        Neglect {
            acceleration: self.offset * gradient * by_d2 / d,
            angular_acceleration: self.arm * force * by_d2,
        }
    }

    fn beyond_second_order(&self, reach: f64, d: f64) -> Neglect {
        let by_d = 1.0 / d;
        let by_d4 = by_d * by_d * by_d * by_d;
        let third = 4.0 * self.strength * reach * (self.own + self.other);
        let harmonics = self.harmonic * self.own + self.strength * self.own_harmonic * self.other;
        let series = if self.own_harmonic > 0.0 {
            42.0 * self.strength * self.other
        } else {
            0.0
        };
        let moment = 6.0 * self.strength * reach + (8.0 * self.harmonic + series) * by_d;
        Neglect {
            acceleration: (third + 20.0 * harmonics * by_d) * by_d4 * by_d,
            angular_acceleration: self.leverage * moment * by_d4,
        }
    }
}
