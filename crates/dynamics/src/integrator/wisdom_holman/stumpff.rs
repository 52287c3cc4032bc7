//! The functions `Gₙ = Xⁿ cₙ(β X²)` of Stumpff, the solutions of Kepler's problem in universal variables.

/// Largest `|β X²|` for which the series are summed directly.
const DIRECT: f64 = 1.0;

/// Below this the hyperbolic functions are taken: no digits cancel, and none are lost by doubling.
const FAR: f64 = -16.0;

/// `1/(2k+2)!` and `1/(2k+3)!` for k = 0 … 8. The next term is below `2⁻⁵³` of the first for arguments up to
/// [`DIRECT`].
const SECOND: [f64; 9] = [
    1.0 / 2.0,
    1.0 / 24.0,
    1.0 / 720.0,
    1.0 / 40_320.0,
    1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
    1.0 / 87_178_291_200.0,
    1.0 / 20_922_789_888_000.0,
    1.0 / 6_402_373_705_728_000.0,
];
const THIRD: [f64; 9] = [
    1.0 / 6.0,
    1.0 / 120.0,
    1.0 / 5_040.0,
    1.0 / 362_880.0,
    1.0 / 39_916_800.0,
    1.0 / 6_227_020_800.0,
    1.0 / 1_307_674_368_000.0,
    1.0 / 355_687_428_096_000.0,
    1.0 / 121_645_100_408_832_000.0,
];

/// `G₀ … G₃` at some X: `G₀ = 1 − β G₂`, `G₁ = X − β G₃`, and `Gₙ' = Gₙ₋₁`.
///
/// For β > 0 they are `cos s`, `sin s/√β`, `(1 − cos s)/β`, `(s − sin s)/β^{3/2}` with `s = √β X`, for β < 0 the
/// hyperbolic counterparts, and for β = 0 `Xⁿ/n!`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stumpff(pub(super) [f64; 4]);

impl Stumpff {
    /// The functions at X.
    #[inline]
    pub(super) fn at(beta: f64, x: f64) -> Self {
        let z = beta * x * x;
        let c = if z.abs() <= DIRECT {
            series(z)
        } else if z > FAR {
            quartered(z)
        } else {
            hyperbolic(z)
        };
        let square = x * x;
        Self([c[0], x * c[1], square * c[2], square * x * c[3]])
    }
}

/// `G₀ … G₃` at a δ with `|β| δ² ≤ 0.01`, to rounding.
#[inline]
pub(super) fn near(beta: f64, delta: f64) -> [f64; 4] {
    let square = delta * delta;
    let z = beta * square;
    let c2 = SECOND[0] - z * (SECOND[1] - z * (SECOND[2] - z * (SECOND[3] - z * SECOND[4])));
    let c3 = THIRD[0] - z * (THIRD[1] - z * (THIRD[2] - z * (THIRD[3] - z * THIRD[4])));
    let (g2, g3) = (square * c2, square * delta * c3);
    [1.0 - beta * g2, delta - beta * g3, g2, g3]
}

/// `c₀ … c₃` of a small argument.
///
/// The first terms of `c₁` and `c₂` are quotients. A factor 1/6 or 1/24 would be wrong by the same rounding each time, and
/// energy and angular momentum would drift with the number of steps.
#[inline]
fn series(z: f64) -> [f64; 4] {
    let square = z * z;
    // Terms in pairs, which do not wait for each other.
    let pair = |terms: &[f64; 9], k: usize| terms[k] - z * terms[k + 1];
    let beyond = |terms: &[f64; 9]| {
        let high = pair(terms, 6) + square * terms[8];
        pair(terms, 2) + square * (pair(terms, 4) + square * high)
    };
    let [second, third] = [&SECOND, &THIRD].map(beyond);
    let c1 = 1.0 - (z / 6.0 - square * (THIRD[1] - z * third));
    let c2 = 0.5 - (z / 24.0 - square * second);
    let c3 = THIRD[0] - (z * THIRD[1] - square * third);
    [1.0 - z * c2, c1, c2, c3]
}

/// `c₀ … c₃` from those of a quarter of the argument, as often as needed: the formulas for twice the angle.
#[cold]
fn quartered(z: f64) -> [f64; 4] {
    // 4⁵¹² exceeds the range of f64, and z / 4ᵏ is exact.
    let (mut quarter, mut times) = (z, 0);
    while quarter.abs() > DIRECT && times < 512 {
        quarter *= 0.25;
        times += 1;
    }
    let mut c = series(quarter);
    for _ in 0..times {
        let [c0, c1, c2, c3] = c;
        c = [
            2.0 * c0 * c0 - 1.0,
            c0 * c1,
            0.5 * c1 * c1,
            0.25 * (c2 + c0 * c3),
        ];
    }
    c
}

/// `c₀ … c₃` of an argument far below 0.
#[cold]
fn hyperbolic(z: f64) -> [f64; 4] {
    let s = (-z).sqrt();
    let (cosh, sinh) = (libm::cosh(s), libm::sinh(s));
    let square = s * s;
    [
        cosh,
        sinh / s,
        (cosh - 1.0) / square,
        (sinh - s) / (square * s),
    ]
}
