//! Symmetric compositions of a symmetric step of second order.
#![expect(clippy::excessive_precision, reason = "25 digits for the record")]

use super::{Scheme, mirrored};

/// Weights `γ₁ … γₛ` of a symmetric composition, a palindrome with sum 1. Successive steps of length `γᵢ h` of a
/// symmetric method of order 2 form a symmetric step of length h of a higher order.
///
/// Of the published tables compared, these took the fewest Störmer–Verlet steps for a given error. The error is the
/// largest distance from Kepler's ellipse (eccentricity 0.3, semi-major axis 1) over ten revolutions. The runner-up is
/// in brackets:
///
/// | thousand force evaluations for an error of | 1e-6 | 1e-8 | 1e-10 | 1e-12 |
/// |---|---|---|---|---|
/// | [`SUZUKI_4`] (McLachlan 1995, 5 stages: 15 % more) | 16.2 | 51.2 | 162 | |
/// | [`SOFRONIOU_SPALETTA_6`] (theirs of 11 stages: 6 %; Kahan & Li 1997, 9 stages: 30 %) | 6.9 | 14.9 | 32.0 | 68.9 |
/// | [`SOFRONIOU_SPALETTA_8`] (Kahan & Li 1997, 17 stages: 8 %) | 5.0 | 9.0 | 15.9 | 28.3 |
/// | [`SOFRONIOU_SPALETTA_10`] (Hairer, Lubich & Wanner 2002, 33 stages: 110 %) | 4.2 | 6.9 | 11.2 | 17.8 |
#[derive(Clone, Copy, Debug)]
pub(crate) struct Composition {
    /// Order of the composed step.
    pub(crate) order: u32,
    pub(super) half: &'static [f64],
}

impl Composition {
    /// `γ₁ … γₛ`.
    pub(crate) fn weights(&self) -> Vec<f64> {
        mirrored(self.half)
    }

    /// The composition of the step `K(h/2) D(h) K(h/2)`.
    pub(crate) fn scheme(&self) -> Scheme {
        Scheme::composed(&self.weights())
    }
}

/// Order 4, 5 stages, `γ₁ = 1/(4 − ∛4)`: M. Suzuki, *Fractal decomposition of exponential operators with applications
/// to many-body theories and Monte Carlo simulations*, Phys. Lett. A 146 (1990) 319–323.
pub(crate) static SUZUKI_4: Composition = Composition {
    order: 4,
    half: &[
        0.4144907717943757371423541,
        0.4144907717943757371423541,
        -0.6579630871775029485694163,
    ],
};

/// Order 6, 13 stages: M. Sofroniou, G. Spaletta, *Derivation of symmetric composition constants for symmetric
/// integrators*, Optim. Methods Softw. 20 (2005) 597–613.
pub(crate) static SOFRONIOU_SPALETTA_6: Composition = Composition {
    order: 6,
    half: &[
        0.1386193085405169524580801,
        0.1334656285107476040704686,
        0.1307053101144922519054276,
        0.1296189375690703477250537,
        -0.3500032489392089651617083,
        0.1180553065300238717027344,
        0.399077515348715874599888,
    ],
};

/// Order 8, 21 stages: Sofroniou & Spaletta, as [`SOFRONIOU_SPALETTA_6`].
pub(crate) static SOFRONIOU_SPALETTA_8: Composition = Composition {
    order: 8,
    half: &[
        0.1064772898455003182393197,
        0.1083740864583572639743341,
        0.3533782105265434241953454,
        -0.2334141402316508219878028,
        -0.2444526679152884126946217,
        0.1131784843575563331470095,
        0.1189290562500035006269297,
        0.1260391232182598814030567,
        0.1258171873617604180439239,
        0.1169913501921764218072288,
        -0.3826359601264366535094467,
    ],
};

/// Order 10, 35 stages: Sofroniou & Spaletta, as [`SOFRONIOU_SPALETTA_6`].
pub(crate) static SOFRONIOU_SPALETTA_10: Composition = Composition {
    order: 10,
    half: &[
        0.07879572252168641926390768,
        0.3130961034151085277648125,
        0.02791838323507806610952027,
        -0.2295928415939070941512134,
        0.1309620610771648631746569,
        -0.2697334056545107143446097,
        0.07497334315589143566613711,
        0.1119934239998102048895751,
        0.3661334495462267511931481,
        -0.3991056301360358978786298,
        0.1030873985274710773158028,
        0.4114308739558902378207041,
        -0.004866360583135261762195659,
        -0.3920333537086399064480819,
        0.0519425029624496470371829,
        0.05066509075992449633587434,
        0.0496743706397298790545688,
        0.04931773575959453791768001,
    ],
};
