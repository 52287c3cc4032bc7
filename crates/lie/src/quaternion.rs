//! Rotations as quaternions of any nonzero length. Products and rotations need no square roots or transcendental
//! functions.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::hat;

/// The rotation by `2 atan2(|u|, w)` about `u`, as a quaternion `(w, u)` of any nonzero length.
///
/// The rotation depends only on the direction of `(w, u)`, so errors in the length are harmless. A product of thousands
/// of quaternions may overflow or underflow; a product of a few does not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion {
    /// Scalar part.
    pub w: f64,
    /// Vector part.
    pub u: Vector3<f64>,
}

/// `cos x` and `sin x / x` as functions of `x²`. Uses series up to x = 1/2, where the first omitted terms are below
/// rounding.
#[inline]
pub fn cos_sinc(squared: f64) -> (f64, f64) {
    if squared > 0.25 {
        // The square root of a rounded square recovers the original number, so no accuracy is lost.
        let angle = squared.sqrt();
        let (sin, cos) = libm::sincos(angle);
        return (cos, sin / angle);
    }
    let q = squared;
    let (q2, q4) = (q * q, (q * q) * (q * q));
    let cos = 1.0
        + q * ((-1.0 / 2.0 + q * (1.0 / 24.0))
            + q2 * (-1.0 / 720.0 + q * (1.0 / 40_320.0))
            + q4 * ((-1.0 / 3_628_800.0 + q * (1.0 / 479_001_600.0))
                + q2 * (-1.0 / 87_178_291_200.0)));
    let sinc = 1.0
        + q * ((-1.0 / 6.0 + q * (1.0 / 120.0))
            + q2 * (-1.0 / 5_040.0 + q * (1.0 / 362_880.0))
            + q4 * (-1.0 / 39_916_800.0 + q * (1.0 / 6_227_020_800.0)));
    (cos, sinc)
}

/// `cos x` and `sin x / x` for two values of `x²` at once. Uses shorter series if both x are at most 1/8.
#[inline(always)]
pub fn cos_sinc_pair(squared: Vector2<f64>) -> (Vector2<f64>, Vector2<f64>) {
    let q = squared;
    if !((q.x <= SHORT_SQUARED) & (q.y <= SHORT_SQUARED)) {
        let [(c, s), (d, t)] = [q.x, q.y].map(cos_sinc);
        return (Vector2::new(c, d), Vector2::new(s, t));
    }
    let constant = Vector2::repeat;
    let q2 = q.component_mul(&q);
    let even = |a, b| constant(a) + b * q;
    let cos = constant(1.0)
        + q.component_mul(
            &(even(-1.0 / 2.0, 1.0 / 24.0)
                + q2.component_mul(
                    &(even(-1.0 / 720.0, 1.0 / 40_320.0) + q2 * (-1.0 / 3_628_800.0)),
                )),
        );
    let sinc = constant(1.0)
        + q.component_mul(
            &(even(-1.0 / 6.0, 1.0 / 120.0)
                + q2.component_mul(&even(-1.0 / 5_040.0, 1.0 / 362_880.0))),
        );
    (cos, sinc)
}

/// Largest `x²` for the short series of [`cos_sinc_pair`]. The first omitted terms are below 3e-17 there.
const SHORT_SQUARED: f64 = 1.0 / 64.0;

impl Quaternion {
    /// The identity rotation.
    pub const IDENTITY: Self = Self {
        w: 1.0,
        u: Vector3::new(0.0, 0.0, 0.0),
    };

    /// The quaternion `(1, f)` of `cay(f)`.
    #[inline(always)]
    pub fn from_cayley(f: &Vector3<f64>) -> Self {
        Self { w: 1.0, u: *f }
    }

    /// The quaternion of `exp(v)`, the rotation by `|v|` about `v`: `(cos ½|v|, sin ½|v| v/|v|)`.
    #[inline(always)]
    pub fn from_rotation_vector(v: &Vector3<f64>) -> Self {
        let (cos, sinc) = cos_sinc(0.25 * v.norm_squared());
        Self {
            w: cos,
            u: (0.5 * sinc) * v,
        }
    }

