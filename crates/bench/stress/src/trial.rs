use std::fmt;

use lgvi_dynamics::{BodyError, InertiaError, MethodError, StepError};
use lgvi_truth::TruthError;
use thiserror::Error;

/// How long a trial is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// Seconds for all of them.
    Short,
    /// Minutes.
    Full,
}

impl Length {
    pub(crate) fn of<T>(self, short: T, full: T) -> T {
        match self {
            Self::Short => short,
            Self::Full => full,
        }
    }
}

/// Something that is done, and what is right then.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    /// Its name, one in its family.
    pub name: &'static str,
    /// What is done.
    pub done: &'static str,
    /// What is right.
    pub right: &'static str,
    pub(crate) run: fn(Length) -> Result<Report, TrialError>,
}

impl Trial {
    /// Does it.
    ///
    /// # Errors
    /// What ought to be possible cannot be done.
    pub fn run(&self, length: Length) -> Result<Report, TrialError> {
        (self.run)(length)
    }
}

/// Why a trial came to no figures.
#[derive(Debug, Error)]
pub enum TrialError {
    /// A reference cannot be read.
    #[error(transparent)]
    Truth(#[from] TruthError),
    /// An inertia is refused.
    #[error(transparent)]
    Inertia(#[from] InertiaError),
    /// A body is refused.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A system is refused.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// A step is refused.
    #[error(transparent)]
    Step(#[from] StepError),
}

/// What was measured.
#[derive(Clone, Debug, Default)]
pub struct Report {
    figures: Vec<Figure>,
}

/// One thing that was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// What.
    pub what: String,
    /// How much.
    pub value: f64,
    /// Between what it must be; none where it is shown only.
    pub bounds: Option<[f64; 2]>,
}

impl Figure {
    /// Whether it is within its bounds. NaN is within none.
    pub fn passes(&self) -> bool {
        self.bounds
            .is_none_or(|[low, high]| low <= self.value && self.value <= high)
    }
}

impl Report {
    /// The figures, in the order of their measurement.
    pub fn figures(&self) -> &[Figure] {
        &self.figures
    }

    /// Whether all are within their bounds.
    pub fn passes(&self) -> bool {
        self.figures.iter().all(Figure::passes)
    }

    pub(crate) fn shows(&mut self, what: impl Into<String>, value: f64) {
        self.note(what, value, None);
    }

    pub(crate) fn at_most(&mut self, what: impl Into<String>, value: f64, bound: f64) {
        self.note(what, value, Some([0.0, bound]));
    }

    pub(crate) fn within(&mut self, what: impl Into<String>, value: f64, bounds: [f64; 2]) {
        self.note(what, value, Some(bounds));
    }

    fn note(&mut self, what: impl Into<String>, value: f64, bounds: Option<[f64; 2]>) {
        self.figures.push(Figure {
            what: what.into(),
            value,
            bounds,
        });
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            what,
            value,
            bounds,
        } = self;
        write!(f, "{what} {}", Short(*value))?;
        match bounds {
            Some([low, high]) if *low == *high => write!(f, " (= {})", Short(*low)),
            Some([low, high]) if *low == 0.0 => write!(f, " (≤ {})", Short(*high)),
            Some([low, high]) => write!(f, " ({} … {})", Short(*low), Short(*high)),
            None => Ok(()),
        }
    }
}

/// A number in as few characters as tell it.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || ((1.0..1e5).contains(&size) && self.0.fract() == 0.0) {
            write!(f, "{}", self.0)
        } else if (0.01..100.0).contains(&size) {
            write!(f, "{:.3}", self.0)
        } else {
            write!(f, "{:.1e}", self.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_bounds_or_no_number_does_not_pass() {
        for (value, passes) in [
            (0.0, true),
            (1.0, true),
            (1.1, false),
            (-0.1, false),
            (f64::NAN, false),
        ] {
            let mut report = Report::default();
            report.at_most("error", value, 1.0);
            assert_eq!(report.passes(), passes, "{value}");
        }
        let mut report = Report::default();
        report.shows("steps", 1e9);
        report.within("exponent", 0.5, [0.35, 0.65]);
        assert!(report.passes());
        let texts: Vec<_> = report.figures().iter().map(Figure::to_string).collect();
        assert_eq!(texts, ["steps 1.0e9", "exponent 0.500 (0.350 … 0.650)"]);
    }
}
