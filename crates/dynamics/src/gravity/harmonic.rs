use nalgebra::{Matrix3, Vector3};

use super::Moments;

/// A harmonic homogeneous polynomial `P(e) = H[e, …, e]` of degree n with a symmetric trace-free tensor H, and the
/// exterior potential `φ = −P(e)/r^{2n+1}`, r = |e|, with its derivatives.
///
/// For a body, `∫ |e − ρ|⁻¹ dm = Σ_n P_n(e)/r^{2n+1}`, where H_n is the trace-free part of `∫ ρ … ρ dm` times
/// `(2n − 1)!!/n!`.
pub(super) trait Harmonic {
    /// n.
    const DEGREE: i32;

    /// `H[e, …, e, ·, ·]`, which determines `P = e·He`, `∇P = n He` and `∂²P = n(n − 1) H`.
    fn contraction(&self, e: &Vector3<f64>) -> Matrix3<f64>;

    /// `H[e, …, e, b, ·, ·]`, with one e fewer. Irrelevant for n = 2, where it is zero. The derivative of `∂²P b` is
    /// n(n − 1)(n − 2) times this.
    fn contraction_along(&self, e: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64>;

    #[inline]
    fn potential(&self, e: &Vector3<f64>) -> f64 {
        let p = e.dot(&(self.contraction(e) * e));
        -p * inverse_power(e, Self::DEGREE).0
    }

    /// `a = r^{−k} (∇P − k P e/r²)`, k = 2n + 1.
    #[inline]
    fn acceleration(&self, e: &Vector3<f64>) -> Vector3<f64> {
        let n = f64::from(Self::DEGREE);
        let (by_rk, by_r2) = inverse_power(e, Self::DEGREE);
        let u = self.contraction(e) * e;
        by_rk * (n * u - ((2.0 * n + 1.0) * e.dot(&u) * by_r2) * e)
    }

    /// `G = r^{−k} (∂²P − k (∇P eᵀ + e ∇Pᵀ + P I)/r² + k (k + 2) P e eᵀ/r⁴)`.
    #[inline]
    fn gradient(&self, e: &Vector3<f64>) -> Matrix3<f64> {
        let n = f64::from(Self::DEGREE);
        let k = 2.0 * n + 1.0;
        let (by_rk, by_r2) = inverse_power(e, Self::DEGREE);
        let c = self.contraction(e);
        let u = c * e;
        let p = e.dot(&u);
        let ue: Matrix3<f64> = u * e.transpose();
        let flat = n * (ue + ue.transpose()) + Matrix3::from_diagonal_element(p)
            - ((k + 2.0) * p * by_r2) * e * e.transpose();
        by_rk * ((n * (n - 1.0)) * c - (k * by_r2) * flat)
    }

    /// The derivative of `G b` by the product rule. The terms are named by the power of `1/r²` that multiplies them.
    #[inline]
    fn curvature(&self, e: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        let n = f64::from(Self::DEGREE);
        let k = 2.0 * n + 1.0;
        let (by_rk, by_r2) = inverse_power(e, Self::DEGREE);
        let c = self.contraction(e);
        let slope = n * (c * e);
        let p = e.dot(&slope) / n;
        let hessian = (n * (n - 1.0)) * c;
        let third = (n * (n - 1.0) * (n - 2.0)) * self.contraction_along(e, b);
        let (eb, slope_b, hessian_b) = (e.dot(b), slope.dot(b), hessian * b);
        let once = hessian_b * e.transpose() + slope * b.transpose();
        let once = once + once.transpose() + eb * hessian + Matrix3::from_diagonal_element(slope_b);
        let twice: Matrix3<f64> = (eb * slope + p * b) * e.transpose();
        let ee: Matrix3<f64> = e * e.transpose();
        let twice =
            twice + twice.transpose() + slope_b * ee + Matrix3::from_diagonal_element(p * eb);
        let thrice = (p * eb) * ee;
        let flat = once - ((k + 2.0) * by_r2) * (twice - ((k + 4.0) * by_r2) * thrice);
        by_rk * (third - (k * by_r2) * flat)
    }
}

/// `r^{−(2n + 1)}` and `r⁻²`.
#[inline]
fn inverse_power(e: &Vector3<f64>, n: i32) -> (f64, f64) {
    let squared = e.norm_squared();
    let by_r2 = 1.0 / squared;
    let mut power = by_r2 * squared.sqrt();
    for _ in 0..n {
        power *= by_r2;
    }
    (power, by_r2)
}

/// `½ Q`, where `Q = 3 ∫ρρᵀ − tr` equals `tr[J] I − 3J`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Second(pub(super) Matrix3<f64>);

impl Second {
    /// From the second moments `second[(i, j)] = ∫ ρ_i ρ_j dm`.
    pub(super) fn of(second: &Matrix3<f64>) -> Self {
        Self(1.5 * second - Matrix3::from_diagonal_element(0.5 * second.trace()))
    }
}

impl Harmonic for Second {
    const DEGREE: i32 = 2;