    /// The product with a rotation about a coordinate axis, given the cosine and sine of half its angle. The axis
    /// rotation is applied first, then `self`.
    #[inline(always)]
    pub fn product_about<const AXIS: usize>(&self, cos: f64, sin: f64) -> Self {
        let (i, j, k) = (AXIS, (AXIS + 1) % 3, (AXIS + 2) % 3);
        let (w, u) = (self.w, &self.u);
        let mut product = Vector3::zeros();
        product[i] = w * sin + cos * u[i];
        product[j] = cos * u[j] + sin * u[k];
        product[k] = cos * u[k] - sin * u[j];
        Self {
            w: w * cos - sin * u[i],
            u: product,
        }
    }

    /// The quaternion of the matrix product: `other` is applied first, then `self`.
    #[inline(always)]
    pub fn product(&self, other: &Self) -> Self {
        Self {
            w: self.w * other.w - self.u.dot(&other.u),
            u: self.w * other.u + other.w * self.u + self.u.cross(&other.u),
        }
    }

    /// `2/(w² + |u|²)`, the common factor of all formulas.
    #[inline(always)]
    fn factor(&self) -> f64 {
        2.0 / (self.w * self.w + self.u.norm_squared())
    }

    /// The matrix `F = I + s (w S(u) + S(u)²)`, `s = 2/(w² + |u|²)`.
    #[inline(always)]
    pub fn matrix(&self) -> Matrix3<f64> {
        let s = hat(&self.u);
        Matrix3::identity() + self.factor() * (self.w * s + s * s)
    }

    /// `Fᵀ p`. Keeps `|p|` up to unbiased rounding.
    #[inline(always)]
    pub fn rotate_back(&self, p: &Vector3<f64>) -> Vector3<f64> {
        let pu = p.cross(&self.u);
        p + self.factor() * (self.w * pu + pu.cross(&self.u))
    }

    /// `R F`, orthogonal to rounding after any number of compositions.
    ///
    /// Two rows of R are rotated by adding their increments. Their orthogonality error is then removed to first order,
    /// and the third row is their cross product. So orthogonality errors do not accumulate.
    #[inline(always)]
    pub fn compose(&self, r: &Matrix3<f64>) -> Matrix3<f64> {
        compose_by(self.factor(), &self.change(), r)
    }

    /// Like [`compose`](Self::compose), but without a division. The quaternion must have length 1 to rounding; the
    /// orthogonality correction of R also removes the effect of the length error.
    #[inline(always)]
    pub fn compose_unit(&self, r: &Matrix3<f64>) -> Matrix3<f64> {
        compose_by(2.0, &self.change(), r)
    }

    /// Both `R F` and `Fᵀ p`.
    #[inline(always)]
    pub fn carry(&self, r: &Matrix3<f64>, p: &Vector3<f64>) -> (Matrix3<f64>, Vector3<f64>) {
        let factor = self.factor();
        let change = self.change();
        // Fᵀ p equals the row vector pᵀ times F.
        let row = change.map(|[a, b, c]| a * p.x + b * p.y + c * p.z);
        let turned = p + factor * Vector3::from(row);
        (compose_by(factor, &change, r), turned)
    }

    /// The columns of `(F − I)/s = w S(u) + S(u)²`. They do not depend on s, so they need not wait for its division.
    #[inline(always)]
    fn change(&self) -> [[f64; 3]; 3] {
        let (w, u) = (self.w, &self.u);
        let (wx, wy, wz) = (w * u.x, w * u.y, w * u.z);
        let (xx, yy, zz) = (u.x * u.x, u.y * u.y, u.z * u.z);
        let (xy, yz, zx) = (u.x * u.y, u.y * u.z, u.z * u.x);
        [
            [-(yy + zz), xy + wz, zx - wy],
            [xy - wz, -(zz + xx), yz + wx],
            [zx + wy, yz - wx, -(xx + yy)],
        ]
    }
}

