//! Symplectic splittings of Runge–Kutta–Nyström type.
#![expect(clippy::excessive_precision, reason = "25 digits for the record")]

use super::{Scheme, mirrored};

/// Alternating kicks and drifts, `b₀, a₀, b₁, …`, for systems with a kinetic energy quadratic in the momenta and exact
/// free motion as drift.
///
/// The first error is the largest distance from Kepler's ellipse (eccentricity 0.3, semi-major axis 1) over ten
/// revolutions, the second the distance in phase space at time 100 in the Hénon–Heiles potential:
///
/// | thousand force evaluations for an error of | 1e-6 | 1e-8 | 1e-10 | 1e-12 |
/// |---|---|---|---|---|
/// | [`SRKN_6B`] | 4.2, 3.4 | 9.3, 10.6 | 24.9, 33.6 | 81.0, 106 |
/// | SRKN₁₁ᵇ of Blanes & Moan, not included | 4.1, 1.6 | 8.7, 3.4 | 18.8, 7.2 | 40.6, 15.5 |
/// | [`SRKN_14A`] | 3.2, 1.6 | 7.0, 3.5 | 15.1, 7.5 | 32.5, 16.1 |
/// | [`RKN_A19`] | 3.4, 2.2 | 6.1, 3.7 | 10.8, 6.6 | 19.2, 11.7 |
///
/// In other cases (another form of the kinetic energy, kicks and drifts exchanged) the order is 4.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nystrom {
    /// Order of the step.
    pub(crate) order: u32,
    pub(super) half: &'static [f64],
}

impl Nystrom {
    /// The complete step.
    pub(crate) fn scheme(&self) -> Scheme {
        Scheme::alternating(&mirrored(self.half))
    }
}

/// Order 4, 6 force evaluations: SRKN₆ᵇ of S. Blanes, P. C. Moan, *Practical symplectic partitioned Runge–Kutta and
/// Runge–Kutta–Nyström methods*, J. Comput. Appl. Math. 142 (2002) 313–330.
///
/// The paper gives 15 digits. The values here solve the order conditions to 25 digits and differ from the paper's by
/// less than 4e-15. The same holds for the other two tables.
pub(crate) static SRKN_6B: Nystrom = Nystrom {
    order: 4,
    half: &[
        0.08298440641740501883834748,
        0.2452989571842711626039324,
        0.3963098014983680770949115,
        0.6048726657110799749608927,
        -0.03905630492234843517086529,
        -0.3501716228953511375648251,
        0.1195241940131506784752126,
    ],
};

/// Order 6, 14 force evaluations: SRKN₁₄ᵃ of Blanes & Moan, as [`SRKN_6B`]. Begins and ends with a drift. On Kepler's
/// ellipse it is 20 % cheaper than SRKN₁₁ᵇ.
pub(crate) static SRKN_14A: Nystrom = Nystrom {
    order: 6,
    half: &[
        0.0,
        0.03785931984061093297362424,
        0.09171915262446200539347043,
        0.1026356331024365541988679,
        0.1839831700050048999160327,
        -0.0258678882665583310065925,
        -0.05653436583288910432408864,
        0.3142414030714464302874742,
        0.004914688774711886409299824,
        -0.130144459517415118129956,
        0.1437611271683616814692999,
        0.1064177003695413680005485,
        0.3285676937468041402207909,
        -0.00879424312851020650867239,
        -0.1964114664864555090848051,
        0.2073050690568967403694121,
    ],
};

/// Order 8, 19 force evaluations: A₁₉ of S. Blanes, F. Casas, A. Escorihuela-Tomàs, *Runge–Kutta–Nyström symplectic
/// splitting methods of order 8*, arXiv:2202.01541 (2022). Begins and ends with a drift. Of A₁₈, A₁₉, B₁₇ and B₁₉ in
/// that paper, it is the cheapest for a given position error on both orbits.
pub(crate) static RKN_A19: Nystrom = Nystrom {
    order: 8,
    half: &[
        0.0,
        0.0505805,
        0.1294786065605367306624938,
        0.149999,
        0.2222572600926711434230436,
        -0.0551795510771615573511027,
        -0.05775148933251472047570232,
        0.423755898835337951482265,
        -0.0578312262103924910221345,
        -0.2134953535846590480596722,
        0.1030872974371753567479333,
        -0.06807697745740326191116307,
        -0.1408196125540907682055541,
        0.2279170569740134359488872,
        0.02344626034928262766997137,
        -0.23537361938105890652474,
        0.1348545173566840966178822,
        0.387413869179878047816794,
        0.02879738210737793063451722,
        -0.1675408234889466614012682,
        0.2289620083865401878950991,
    ],
};
