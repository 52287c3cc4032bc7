//! Cosines and sines in lanes, as `cos_sinc` and `cos_sinc_pair` of [`lgvi_lie`].

use crate::lane::Lane;

/// Largest `x²` for the series of [`cos_sinc`], and for the shorter ones of a pair.
const SERIES: f64 = 0.25;
const SHORT_SERIES: f64 = 1.0 / 64.0;

/// `cos x` and `sin x / x` as functions of `x²`, in `lanes`.
#[inline(always)]
pub(super) fn cos_sinc<T: Lane>(squared: T, lanes: u32) -> (T, T) {
    let q = squared;
    let (q2, q4) = (q * q, (q * q) * (q * q));
    let mut cos = q
        * ((q * (1.0 / 24.0) + -1.0 / 2.0)
            + q2 * (q * (1.0 / 40_320.0) + -1.0 / 720.0)
            + q4 * ((q * (1.0 / 479_001_600.0) + -1.0 / 3_628_800.0)
                + q2 * (-1.0 / 87_178_291_200.0)))
        + 1.0;
    let mut sinc = q
        * ((q * (1.0 / 120.0) + -1.0 / 6.0)
            + q2 * (q * (1.0 / 362_880.0) + -1.0 / 5_040.0)
            + q4 * (q * (1.0 / 6_227_020_800.0) + -1.0 / 39_916_800.0))
        + 1.0;
    let large = lanes & q.constant(SERIES).below(q);
    if large != 0 {
        large_angles(squared, large, (&mut cos, &mut sinc));
    }
    (cos, sinc)
}

/// Sets the functions in these lanes, one by one.
#[inline(never)]
fn large_angles<T: Lane>(squared: T, lanes: u32, (cos, sinc): (&mut T, &mut T)) {
    for k in (0..T::COUNT).filter(|k| lanes & (1 << k) != 0) {
        let angle = squared.lane(k).sqrt();
        let (sine, cosine) = libm::sincos(angle);
        cos.set_lane(k, cosine);
        sinc.set_lane(k, sine / angle);
    }
}

/// `cos x` and `sin x / x` for two values of `x²`, in `lanes`.
#[inline(always)]
pub(super) fn cos_sinc_pair<T: Lane>(squared: [T; 2], lanes: u32) -> ([T; 2], [T; 2]) {
    let [p, q] = squared;
    let limit = p.constant(SHORT_SERIES);
    let short = p.at_most(limit) & q.at_most(limit);
    let ((c, s), (d, t)) = (short_cos_sinc(p), short_cos_sinc(q));
    let long = lanes & !short;
    if long == 0 {
        return ([c, d], [s, t]);
    }
    let ((c_long, s_long), (d_long, t_long)) = (cos_sinc(p, long), cos_sinc(q, long));
    (
        [c_long.where_in(long, c), d_long.where_in(long, d)],
        [s_long.where_in(long, s), t_long.where_in(long, t)],
    )
}

#[inline(always)]
fn short_cos_sinc<T: Lane>(q: T) -> (T, T) {
    let q2 = q * q;
    let cos = q
        * ((q * (1.0 / 24.0) + -1.0 / 2.0)
            + q2 * ((q * (1.0 / 40_320.0) + -1.0 / 720.0) + q2 * (-1.0 / 3_628_800.0)))
        + 1.0;
    let sinc = q
        * ((q * (1.0 / 120.0) + -1.0 / 6.0) + q2 * (q * (1.0 / 362_880.0) + -1.0 / 5_040.0))
        + 1.0;
    (cos, sinc)
}
