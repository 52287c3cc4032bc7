use lgvi_lie::symmetric_eigen;
use nalgebra::{Matrix3, Vector3};

use super::harmonic::{Fourth, Harmonic, Second, Third};
use super::{Attractor, Central, Falloff, Form, Moments, Monopole, SourceShape};
use crate::Inertia;

/// The gravity of a body, expanded about its center of mass in moments of its mass ("inertia integrals"), to second or
/// fourth order in size over distance.
///
/// `φ = −Σ_n P_n(d)/r^{2n+1}` with harmonic polynomials, `P_0 = m`, `P_2 = ½ (tr[J] r² − 3 d·Jd)` (D. J.
/// Scheeres, *Orbital Motion in Strongly Perturbed Environments*, 2012, ch. 2).
///
/// Its strength is a mass if the gravitational constant is given separately, as by [`Mutual`](super::Mutual), and a
/// gravitational parameter `GM` if it attracts on its own.
///
/// # Assumptions and limitations
/// The origin is the center of mass. The truncation error relative to the monopole is of order `(ρ/r)³` at second order
/// and `(ρ/r)⁵` at fourth order, where ρ is the body's size. The series need not converge inside the smallest sphere
/// that contains the body.
#[derive(Clone, Debug, PartialEq)]
pub struct Multipole {
    central: Central,
    asphericity: Asphericity,
}

impl Multipole {
    /// The second-order multipole of a mass and inertia: `∫ρρᵀ dm = J_d`.
    pub fn of_inertia(mass: f64, inertia: &Inertia) -> Self {
        Self::of_second_moments(mass, inertia.nonstandard())
    }

    /// The second-order multipole of a mass and `∫ρρᵀ dm`.
    pub(crate) fn of_second_moments(mass: f64, second: &Matrix3<f64>) -> Self {
        Self {
            central: Central { gm: mass },
            asphericity: Asphericity {
                second: Second::of(second),
                higher: None,
            },
        }
    }

    /// The fourth-order multipole of a mass and its moments about the center of mass.
    pub fn of_moments(mass: f64, moments: &Moments) -> Self {
        Self {
            central: Central { gm: mass },
            asphericity: Asphericity {
                second: Second::of(&moments.second),
                higher: Some(Box::new((Third::of(moments), Fourth::of(moments)))),
            },
        }
    }

    /// The multipole of an oblate planet with its pole along the third axis: `φ = −GM/r [1 − J₂ (a/r)² (3 sin²ϕ −
    /// 1)/2]`, where a is the reference radius of J₂ and ϕ the latitude.
    pub fn oblate(gm: f64, j2: f64, radius: f64) -> Self {
        let half = 0.5 * gm * j2 * radius * radius;
        let diagonal = Vector3::new(half, half, -2.0 * half);
        Self {
            central: Central { gm },
            asphericity: Asphericity {
                second: Second(Matrix3::from_diagonal(&diagonal)),
                higher: None,
            },
        }
    }

    /// Returns this multipole with its strength multiplied by `factor`. The gravitational constant as factor converts a
    /// mass to `GM`.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            central: Central {
                gm: factor * self.central.gm,
            },
            asphericity: self.asphericity.scaled(factor),
        }
    }

    /// Mass or gravitational parameter.
    pub fn strength(&self) -> f64 {
        self.central.gm
    }

    /// The order, 2 or 4.
    pub fn order(&self) -> u32 {
        if self.asphericity.higher.is_some() {
            4
        } else {
            2
        }
    }

    /// The matrix H of `−e·He/r⁵`, or `None` if the multipole has higher terms.
    pub(crate) fn second_harmonic(&self) -> Option<&Matrix3<f64>> {
        (self.order() == 2).then_some(&self.asphericity.second.0)
    }

    /// The symmetric trace-free tensors of degree 2, and of degrees 3 and 4, if any, for evaluation side by side.
    pub(crate) fn tensors(&self) -> (&Matrix3<f64>, Option<HigherTensors<'_>>) {
        let Asphericity { second, higher } = &self.asphericity;
        let higher = higher.as_deref();
        (
            &second.0,
            higher.map(|(third, fourth)| (third.tensor(), fourth.tensor())),
        )
    }

    /// All terms except the monopole.
    pub(super) fn asphericity(&self) -> &Asphericity {
        &self.asphericity
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.central.gm.is_finite() && self.asphericity.is_finite()
    }
}

