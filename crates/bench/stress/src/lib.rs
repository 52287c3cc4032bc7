//! Trials that drive the dynamics to its limits and beyond: each says what is done, what is right, and what was measured.
//!
//! `lgvi_bench stress` runs them in full, which takes minutes; the tests of this crate run them short. What the flow
//! itself must do (closed forms, invariance under a change of units, conservation) is what measured figures are held
//! against, never an earlier run.

mod approach;
mod bodies;
mod energy;
mod fit;
mod limit;
mod modified;
mod range;
mod ratio;
mod rounding;
mod shapes;
mod steps;
mod trial;
mod tumbling;

pub use trial::{Figure, Length, Report, Trial, TrialError};

/// Names of the families and their trials.
pub const FAMILIES: [(&str, &[Trial]); 9] = [
    ("tumbling", &tumbling::TRIALS),
    ("shapes", &shapes::TRIALS),
    ("limit", &limit::TRIALS),
    ("rounding", &rounding::TRIALS),
    ("energy", &energy::TRIALS),
    ("ratio", &ratio::TRIALS),
    ("approach", &approach::TRIALS),
    ("steps", &steps::TRIALS),
    ("range", &range::TRIALS),
];
