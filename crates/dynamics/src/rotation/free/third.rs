//! The elliptic integral of the third kind for the angle about the angular momentum, in Carlson's symmetric form.

use super::elliptic::{Jacobi, Landen};
use crate::lane::Lane;

/// `T(u) = ∫₀ᵘ sn²/(1 + ν sn²) du′ = ⅓ sn³ R_J(cn², dn², 1, 1 + ν sn²)` for |u| ≤ K and `0 ≤ ν ≤ 1` (DLMF 19.25.14).
#[inline]
pub(super) fn incomplete(at: &Jacobi, nu: f64) -> f64 {
    let squared = at.sn * at.sn;
    let integral = r_j(at.cn * at.cn, at.dn * at.dn, 1.0, 1.0 + nu * squared);
    at.sn * squared * integral / 3.0
}

/// `T(K) = K/(2(1 + ν)) ΣQ_n`, from the sequence of means (DLMF 19.8.7).
#[inline]
pub(super) fn complete(landen: &Landen, nu: f64) -> f64 {
    let mut p = (1.0 + nu).sqrt();
    let (mut q, mut sum) = (1.0, 1.0);
    for (a, b) in landen.means() {
        let (squared, product) = (p * p, a * b);
        q *= 0.5 * (squared - product) / (squared + product);
        sum += q;
        if q.abs() < NEGLIGIBLE * sum {
            break;
        }
        p = 0.5 * (p + product / p);
    }
    0.5 * landen.quarter_period() / (1.0 + nu) * sum
}

/// Relative size of a term of the sum that ends it.
pub(super) const NEGLIGIBLE: f64 = 1e-17;

/// Relative spread of the arguments about their mean below which the series is used. Its remainder is about `0.05 ×
/// spread⁸`.
pub(super) const SPREAD: f64 = 0.0125;

/// Carlson's `R_J(x, y, z, p)` for `p ≥ z ≥ y ≥ x ≥ 0`, y > 0, by his duplication theorem and series (B. C.
/// Carlson, *Numerical computation of real or complex elliptic integrals*, Numer. Algorithms 10 (1995) 13–26; DLMF
/// 19.36(i), series 19.36.2).
#[inline]
fn r_j(mut x: f64, mut y: f64, mut z: f64, mut p: f64) -> f64 {
    let mut mean = 0.2 * (x + y + z + 2.0 * p);
    let spread = (mean - x).max(p - mean);
    let delta = (p - x) * (p - y) * (p - z);
    let mut scale = 1.0;
    let mut sum = 0.0;
    while spread * scale > SPREAD * mean {
        let (rx, ry, rz, rp) = (x.sqrt(), y.sqrt(), z.sqrt(), p.sqrt());
        let lambda = rx * ry + ry * rz + rz * rx;
        let d = (rp + rx) * (rp + ry) * (rp + rz);
        sum += scale / d * r_c(scale * scale * scale * delta / (d * d));
        scale *= 0.25;
        mean = 0.25 * (mean + lambda);
        x = 0.25 * (x + lambda);
        y = 0.25 * (y + lambda);
        z = 0.25 * (z + lambda);
        p = 0.25 * (p + lambda);
    }
    let (reciprocal, series) = equal(mean, [x, y, z]);
    6.0 * sum + scale * reciprocal * reciprocal.sqrt() * series
}

/// The reciprocal of `mean`, and `R_J(x, y, z, p) mean^{3/2}` for arguments of this mean that are nearly equal (DLMF
/// 19.36.2).
#[inline(always)]
pub(super) fn equal<T: Lane>(mean: T, [x, y, z]: [T; 3]) -> (T, T) {
    let one = mean.constant(1.0);
    let reciprocal = one / mean;
    let (x, y, z) = (
        one - x * reciprocal,
        one - y * reciprocal,
        one - z * reciprocal,
    );
    let p = (x + y + z) * -0.5;
    let xyz = x * y * z;
    let pp = p * p;
    let e2 = x * y + z * (x + y) - pp * 3.0;
    let e3 = xyz + p * 2.0 * (e2 + pp * 2.0);
    let e4 = (xyz * 2.0 + p * (e2 + pp * 3.0)) * p;
    let e5 = xyz * pp;
    let by_e2 = e2 * (-(e2 * 0.0625) + 9.0 / 88.0)
        + -3.0 / 14.0
        + e3 * (e2 * (45.0 / 272.0) + -9.0 / 52.0)
        + e4 * (3.0 / 20.0)
        - e5 * (9.0 / 68.0);
    let by_e3 = e3 * (3.0 / 40.0) + 1.0 / 6.0 - e4 * (9.0 / 68.0);
    let series = e2 * by_e2 + 1.0 + e3 * by_e3 - e4 * (3.0 / 22.0) + e5 * (3.0 / 26.0);
    (reciprocal, series)
}

/// `R_C(1, 1 + e) = atan √e / √e` for e ≥ 0.
#[inline]
fn r_c(e: f64) -> f64 {
    if e < R_C_SERIES {
        r_c_series(e)
    } else {
        let root = e.sqrt();
        libm::atan(root) / root
    }
}

/// Largest e for [`r_c_series`].
pub(super) const R_C_SERIES: f64 = 0.01;

#[inline(always)]
pub(super) fn r_c_series<T: Lane>(e: T) -> T {
    let last = -(e / 15.0) + 1.0 / 13.0;
    let inner = e * (e * (e * last + -1.0 / 11.0) + 1.0 / 9.0) + -1.0 / 7.0;
    e * (e * (e * inner + 1.0 / 5.0) + -1.0 / 3.0) + 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Computed with mpmath 1.3.0: `m, n = 1 - mpf(m1), mpf(nu)`, `sn = lambda x: ellipfun('sn', x, m=m)`, `quad(lambda
    /// x: sn(x)**2/(1 + n*sn(x)**2), linspace(0, u, 48))` and `elliprj(0, m1, 1, 1 + n)/3`.
    #[test]
    fn incomplete_and_complete_match_mpmath() {
        for (m1, nu, u, at_u, at_quarter) in [
            (1.0, 0.3, 0.7, 0.09631403588482136, 0.643722705604692),
            (0.75, 0.5, 0.2, 0.002609400014656171, 0.6385528036159983),
            (0.75, 1.0, -1.3, -0.3190821779588144, 0.5083035118120298),
            (0.5, 1e-9, 0.05, 4.163543897176864e-5, 1.0068615917297195),
            (1e-3, 1.0, 4.0, 1.6078027013683938, 2.0283118843783674),
            (1e-20, 0.7, 10.0, 5.392521287687903, 13.870253810414646),
            (1e-20, 0.7, -24.0, -13.627815403908558, 13.870253810414646),
        ] {
            let landen = Landen::new(m1);
            let at = if f64::abs(u) <= Jacobi::SMALL {
                Jacobi::small(u, 1.0 - m1)
            } else {
                landen.jacobi(u)
            };
            assert!((incomplete(&at, nu) / at_u - 1.0).abs() < 2e-15, "{m1} {u}");
            assert!(
                (complete(&landen, nu) / at_quarter - 1.0).abs() < 1e-15,
                "{m1}"
            );
        }
    }
}