    #[inline]
    fn contraction(&self, _e: &Vector3<f64>) -> Matrix3<f64> {
        self.0
    }

    #[inline]
    fn contraction_along(&self, _e: &Vector3<f64>, _b: &Vector3<f64>) -> Matrix3<f64> {
        Matrix3::zeros()
    }
}

/// `H[i][(j, k)]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Third([Matrix3<f64>; 3]);

impl Third {
    /// `½ [5 T_ijk − (δ_ij t_k + δ_ik t_j + δ_jk t_i)]`, `t_i = T_ijj`.
    pub(super) fn of(moments: &Moments) -> Self {
        let t = Vector3::from(moments.third.map(|m| m.trace()));
        Self(std::array::from_fn(|i| {
            let axis = Vector3::ith(i, 1.0);
            let mixed: Matrix3<f64> = axis * t.transpose();
            let trace = mixed + mixed.transpose() + Matrix3::from_diagonal_element(t[i]);
            0.5 * (5.0 * moments.third[i] - trace)
        }))
    }
}

impl Third {
    pub(super) fn tensor(&self) -> &[Matrix3<f64>; 3] {
        &self.0
    }

    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self(self.0.map(|h| factor * h))
    }

    pub(super) fn is_finite(&self) -> bool {
        self.0.iter().flatten().all(|c| c.is_finite())
    }
}

impl Harmonic for Third {
    const DEGREE: i32 = 3;

    #[inline]
    fn contraction(&self, e: &Vector3<f64>) -> Matrix3<f64> {
        let [x, y, z] = &self.0;
        e.x * x + e.y * y + e.z * z
    }

    #[inline]
    fn contraction_along(&self, _e: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        self.contraction(b)
    }
}

/// `H[ij][(k, l)]` for the six pairs `xx, yy, zz, xy, xz, yz`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fourth([Matrix3<f64>; 6]);

const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

impl Fourth {
    /// `⅛ [35 T_ijkl − 5 (δ_ij t_kl + five more) + (δ_ij δ_kl + two more) t]`, `t_ij = T_ijkk`, `t = t_ii`.
    pub(super) fn of(moments: &Moments) -> Self {
        let t = Matrix3::from_fn(|i, j| moments.fourth[i][j].trace());
        let unit = |a: usize, b: usize| f64::from(u8::from(a == b));
        Self(PAIRS.map(|(i, j)| {
            Matrix3::from_fn(|k, l| {
                let once = unit(i, j) * t[(k, l)]
                    + unit(k, l) * t[(i, j)]
                    + unit(i, k) * t[(j, l)]
                    + unit(j, l) * t[(i, k)]
                    + unit(i, l) * t[(j, k)]
                    + unit(j, k) * t[(i, l)];
                let twice =
                    unit(i, j) * unit(k, l) + unit(i, k) * unit(j, l) + unit(i, l) * unit(j, k);
                (35.0 * moments.fourth[i][j][(k, l)] - 5.0 * once + twice * t.trace()) / 8.0
            })
        }))
    }

    #[inline]
    fn weighted(&self, weights: [f64; 6]) -> Matrix3<f64> {
        let terms = self.0.iter().zip(weights);
        terms.fold(Matrix3::zeros(), |sum, (h, weight)| sum + weight * h)
    }
}

impl Fourth {
    pub(super) fn tensor(&self) -> &[Matrix3<f64>; 6] {
        &self.0
    }

    pub(super) fn scaled(&self, factor: f64) -> Self {
        Self(self.0.map(|h| factor * h))
    }

    pub(super) fn is_finite(&self) -> bool {
        self.0.iter().flatten().all(|c| c.is_finite())
    }
}

impl Harmonic for Fourth {
    const DEGREE: i32 = 4;

    #[inline]
    fn contraction(&self, e: &Vector3<f64>) -> Matrix3<f64> {
        self.contraction_along(e, e)
    }

    #[inline]
    fn contraction_along(&self, e: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        self.weighted(PAIRS.map(|(i, j)| {
            if i == j {
                e[i] * b[i]
            } else {
                e[i] * b[j] + e[j] * b[i]
            }
        }))
    }
}
