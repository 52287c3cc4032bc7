use super::flight::SAMPLES;
use crate::integrator::Rotor;
use crate::rotation::PreprocessedOrder;
use crate::{Method, System};

/// A method whose steps may be of any length: what the race knows of it beforehand.
///
/// Its resolution `n` is such that cost grows as `n` and the error falls as `n^−order`: the number of steps in the run, or
/// for a method that chooses its steps a power of the tolerance that it is given.
#[derive(Clone, Copy, Debug)]
pub(super) struct Family {
    pub(super) kind: Kind,
    pub(super) order: u32,
    /// Evaluations of gravity in a step.
    pub(super) stages: u32,
}

/// How the resolution enters.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// Steps of equal length: the resolution is their number in the run.
    Equal(Method),
    /// The method chooses its steps, given a tolerance: `n^−order`.
    Adaptive(fn(f64) -> Method),
}

/// Radians of the fastest motion in a step, a stage: where the race begins.
const RADIANS: f64 = 0.06;

/// Tolerance of an adaptive method where the race begins.
const COARSE: f64 = 1e-5;

/// The loosest and the tightest that adaptive methods take.
const TOLERANCES: [f64; 2] = [0.1, 1e-15];

impl Family {
    const fn equal(method: Method, order: u32, stages: u32) -> Self {
        Self {
            kind: Kind::Equal(method),
            order,
            stages,
        }
    }

    /// All methods that may suit `system`.
    pub(super) fn all(_system: &System) -> Vec<Self> {
        let rotor = Rotor::default();
        let composition = |order| Method::Composition { order, rotor };
        let nystrom = |order, rotor| Method::Nystrom { order, rotor };
        let preprocessed = Rotor::Preprocessed;
        vec![
            Self::equal(Method::Lgvi(rotor), 2, 1),
            Self::equal(Method::Lgvi(Rotor::Exact), 2, 1),
            Self::equal(composition(4), 4, 5),
            Self::equal(composition(6), 6, 13),
            Self::equal(composition(8), 8, 21),
            Self::equal(composition(10), 10, 35),
            Self::equal(nystrom(4, Rotor::Exact), 4, 6),
            Self::equal(nystrom(6, Rotor::Exact), 6, 14),
            Self::equal(nystrom(8, Rotor::Exact), 8, 20),
            Self::equal(nystrom(4, preprocessed(PreprocessedOrder::Four)), 4, 6),
            Self::equal(nystrom(6, preprocessed(PreprocessedOrder::Six)), 6, 14),
            Self::equal(nystrom(8, preprocessed(PreprocessedOrder::Eight)), 8, 20),
            Self {
                kind: Kind::Adaptive(|tolerance| Method::DormandPrince853 { tolerance }),
                order: 8,
                stages: 12,
            },
        ]
    }

    /// The method that references are flown with.
    pub(super) fn reference() -> Self {
        let rotor = Rotor::Exact;
        Self::equal(Method::Nystrom { order: 8, rotor }, 8, 20)
    }

    /// A coarse resolution for a run through `radians` of the fastest motion.
    pub(super) fn coarse(&self, radians: f64) -> f64 {
        match self.kind {
            Kind::Equal(_) => (radians / (RADIANS * f64::from(self.stages))).max(1.0),
            Kind::Adaptive(_) => libm::pow(COARSE, -f64::from(self.order).recip()),
        }
    }

    /// The method at resolution `n`.
    pub(super) fn method(&self, n: f64) -> Method {
        match self.kind {
            Kind::Equal(method) => method,
            Kind::Adaptive(method) => method(libm::pow(n, -f64::from(self.order))),
        }
    }

    /// A resolution within what the method takes.
    fn allowed(&self, n: f64) -> f64 {
        let [loose, tight] =
            TOLERANCES.map(|tolerance| libm::pow(tolerance, -f64::from(self.order).recip()));
        n.clamp(loose, tight)
    }

    /// The greatest resolution that costs no more than coarser ones, in a run of so many steps and a pilot of a part of it.
    pub(super) fn cheapest(&self, steps: f64, part: f64) -> f64 {
        let (_, coarsest) = self.steps(0.0, part);
        match self.kind {
            Kind::Equal(_) => coarsest.max(steps),
            Kind::Adaptive(_) => coarsest,
        }
    }

    /// Steps in each interval of a pilot that is this part of the run, at a resolution of at least `n`; and that resolution.
    pub(super) fn steps(&self, n: f64, part: f64) -> (u64, f64) {
        match self.kind {
            Kind::Equal(_) => {
                let intervals = SAMPLES as f64;
                let steps = (n * part / intervals - 1e-9).ceil().max(1.0);
                (steps as u64, steps * intervals / part)
            }
            Kind::Adaptive(_) => (1, self.allowed(n)),
        }
    }

    /// Whether there can be as many substeps as `n` needs.
    pub(super) fn is_feasible(&self, n: f64, steps: f64) -> bool {
        match self.kind {
            Kind::Equal(_) => n <= steps * f64::from(u32::MAX),
            Kind::Adaptive(_) => self.allowed(n) == n,
        }
    }

    /// Substeps in each of a run's steps, and the resolution that they make, at least `n`.
    pub(super) fn substeps(&self, n: f64, steps: f64) -> (u32, f64) {
        match self.kind {
            Kind::Equal(_) => {
                let substeps = (n / steps - 1e-9).ceil().clamp(1.0, f64::from(u32::MAX));
                (substeps as u32, substeps * steps)
            }
            Kind::Adaptive(_) => (1, self.allowed(n)),
        }
    }
}
