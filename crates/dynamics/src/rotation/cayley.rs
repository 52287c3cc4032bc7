//! The implicit equation in Cayley form (2.6), solved for `g`: `w(f) = n g` with `w(f) = J f + f × J f` and
//! `n = ½ (1 + |f|²)`, all relative to `tr J`.

use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::{MAX_ITERATIONS, RelativeRotation, solve_3x3};
use crate::Inertia;

/// Residual, relative to `n |g|`, that is rounding.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// `J / tr J` of a body as the equation needs it.
pub(crate) trait Moments {
    /// `J f + f × J f`.
    fn w(&self, f: &Vector3<f64>) -> Vector3<f64>;

    /// `(J + E)⁻¹ r` to first order in E, where `J + E` is the derivative of w at `f`.
    fn correction(&self, f: &Vector3<f64>, r: &Vector3<f64>) -> Vector3<f64>;
}

/// Moments about principal axes, where `f × J f = (k₁ f₂ f₃, k₂ f₃ f₁, k₃ f₁ f₂)` with `k₁ = J₃ − J₂` and so on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Principal {
    j: Vector3<f64>,
    k: Vector3<f64>,
    /// `1/J`
    inverse: Vector3<f64>,
    /// `k/J`
    ratio: Vector3<f64>,
}

impl Principal {
    /// Of an inertia whose axes are principal axes.
    pub(super) fn of(inertia: &Inertia) -> Option<Self> {
        let j = inertia.unit.diagonal();
        let k = Vector3::new(j.z - j.y, j.x - j.z, j.y - j.x);
        (inertia.unit == Matrix3::from_diagonal(&j)).then(|| Self {
            j,
            k,
            inverse: j.map(f64::recip),
            ratio: k.component_div(&j),
        })
    }
}

impl Moments for Principal {
    #[inline(always)]
    fn w(&self, f: &Vector3<f64>) -> Vector3<f64> {
        let (j, k) = (&self.j, &self.k);
        Vector3::new(
            j.x * f.x + k.x * (f.y * f.z),
            j.y * f.y + k.y * (f.z * f.x),
            j.z * f.z + k.z * (f.x * f.y),
        )
    }

    #[inline(always)]
    fn correction(&self, f: &Vector3<f64>, r: &Vector3<f64>) -> Vector3<f64> {
        let k = &self.ratio;
        let u = Vector3::new(
            self.inverse.x * r.x,
            self.inverse.y * r.y,
            self.inverse.z * r.z,
        );
        Vector3::new(
            u.x - k.x * (f.y * u.z + f.z * u.y),
            u.y - k.y * (f.z * u.x + f.x * u.z),
            u.z - k.z * (f.x * u.y + f.y * u.x),
        )
    }
}

/// Moments about any axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct General {
    j: Matrix3<f64>,
    inverse: Matrix3<f64>,
}

impl General {
    /// Of any inertia.
    pub(super) fn of(inertia: &Inertia) -> Self {
        Self {
            j: inertia.unit,
            inverse: inertia.inverse * inertia.shape.trace,
        }
    }
}

impl Moments for General {
    #[inline(always)]
    fn w(&self, f: &Vector3<f64>) -> Vector3<f64> {
        let jf = self.j * f;
        jf + f.cross(&jf)
    }

    #[inline(always)]
    fn correction(&self, f: &Vector3<f64>, r: &Vector3<f64>) -> Vector3<f64> {
        let u = self.inverse * r;
        u - self.inverse * (f.cross(r) + u.cross(&(self.j * f)))
    }
}

/// `n g − w(f)` and whether that is rounding; not if it is NaN.
#[inline(always)]
pub(super) fn residual(
    j: &impl Moments,
    g: &Vector3<f64>,
    f: &Vector3<f64>,
) -> (Vector3<f64>, bool) {
    let n = 0.5 + 0.5 * f.norm_squared();
    let residual = n * g - j.w(f);
    let rounding = ROUNDING * n;
    let solved = residual.norm_squared() <= (rounding * rounding) * g.norm_squared();
    (residual, solved)
}

/// Newton's method from `f` for `g / tr J`; `None` when it does not converge.
pub(super) fn newton(
    inertia: &Inertia,
    g: &Vector3<f64>,
    mut f: Vector3<f64>,
) -> Option<RelativeRotation> {
    let moments = General::of(inertia);
    let j = &inertia.unit;
    for iterations in 0..=MAX_ITERATIONS {
        let (residual, solved) = residual(&moments, g, &f);
        if solved {
            return Some(RelativeRotation {
                cayley: f,
                iterations,
            });
        }
        let jacobian = j + hat(&f) * j - hat(&(j * f)) - g * f.transpose();
        f += solve_3x3(&jacobian, &residual)?;
    }
    None
}
