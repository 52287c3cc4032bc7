//! The free rotation of a body with three different moments.
//!
//! # Body axes
//!
//! With reciprocal moments a, b, c of the axes 1, 2, 3, `κ = a − c`, `p = (a − b)/κ`, `p′ = (b − c)/κ = 1 − p`, Euler's
//! equations are `Π̇₁ = −p′κ Π₂Π₃`, `Π̇₂ = κ Π₃Π₁`, `Π̇₃ = −pκ Π₁Π₂`. Axis 2 belongs to the middle moment. Axis 3,
//! the *pole*, is the extreme axis for which `p ≤ ½`: the axis of symmetry if the body is nearly symmetric.
//!
//! # Momentum
//!
//! `A₁² = Π₁² + p′Π₂²` and `A₃² = Π₃² + pΠ₂²` are constant. Π circulates about axis 3 if `p′Π₃² ≥ pΠ₁²`, else about
//! axis 1 (E. T. Whittaker, *Analytical Dynamics*, §69). [`Polhode`] describes the motion along that curve as a
//! function of `u = κ √r A t`.
//!
//! # Attitude
//!
//! Given unit vectors `a = Π(0)/L` and `b = Π(t)/L`, the condition `F b = a` leaves one angle undetermined. Euler
//! angles with the pole as body axis and Π as space axis have the precession `ψ̇ = L (1/J₁ − κ p Π₂²/(Π₁² + Π₂²))`. By
//! the addition theorem of the integral of the third kind (P. F. Byrd and M. D. Friedman, *Handbook of Elliptic
//! Integrals*, 116)
//!
//! `ψ = θ − χ`, `θ = L t/J₁ − ν L/(√r A) T(u)`, `T(u) = ∫₀ᵘ sn²/(1 + ν sn²) du′`, `ν = p/p′` or `A₃²/A₁²`,
//!
//! where θ depends only on the time and not on the initial phase, and χ is algebraic:
//!
//! `χ = arg(1 + ν − ν cn cn₀ cn_t + i ν L/(√r A) sn sn₀ sn_t)`.
//!
//! The choice of the pole implies `0 ≤ ν ≤ 1`. So no angle is singular and no sum cancels, including the neighborhoods
//! of symmetry, of the axes and of the separatrix. (For a formulation with theta functions in place of T see R. van Zon
//! and J. Schofield, *Numerical implementation of the exact dynamics of free rigid bodies*, J. Comput. Phys. 225 (2007)
//! 145–164.)
//!
//! F is then the least rotation that takes b to a, followed by the rotation about a by `θ − χ − ε`. Here `tan ½ε =
//! (a₃ + b₃)/(1 + a₃b₃ + ρ_aρ_b) tan ½(φ_b − φ_a)`, with polar coordinates ρ and φ about the pole, relates the least
//! rotation to the longitudes. All angles except θ are represented by complex numbers, whose half angles need only
//! square roots.

use lgvi_lie::{Quaternion, cos_sinc};
use nalgebra::{Complex, Matrix3, Vector3};

use super::attitude::{half_chi, half_epsilon, least_then_about};
use super::polhode::{Polhode, Ratio};

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Asymmetric {
    /// Principal axes as columns, in body axes.
    pub(super) axes: Matrix3<f64>,
    /// `(1/J₁, 1/J₂, 1/J₃)`.
    pub(super) reciprocal: Vector3<f64>,
    /// `κ`.
    pub(super) rate: f64,
    /// `p`.
    pub(super) near: Ratio,
    /// `p′`.
    pub(super) far: Ratio,
}

impl Asymmetric {
    /// Creates the flow for moments in ascending order and a right-handed triad of their axes.
    pub(super) fn new(moments: [f64; 3], axes: Matrix3<f64>) -> Self {
        let ratio =
            |[first, middle, pole]: [f64; 3]| (middle - first) / (pole - first) * (pole / middle);
        let [least, middle, greatest] = moments;
        let reversed = [greatest, middle, least];
        let (mut order, mut axes) = (moments, axes);
        if ratio(moments) > ratio(reversed) {
            let column = |i: usize| axes.column(i).into_owned();
            axes = Matrix3::from_columns(&[column(2), -column(1), column(0)]);
            order = reversed;
        }
        let [first, _, pole] = order;
        let from_other_end = [pole, middle, first];
        Self {
            axes,
            reciprocal: Vector3::from(order).map(f64::recip),
            rate: (pole - first) / pole / first,
            near: Ratio::new(ratio(order)),
            far: Ratio::new(ratio(from_other_end)),
        }
    }

    #[inline]
    pub(super) fn flow(&self, pi: &Vector3<f64>, t: f64) -> (Quaternion, Vector3<f64>) {
        let magnitude = magnitude(pi);
        if magnitude == 0.0 {
            return (Quaternion::IDENTITY, *pi);
        }
        let a = self.axes.tr_mul(&(pi / magnitude));
        let Some(polhode) = Polhode::through(&a, self.near, self.far) else {
            let angular_velocity = magnitude * a.component_mul(&self.reciprocal);
            let turn = self.axes * (angular_velocity * t);
            return (Quaternion::from_rotation_vector(&turn), *pi);
        };
        let phase = polhode.phase(magnitude * self.rate * polhode.rate(), t);
        let theta = magnitude * self.reciprocal.x * t - polhode.nu / polhode.rate() * phase.third;

        let mut change = polhode.change(&phase.functions);
        let mut half_turns = phase.half_turns;
        let half_chi = half_chi(
            &polhode,
            (&self.near, &self.far),
            &a,
            &change,
            &phase.functions,
        );
        if let Some(turned) = polhode.turned(&a, &(a + change)) {
            change = turned - a;
            half_turns += 1.0;
        }
        let half_epsilon = half_epsilon(polhode.first_squared, &a, &change);
        let (cos, sinc) = cos_sinc(0.25 * theta * theta);
        let half_theta = Complex::new(cos, 0.5 * theta * sinc);
        let half_angle = half_theta * (half_chi * half_epsilon).conj();

        if half_turns % 2.0 == 0.0 {
            let relative = least_then_about(half_angle, &a, &change);
            return (
                self.in_body(&relative),
                pi + self.axes * (magnitude * change),
            );
        }
        // A half turn about axis 1 reverses the pole, which shifts the precession by a half turn.
        let (major, half_angle) = if polhode.round_pole {
            (Vector3::z(), half_angle)
        } else {
            (Vector3::x(), Complex::new(half_angle.im, -half_angle.re))
        };
        let half_turn = Quaternion { w: 0.0, u: major };
        let relative = least_then_about(half_angle, &a, &change).product(&half_turn);
        let b = half_turn.rotate_back(&(a + change));
        (self.in_body(&relative), self.axes * (magnitude * b))
    }

    #[inline]
    fn in_body(&self, relative: &Quaternion) -> Quaternion {
        Quaternion {
            w: relative.w,
            u: self.axes * relative.u,
        }
    }
}

/// `|v|` without overflow or underflow.
#[inline]
fn magnitude(v: &Vector3<f64>) -> f64 {
    let squared = v.norm_squared();
    if (1e-280..1e280).contains(&squared) {
        return squared.sqrt();
    }
    let scale = v.amax();
    if scale == 0.0 {
        0.0
    } else {
        scale * (v / scale).norm()
    }
}