/// `R (I + s C)` for the columns of C, with orthogonality errors removed to first order.
#[inline(always)]
fn compose_by(factor: f64, change: &[[f64; 3]; 3], r: &Matrix3<f64>) -> Matrix3<f64> {
    // Each column holds the entries of the first two rows.
    let column = |j: usize| Vector2::new(r[(0, j)], r[(1, j)]);
    let (a, b, c) = (column(0), column(1), column(2));
    let changed = |[i, j, k]: [f64; 3]| factor * (a * i + b * j + c * k);
    let [x, y, z] = change.map(changed);
    let (x, y, z) = (a + x, b + y, c + z);
    let lengths = x.component_mul(&x) + y.component_mul(&y) + z.component_mul(&z);
    let skew = 0.5 * (x.x * x.y + y.x * y.y + z.x * z.y);
    let scale = Vector2::new(1.5 - 0.5 * lengths.x, 1.5 - 0.5 * lengths.y);
    let relieved = |v: Vector2<f64>| v.component_mul(&scale) - skew * v.yx();
    let (x, y, z) = (relieved(x), relieved(y), relieved(z));
    let third = [
        y.x * z.y - z.x * y.y,
        z.x * x.y - x.x * z.y,
        x.x * y.y - y.x * x.y,
    ];
    Matrix3::new(x.x, y.x, z.x, x.y, y.y, z.y, third[0], third[1], third[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cay, exp, orthogonality_error};

    fn random(rng: &mut fastrand::Rng, scale: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0))
    }

    #[test]
    fn both_charts_give_their_rotations() {
        let mut rng = fastrand::Rng::with_seed(11);
        for scale in [0.0, 1e-200, 1e-9, 0.1, 0.57, 0.59, 1.0, 3.0, 50.0] {
            for _ in 0..100 {
                let v = random(&mut rng, scale);
                let turned = Quaternion::from_rotation_vector(&v).matrix();
                assert!((turned - exp(&v)).norm() < 2e-15, "{v}");
                assert!((Quaternion::from_cayley(&v).matrix() - cay(&v)).norm() < 2e-15);
            }
        }
    }

    /// The series and `libm` agree to rounding on both sides of the switch between them.
    #[test]
    fn small_angles_are_accurate() {
        for n in 0..=2000 {
            let x = 0.55 * f64::from(n) / 2000.0;
            let (cos, sinc) = cos_sinc(x * x);
            assert!((cos - libm::cos(x)).abs() < 2.3e-16, "{x}");
            assert!((x * sinc - libm::sin(x)).abs() <= 2.3e-16 * x, "{x}");
        }
    }

    /// Pairs of angles are accurate on both sides of the switch between the short and the long series.
    #[test]
    fn pairs_of_angles_are_accurate() {
        for n in 0..=2000 {
            let (x, y) = (0.15 * f64::from(n) / 2000.0, 0.07);
            let (cos, sinc) = cos_sinc_pair(Vector2::new(x * x, y * y));
            for (x, cos, sinc) in [(x, cos.x, sinc.x), (y, cos.y, sinc.y)] {
                assert!((cos - libm::cos(x)).abs() < 2.3e-16, "{x}");
                assert!((x * sinc - libm::sin(x)).abs() <= 2.3e-16 * x, "{x}");
            }
        }
    }

    #[test]
    fn products_about_coordinate_axes_are_products() {
        let mut rng = fastrand::Rng::with_seed(14);
        for _ in 0..100 {
            let a = Quaternion::from_rotation_vector(&random(&mut rng, 2.0));
            let (sin, cos) = libm::sincos(6.0 * rng.f64());
            let products = [
                a.product_about::<0>(cos, sin),
                a.product_about::<1>(cos, sin),
                a.product_about::<2>(cos, sin),
            ];
            for (axis, product) in products.into_iter().enumerate() {
                let u = Vector3::ith(axis, sin);
                let expected = a.product(&Quaternion { w: cos, u });
                assert!((product.w - expected.w).abs() + (product.u - expected.u).norm() < 1e-15);
            }
        }
    }

    #[test]
    fn products_are_products_of_matrices_and_length_does_not_matter() {
        let mut rng = fastrand::Rng::with_seed(12);
        for _ in 0..100 {
            let [a, b] = [(); 2].map(|()| Quaternion {
                w: 2.0 * rng.f64() - 1.0,
                u: random(&mut rng, 1.0),
            });
            let product = a.product(&b).matrix();
            assert!((product - a.matrix() * b.matrix()).norm() < 4e-15);
            let longer = Quaternion {
                w: 7e80 * a.w,
                u: 7e80 * a.u,
            };
            assert!((longer.matrix() - a.matrix()).norm() < 2e-15);
            let p = random(&mut rng, 5.0);
            let back = a.matrix().transpose() * p;
            assert!((longer.rotate_back(&p) - back).norm() < 1e-14);
        }
    }

    #[test]
    fn composition_multiplies_and_stays_orthogonal() {
        let mut rng = fastrand::Rng::with_seed(13);
        let mut r = Matrix3::identity();
        for _ in 0..100_000 {
            let f = Quaternion::from_rotation_vector(&random(&mut rng, 2.0));
            let product = r * f.matrix();
            r = f.compose(&r);
            assert!((r - product).norm() < 4e-15);
        }
        assert!(orthogonality_error(&r) < 2e-15);
    }
}
