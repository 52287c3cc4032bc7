//! Trials that drive the dynamics to its limits, in full.

use std::path::Path;
use std::time::Instant;

use lgvi_stress::{FAMILIES, Figure, Length, Trial};
use serde::Serialize;

use crate::error::{BenchError, write_json};

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

/// Runs the trials of a family, or all; prints a table, writes the figures to a file.
///
/// # Errors
/// A trial that fails, or a family that there is not.
pub(crate) fn run(family: Option<&str>, json: Option<&Path>) -> Result<(), BenchError> {
    if let Some(name) = family
        && FAMILIES.iter().all(|(known, _)| *known != name)
    {
        return Err(BenchError::Case {
            name: name.into(),
            known: FAMILIES.iter().map(|(known, _)| *known).collect(),
        });
    }
    println!(
        "| Trial | What is done | What is right | Measured (bound) | |\n| --- | --- | --- | --- | --- |"
    );
    let mut outcomes = Vec::new();
    for (name, trials) in FAMILIES {
        if family.is_some_and(|family| family != name) {
            continue;
        }
        for trial in trials {
            let outcome = measure(name, trial);
            println!("{}", row(&outcome));
            outcomes.push(outcome);
        }
    }
    if let Some(path) = json {
        write_json(path, &outcomes)?;
    }
    let failed = outcomes.iter().filter(|outcome| !outcome.passes);
    let failed: Vec<_> = failed.map(|outcome| outcome.trial.to_owned()).collect();
    if failed.is_empty() {
        Ok(())
    } else {
        Err(BenchError::Stress(failed.join(", ")))
    }
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

fn row(outcome: &Outcome) -> String {
    let texts = outcome.figures.iter().map(|figure| figure.text.clone());
    let figures: Vec<_> = texts.chain(outcome.error.clone()).collect();
    let verdict = if outcome.passes { "pass" } else { "**FAIL**" };
    let measured = figures.join("; ");
    let cells = [
        outcome.trial,
        outcome.done,
        outcome.right,
        &measured,
        verdict,
    ];
    // A bar ends a cell, in code too.
    format!(
        "| {} |",
        cells.map(|cell| cell.replace('|', "\\|")).join(" | ")
    )
}