/// `H[i][(j, k)]` of degree 3, and `H[ij][(k, l)]` of degree 4 for the pairs `xx, yy, zz, xy, xz, yz`.
pub(crate) type HigherTensors<'a> = (&'a [Matrix3<f64>; 3], &'a [Matrix3<f64>; 6]);

/// The terms of a multipole beyond its monopole.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Asphericity {
    pub(super) second: Second,
    higher: Option<Box<(Third, Fourth)>>,
}

impl Asphericity {
    fn scaled(&self, factor: f64) -> Self {
        let higher = self.higher.as_deref();
        Self {
            second: Second(factor * self.second.0),
            higher: higher
                .map(|(third, fourth)| Box::new((third.scaled(factor), fourth.scaled(factor)))),
        }
    }

    fn is_finite(&self) -> bool {
        let higher = self.higher.as_deref();
        self.second.0.iter().all(|c| c.is_finite())
            && higher.is_none_or(|(third, fourth)| third.is_finite() && fourth.is_finite())
    }

    #[inline]
    pub(super) fn potential(&self, d: &Vector3<f64>) -> f64 {
        let mut sum = self.second.potential(d);
        if let Some((third, fourth)) = self.higher.as_deref() {
            sum += third.potential(d) + fourth.potential(d);
        }
        sum
    }

    #[inline]
    pub(super) fn acceleration(&self, d: &Vector3<f64>) -> Vector3<f64> {
        let mut sum = self.second.acceleration(d);
        if let Some((third, fourth)) = self.higher.as_deref() {
            sum += third.acceleration(d) + fourth.acceleration(d);
        }
        sum
    }

    #[inline]
    pub(super) fn gradient(&self, d: &Vector3<f64>) -> Matrix3<f64> {
        let mut sum = self.second.gradient(d);
        if let Some((third, fourth)) = self.higher.as_deref() {
            sum += third.gradient(d) + fourth.gradient(d);
        }
        sum
    }

    #[inline]
    pub(super) fn curvature(&self, d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        let mut sum = self.second.curvature(d, b);
        if let Some((third, fourth)) = self.higher.as_deref() {
            sum += third.curvature(d, b) + fourth.curvature(d, b);
        }
        sum
    }
}

impl Attractor for Multipole {
    fn form(&self) -> Option<Form> {
        (self.order() == 2).then_some(Form::Attractor {
            shape: SourceShape::Quadrupole {
                gm: self.central.gm,
                second: self.asphericity.second.0,
            },
            placement: None,
        })
    }

    #[inline]
    fn potential(&self, d: &Vector3<f64>) -> f64 {
        self.central.potential(d) + self.asphericity.potential(d)
    }

    #[inline]
    fn acceleration(&self, d: &Vector3<f64>) -> Vector3<f64> {
        self.central.acceleration(d) + self.asphericity.acceleration(d)
    }

    #[inline]
    fn gradient(&self, d: &Vector3<f64>) -> Matrix3<f64> {
        self.central.gradient(d) + self.asphericity.gradient(d)
    }

    #[inline]
    fn curvature(&self, d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        self.central.curvature(d, b) + self.asphericity.curvature(d, b)
    }

    #[inline]
    fn monopole(&self) -> Option<Monopole> {
        self.central.monopole()
    }

    fn falloff(&self) -> Option<Falloff> {
        Some(Falloff {
            strength: self.central.gm.abs(),
            harmonic: symmetric_eigen(self.second_harmonic()?)?
                .eigenvalues
                .abs()
                .sum(),
        })
    }
}
