//! The cases: what is flown, and what is asked of it.

use lgvi_dynamics::{Invariants, System};
use lgvi_truth::{Case, Errors};
use serde::Serialize;

use crate::error::BenchError;

/// A reference case, with what is asked of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    pub name: &'static str,
    /// Time of the last reference state that is asked for: of chaotic cases one before chaos.
    pub t: f64,
    /// Fewest steps that a fixed step method is tried with.
    pub steps: u64,
    /// Which error counts.
    pub quantity: Quantity,
    /// Of the error, with its unit.
    pub label: &'static str,
    /// Errors at which times are compared.
    pub targets: [f64; 3],
    /// Flights with a greater error are not timed.
    pub coarse: f64,
    /// Which angular momentum is kept.
    momentum: Momentum,
}

#[derive(Clone, Copy, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Quantity {
    Position,
    Attitude,
}

#[derive(Clone, Copy, Debug)]
enum Momentum {
    /// All of it, about the origin.
    Total,
    /// Its component along gravity.
    Vertical,
}

/// Errors at a reference time.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct ErrorsAt {
    pub t: f64,
    pub position: f64,
    pub velocity: f64,
    /// Frobenius norm.
    pub attitude: f64,
    pub angular_velocity: f64,
    /// Relative to the initial energy.
    pub energy: f64,
    /// Of angular momentum, relative to its initial norm.
    pub angular_momentum: f64,
}

const ATTITUDES: [f64; 3] = [1e-6, 1e-8, 1e-10];

pub(crate) const CASES: [Setting; 12] = [
    Setting {
        steps: 1200,
        ..Setting::attitude("a1_two_dumbbells_regular", 300.0, "t = 300")
    },
    Setting {
        steps: 20,
        ..Setting::attitude("a2_two_dumbbells_coupled", 5.0, "t = 5")
    },
    Setting::attitude("b1_free_asymmetric", 100.0, "t = 100"),
    Setting::attitude("b2_dzhanibekov", 100.0, "t = 100"),
    Setting {
        steps: 40,
        momentum: Momentum::Vertical,
        ..Setting::attitude("c1_3d_pendulum", 5.0, "t = 5 s")
    },
    Setting {
        steps: 200,
        momentum: Momentum::Vertical,
        ..Setting::attitude("c3_3d_pendulum_regular_small", 100.0, "t = 100 s")
    },
    Setting::attitude("d_dumbbell_central", 100.0, "t = 100"),
    Setting {
        steps: 180,
        targets: [1.0, 1e-3, 1e-5],
        coarse: 1e2,
        ..Setting::position("e_kw4_like", 2_592_000.0, "30 days (m)")
    },
    Setting {
        steps: 100,
        targets: [1e-3, 1e-6, 1e-9],
        coarse: 1e1,
        ..Setting::position("f_outer_planets", 200_000.0, "t = 200 000 days (AU)")
    },
    Setting {
        steps: 10,
        targets: [1e-4, 1e-7, 1e-10],
        ..Setting::position("g_kepler", 100.0, "t = 100")
    },
    Setting::attitude("h_five_bodies", 20.0, "t = 20"),
    Setting::attitude("i_ten_bodies", 20.0, "t = 20"),
];

impl Setting {
    const fn attitude(name: &'static str, t: f64, label: &'static str) -> Self {
        Self {
            name,
            t,
            steps: 100,
            quantity: Quantity::Attitude,
            label,
            targets: ATTITUDES,
            coarse: 1e-1,
            momentum: Momentum::Total,
        }
    }

    const fn position(name: &'static str, t: f64, label: &'static str) -> Self {
        Self {
            quantity: Quantity::Position,
            ..Self::attitude(name, t, label)
        }
    }

    /// The setting of the case called `name`.
    pub(crate) fn named(name: &str) -> Result<&'static Self, BenchError> {
        let found = CASES.iter().find(|setting| setting.name == name);
        found.ok_or_else(|| BenchError::Case {
            name: name.into(),
            known: CASES.iter().map(|setting| setting.name).collect(),
        })
    }

    /// The error that counts, as words.
    pub(crate) fn error_label(&self) -> String {
        let quantity = match self.quantity {
            Quantity::Position => "position",
            Quantity::Attitude => "attitude",
        };
        format!("{quantity} error at {}", self.label)
    }

    pub(crate) fn error(&self, errors: &ErrorsAt) -> f64 {
        match self.quantity {
            Quantity::Position => errors.position,
            Quantity::Attitude => errors.attitude,
        }
    }

    /// The times of the reference states up to `t`.
    pub(crate) fn times(&self, case: &Case) -> Vec<f64> {
        let times = case.times().into_iter();
        times.filter(|time| *time <= self.t).collect()
    }
}

/// Says how far flights are off.
pub(crate) struct Judge<'a> {
    case: &'a Case,
    setting: &'a Setting,
    pub system: System,
    initial: Invariants,
}

impl<'a> Judge<'a> {
    pub(crate) fn new(case: &'a Case, setting: &'a Setting) -> Result<Self, BenchError> {
        let (system, states) = case.system()?;
        Ok(Self {
            case,
            setting,
            initial: Invariants::of(&system, &states),
            system,
        })
    }

    pub(crate) fn case(&self) -> &Case {
        self.case
    }

    /// Errors of `states` at the reference time `t`.
    pub(crate) fn errors(
        &self,
        t: f64,
        states: &[lgvi_dynamics::BodyState],
    ) -> Result<ErrorsAt, BenchError> {
        let Errors {
            position,
            velocity,
            attitude,
            angular_velocity,
        } = self.case.errors(t, self.system.bodies(), states)?;
        let now = Invariants::of(&self.system, states);
        let before = &self.initial;
        let change = now.angular_momentum - before.angular_momentum;
        let change = match self.setting.momentum {
            Momentum::Total => change.norm(),
            Momentum::Vertical => change.z.abs(),
        };
        Ok(ErrorsAt {
            t,
            position,
            velocity,
            attitude,
            angular_velocity,
            energy: ((now.energy - before.energy) / before.energy).abs(),
            angular_momentum: change / before.angular_momentum.norm(),
        })
    }
}
