use super::flight::{Plan, SAMPLES};
use super::pilot::REFERENCE;
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
    /// Exact, whatever the step.
    Closed(Method),
}

/// Radians of the fastest motion in a step, a stage: where the race begins.
const RADIANS: f64 = 0.15;

/// Radians in the longest step that the race begins with.
const LONGEST: f64 = 3.0;

/// Radians after which an adaptive method shows a state, so that no step of a pilot is long.
const SHOWN: f64 = 8.0;

/// Tolerance of an adaptive method where the race begins.
const COARSE: f64 = 1e-5;

/// The loosest and the tightest that adaptive methods take.
const TOLERANCES: [f64; 2] = [0.1, 1e-14];

/// How far a pilot flies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub(super) horizon: f64,
    /// Of the run.
    pub(super) part: f64,
    /// Of the fastest motion in the run.
    pub(super) radians: f64,
    /// Whether only its end matters, as it is that of the run.
    pub(super) whole: bool,
}

impl Family {
    const fn equal(method: Method, order: u32, stages: u32) -> Self {
        Self {
            kind: Kind::Equal(method),
            order,
            stages,
        }
    }

    fn dormand_prince() -> Self {
        Self {
            kind: Kind::Adaptive(|tolerance| Method::DormandPrince853 { tolerance }),
            order: 8,
            stages: 12,
        }
    }

    /// All methods that may suit `system`.
    pub(super) fn all(system: &System) -> Vec<Self> {
        let rotor = Rotor::default();
        let composition = |order| Method::Composition { order, rotor };
        let nystrom = |order, rotor| Method::Nystrom { order, rotor };
        let preprocessed = Rotor::Preprocessed;
        let mut all = vec![
            Self::dormand_prince(),
            Self::equal(Method::Lgvi(rotor), 2, 1),
            Self::equal(composition(4), 4, 5),
            Self::equal(composition(6), 6, 13),
            Self::equal(composition(8), 8, 21),
            Self::equal(composition(10), 10, 35),
        ];
        if system.is_free() {
            all.push(Self::closed_form());
        } else {
            all.extend([
                Self::equal(Method::Lgvi(Rotor::Exact), 2, 1),
                Self::equal(nystrom(4, Rotor::Exact), 4, 6),
                Self::equal(nystrom(6, Rotor::Exact), 6, 14),
                Self::equal(nystrom(8, Rotor::Exact), 8, 20),
                Self::equal(nystrom(4, preprocessed(PreprocessedOrder::Four)), 4, 6),
                Self::equal(nystrom(6, preprocessed(PreprocessedOrder::Six)), 6, 14),
                Self::equal(nystrom(8, preprocessed(PreprocessedOrder::Eight)), 8, 20),
            ]);
        }
        all
    }

    pub(super) const fn closed_form() -> Self {
        Self {
            kind: Kind::Closed(Method::ClosedForm),
            order: 1,
            stages: 0,
        }
    }

    /// The method that references are flown with, and a resolution to begin with for errors as small as `tolerance`.
    pub(super) fn reference(tolerance: f64) -> (Self, f64) {
        let family = Self::dormand_prince();
        let order = f64::from(family.order);
        let resolution = libm::pow(REFERENCE * tolerance, -order.recip());
        (family, family.allowed(resolution))
    }

    /// How to fly a pilot at a resolution of at least `n`, and that resolution.
    pub(super) fn plan(&self, n: f64, extent: Extent) -> (Plan, f64) {
        let Extent {
            horizon,
            part,
            radians,
            whole,
        } = extent;
        let multiple = if whole { 1.0 } else { SAMPLES as f64 };
        let (steps, resolution) = match self.kind {
            Kind::Equal(_) | Kind::Closed(_) => {
                let steps = (n * part / multiple - 1e-9).ceil().max(1.0) * multiple;
                (steps, steps / part)
            }
            Kind::Adaptive(_) => {
                let intervals = SAMPLES as f64;
                let steps = (radians * part / intervals / SHOWN).ceil().max(1.0) * intervals;
                (steps, self.allowed(n))
            }
        };
        let plan = Plan {
            method: self.method(resolution),
            horizon,
            steps: steps as u64,
            stages: self.stages.into(),
            adaptive: matches!(self.kind, Kind::Adaptive(_)),
        };
        (plan, resolution)
    }

    /// A coarse resolution for a run through `radians` of the fastest motion.
    pub(super) fn coarse(&self, radians: f64) -> f64 {
        match self.kind {
            Kind::Equal(_) | Kind::Closed(_) => {
                let step = (RADIANS * f64::from(self.stages)).min(LONGEST);
                (radians / step).max(1.0)
            }
            Kind::Adaptive(_) => libm::pow(COARSE, -f64::from(self.order).recip()),
        }
    }

    /// The method at resolution `n`.
    pub(super) fn method(&self, n: f64) -> Method {
        match self.kind {
            Kind::Equal(method) | Kind::Closed(method) => method,
            Kind::Adaptive(method) => {
                let [loose, tight] = TOLERANCES;
                method(libm::pow(n, -f64::from(self.order)).clamp(tight, loose))
            }
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
        match self.kind {
            Kind::Equal(_) | Kind::Closed(_) => steps.max(SAMPLES as f64 / part),
            Kind::Adaptive(_) => self.allowed(0.0),
        }
    }

    /// Whether references can be flown with it.
    pub(super) fn is_reference(&self) -> bool {
        let exact = Rotor::Exact;
        match self.kind {
            Kind::Adaptive(_) => true,
            Kind::Equal(method) => {
                method
                    == Method::Nystrom {
                        order: 8,
                        rotor: exact,
                    }
            }
            Kind::Closed(_) => false,
        }
    }

    /// Whether there can be as many substeps as `n` needs.
    pub(super) fn is_feasible(&self, n: f64, steps: f64) -> bool {
        match self.kind {
            Kind::Equal(_) => n <= steps * f64::from(u32::MAX),
            Kind::Adaptive(_) | Kind::Closed(_) => true,
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
            Kind::Closed(_) => (1, steps),
        }
    }
}
