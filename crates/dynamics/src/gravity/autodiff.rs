use nalgebra::{Matrix3, Vector3};
use num_dual::{Dual64, DualNum, HyperDual, HyperDual64};

use super::{Attractor, Monopole};

/// A scalar potential per unit mass, written once for ordinary and dual numbers.
///
/// [`AutoDiff`] makes it an [`Attractor`].
pub trait Potential: Send + Sync {
    /// `φ(d)`, the potential energy of a point of unit mass at `d`, in the attractor's frame.
    fn potential<D: DualNum<f64>>(&self, d: &[D; 3]) -> D;

    /// The attractor as a monopole at large distance, or `None` if it has no position.
    fn monopole(&self) -> Option<Monopole> {
        None
    }
}

/// An attractor whose acceleration and its derivatives are computed from its [`Potential`] by automatic
/// differentiation, exact to rounding.
///
/// ```
/// use lgvi_dynamics::gravity::{Attractor, AutoDiff, Potential};
/// use lgvi_dynamics::nalgebra::Vector3;
/// use num_dual::DualNum;
///
/// /// A Plummer sphere, `φ = −GM/√(r² + a²)`.
/// struct Plummer {
///     gm: f64,
///     a: f64,
/// }
///
/// impl Potential for Plummer {
///     fn potential<D: DualNum<f64>>(&self, [x, y, z]: &[D; 3]) -> D {
///         let squared = x.powi(2) + y.powi(2) + z.powi(2) + self.a * self.a;
///         -squared.sqrt().recip() * self.gm
///     }
/// }
///
/// let attractor = AutoDiff(Plummer { gm: 1.0, a: 0.0 });
/// let acceleration = attractor.acceleration(&Vector3::new(2.0, 0.0, 0.0));
/// assert!((acceleration + Vector3::new(0.25, 0.0, 0.0)).norm() < 1e-16);
/// ```
///
/// # Assumptions and limitations
/// An acceleration takes three evaluations of the potential, and each derivative takes six.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoDiff<P>(pub P);

/// A symmetric matrix from its entries in and above the diagonal.
fn symmetric(entry: impl Fn(usize, usize) -> f64) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| entry(i.min(j), i.max(j)))
}

impl<P: Potential> Attractor for AutoDiff<P> {
    fn potential(&self, d: &Vector3<f64>) -> f64 {
        self.0.potential(&[d.x, d.y, d.z])
    }

    fn acceleration(&self, d: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| {
            let seed = |k| Dual64::new(d[k], f64::from(u8::from(k == i)));
            -self.0.potential(&[seed(0), seed(1), seed(2)]).eps
        })
    }

    fn gradient(&self, d: &Vector3<f64>) -> Matrix3<f64> {
        symmetric(|i, j| {
            let unit = |k, at| f64::from(u8::from(k == at));
            let seed = |k| HyperDual64::new(d[k], unit(k, i), unit(k, j), 0.0);
            -self.0.potential(&[seed(0), seed(1), seed(2)]).eps1eps2
        })
    }

    fn curvature(&self, d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        symmetric(|i, j| {
            let unit = |k, at| Dual64::from(f64::from(u8::from(k == at)));
            let along = |k| Dual64::new(d[k], b[k]);
            let seed = |k| HyperDual::new(along(k), unit(k, i), unit(k, j), Dual64::from(0.0));
            let value: HyperDual<Dual64, f64> = self.0.potential(&[seed(0), seed(1), seed(2)]);
            -value.eps1eps2.eps
        })
    }

    fn monopole(&self) -> Option<Monopole> {
        self.0.monopole()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gravity::Central;

    struct Point;

    impl Potential for Point {
        fn potential<D: DualNum<f64>>(&self, [x, y, z]: &[D; 3]) -> D {
            -(x.powi(2) + y.powi(2) + z.powi(2)).sqrt().recip() * 1.5
        }
    }

    #[test]
    fn derivatives_of_a_point_are_those_written_by_hand() {
        let mut rng = fastrand::Rng::with_seed(5);
        let mut random = || Vector3::from_fn(|_, _| 4.0 * rng.f64() - 2.0);
        let (automatic, central) = (AutoDiff(Point), Central { gm: 1.5 });
        for _ in 0..1000 {
            let (d, b) = (random(), random());
            let scale = 1e-14 * central.gm / d.norm();
            let by = 1.0 / d.norm();
            assert!((automatic.potential(&d) - central.potential(&d)).abs() < scale);
            let difference = automatic.acceleration(&d) - central.acceleration(&d);
            assert!(difference.amax() < 2.0 * scale * by);
            let difference = automatic.gradient(&d) - central.gradient(&d);
            assert!(difference.amax() < 10.0 * scale * by * by);
            let difference = automatic.curvature(&d, &b) - central.curvature(&d, &b);
            assert!(difference.amax() < 100.0 * scale * by * by * by * b.norm());
        }
    }
}
