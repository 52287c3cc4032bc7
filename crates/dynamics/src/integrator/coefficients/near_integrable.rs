//! Splittings of near-integrable systems.
#![expect(clippy::excessive_precision, reason = "the digits of the sources")]

use super::{Scheme, mirrored};

/// Alternating kicks and drifts, `b₀, a₀, b₁, …`, for a Hamiltonian `A + εB` where the drift is the exact flow of A and
/// the kick that of εB.
///
/// A step of generalized order (n₁, n₂, n₃) errs by `O(ε h^(n₁+1) + ε² h^(n₂+1) + ε³ h^(n₃+1))`, where the last number
/// holds for all higher powers of ε. Its conditions are those for words of the letters A and B with one, two, three or
/// more B up to these lengths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NearIntegrable {
    pub(super) half: &'static [f64],
}

impl NearIntegrable {
    /// The complete step.
    pub(crate) fn scheme(&self) -> Scheme {
        Scheme::alternating(&mirrored(self.half))
    }
}

/// The leapfrog, generalized order (2, 2): J. Wisdom, M. Holman, *Symplectic maps for the n-body problem*, Astron. J.
/// 102 (1991) 1528–1538. Begins and ends with a kick.
pub(crate) static LEAPFROG: NearIntegrable = NearIntegrable { half: &[0.5, 1.0] };

/// Generalized order (8, 2), 4 kicks: R. I. McLachlan, *Composition methods in the presence of small parameters*, BIT
/// 35 (1995) 258–268; SABA₄ of J. Laskar, P. Robutel, *High order symplectic integrators for perturbed Hamiltonian
/// systems*, Celest. Mech. Dyn. Astron. 80 (2001) 39–62. Kicks are at the nodes of Gauss with his weights.
pub(crate) static ABA_82: NearIntegrable = NearIntegrable {
    half: &[
        0.0,
        0.06943184420297371238802676,
        0.1739274225687269286865320,
        0.2605776340045981552106404,
        0.3260725774312730713134680,
        0.3399810435848562648026658,
    ],
};

/// Generalized order (8, 6, 4), 7 kicks: S. Blanes, F. Casas, A. Farrés, J. Laskar, J. Makazaga, A. Murua, *New
/// families of symplectic splitting methods for numerical integration in dynamical astronomy*, Appl. Numer. Math. 68
/// (2013) 58–72, arXiv:1208.0689.
pub(crate) static ABA_864: NearIntegrable = NearIntegrable {
    half: &[
        0.0,
        0.0711334264982231177779387300061549964174,
        0.183083687472197221961703757166430291072,
        0.241153427956640098736487795326289649618,
        0.310782859898574869507522291054262796375,
        0.521411761772814789212136078067994229991,
        -0.0265646185119588006972121379164987592663,
        -0.333698616227678005726562603400438876027,
        0.0653961422823734184559721793911134363710,
    ],
};

/// Generalized order (10, 6, 4), 8 kicks: Blanes et al. (2013), as [`ABA_864`].
pub(crate) static ABA_1064: NearIntegrable = NearIntegrable {
    half: &[
        0.0,
        0.03809449742241219545697532230863756534060,
        0.09585888083707521061077150377145884776921,
        0.1452987161169137492940200726606637497442,
        0.2044461531429987806805077839164344779763,
        0.2076276957255412507162056113249882065158,
        0.2170703479789911017143385924306336714532,
        0.4359097036515261592231548624010651844006,
        -0.01737538195906509300561788011852699719871,
        -0.6538612258327867093807117373907094120024,
    ],
};
