use std::ops::Add;

use super::Level;

/// Bounds on the omitted part of an interaction, as functions of the distance between the partners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remainder {
    /// Sum of the radii about the two origins that contain all mass.
    pub(super) reach: f64,
    /// Bounds for the body and for the other, or `None` for a partner that the interaction does not move.
    pub(super) sides: [Option<Side>; 2],
}

/// The quantities that bound the effect of the other partner on one partner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Side {
    /// `GM` of the other partner.
    pub(super) strength: f64,
    /// Sum of the absolute eigenvalues of `GH` of the other partner if it is a multipole with the second harmonic
    /// `−e·GHe/r⁵`.
    pub(super) harmonic: f64,
    /// Sum of the absolute eigenvalues of its own `H`, per mass and without G.
    pub(super) own_harmonic: f64,
    /// Mean square distance of the mass from the origin, for itself and for the other.
    pub(super) own: f64,
    pub(super) other: f64,
    /// `ℓ = Σ m |J⁻¹ S(ρ)| |ρ|`, or `‖H‖ |J⁻¹|` for a multipole.
    pub(super) leverage: f64,
    /// `δ`, the sum of the distances of both centers of mass from their origins, and `m |J⁻¹|` times its own distance.
    pub(super) offset: f64,
    pub(super) arm: f64,
}

/// Bounds on the omitted acceleration of a body (length per time squared) and angular acceleration (rad per time
/// squared).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Neglect {
    /// Bound of `|Δa|`.
    pub acceleration: f64,
    /// Bound of `|J⁻¹ ΔM|`.
    pub angular_acceleration: f64,
}

impl Remainder {
    /// Returns true for each partner that the interaction moves: the body and the other.
    pub fn moves(&self) -> [bool; 2] {
        self.sides.map(|side| side.is_some())
    }

    /// Bounds on the omitted accelerations of the body and of the other, for a level and a distance between their
    /// origins. They are infinite if the masses may touch. Derived in `docs/skipping.md`.
    ///
    /// Let `d` be the distance minus the sum `s` of both reaches, `k²` and `k'²` the mean square distances of mass from
    /// its origin (its own and the other's), `Λ` and `Λ'` the sums of the absolute eigenvalues of the second harmonics
    /// of multipoles, and `ℓ = Σ m |J⁻¹ S(ρ)| |ρ|` the leverage for angular acceleration:
    ///
    /// | Omitted part | of the acceleration | of the angular acceleration |
    /// | --- | --- | --- |
    /// | everything | `GM'/d²` and the next row | the next row |
    /// | everything beyond the monopole | `3 GM' (k² + k'²)/d⁴ + 20 GΛ' k²/d⁶` | `ℓ (2 GM'/d³ + 8 GΛ'/d⁵)` |
    /// | everything beyond second order | `4 GM' s (k² + k'²)/d⁵ + 20 (GΛ' k² + GM' (Λ/m) k'²)/d⁶` | `ℓ (6 GM' s/d⁴ + (8 GΛ' + 42 GM' k'²)/d⁵)`, the last term only if Λ is not 0 |
    ///
    /// If rounding displaces the centers of mass from the origins, by `δ` in total and `δ₁` for the body itself, both
    /// rows below the first increase by `(2 GM' + 8 GΛ'/d²) δ/d³` and `m |J⁻¹| δ₁ (GM' + 2 GΛ'/d²)/d²`.
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
