//! Trials that drive the dynamics to its limits, in full.

use std::path::Path;
use std::time::Instant;

use lgvi_stress::{FAMILIES, Figure, Length, Trial};
use serde::Serialize;

use crate::error::{BenchError, write_json};
use crate::tables::Table;

const HEAD: [&str; 5] = [
    "Trial",
    "What is done",
    "What is right",
    "Measured (bound)",
    "",
];

/// What became of a trial.
#[derive(Serialize)]
struct Outcome {
    family: &'static str,
    trial: &'static str,
    done: &'static str,
    right: &'static str,
    figures: Vec<Measured>,
    /// Why there are no figures.
    error: Option<String>,
    passes: bool,
    seconds: f64,
}

#[derive(Serialize)]
struct Measured {
    what: String,
    value: f64,
    bounds: Option<[f64; 2]>,
    #[serde(skip)]
    text: String,
}

/// Runs the trials of a family, or all; keeps a table a family and the figures of all. Returns the names of the trials that
/// are not as they should be.
///
/// # Errors
/// There is no such family, or a file cannot be written.
pub(crate) fn run(family: Option<&str>, directory: &Path) -> Result<Vec<&'static str>, BenchError> {
    if let Some(name) = family
        && FAMILIES.iter().all(|(known, _)| *known != name)
    {
        return Err(BenchError::Case {
            name: name.into(),
            known: FAMILIES.iter().map(|(known, _)| *known).collect(),
        });
    }
    let mut outcomes = Vec::new();
    for (name, trials) in FAMILIES {
        if family.is_some_and(|family| family != name) {
            continue;
        }
        let mut table = Table::new(HEAD);
        for trial in trials {
            let outcome = measure(name, trial);
            table.row(cells(&outcome));
            outcomes.push(outcome);
        }
        table.keep(directory, &format!("stress_{name}"))?;
    }
    write_json(&directory.join("stress.json"), &outcomes)?;
    let failed = outcomes.iter().filter(|outcome| !outcome.passes);
    Ok(failed.map(|outcome| outcome.trial).collect())
}

fn measure(family: &'static str, trial: &Trial) -> Outcome {
    let begun = Instant::now();
    let report = trial.run(Length::Full);
    let measured = |figure: &Figure| Measured {
        what: figure.what.clone(),
        value: figure.value,
        bounds: figure.bounds,
        text: figure.to_string(),
    };
    Outcome {
        family,
        trial: trial.name,
        done: trial.done,
        right: trial.right,
        passes: report.as_ref().is_ok_and(|report| report.passes()),
        error: report.as_ref().err().map(ToString::to_string),
        figures: report.map_or_else(
            |_| Vec::new(),
            |report| report.figures().iter().map(measured).collect(),
        ),
        seconds: begun.elapsed().as_secs_f64(),
    }
}

fn cells(outcome: &Outcome) -> [String; 5] {
    let texts = outcome.figures.iter().map(|figure| figure.text.clone());
    let figures: Vec<_> = texts.chain(outcome.error.clone()).collect();
    let verdict = if outcome.passes { "pass" } else { "**FAIL**" };
    let measured = figures.join("; ");
    // A bar ends a cell, in code too.
    [
        outcome.trial,
        outcome.done,
        outcome.right,
        &measured,
        verdict,
    ]
    .map(|cell| cell.replace('|', "\\|"))
}
