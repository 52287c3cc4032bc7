//! The planner beside CasADi's solvers on the same discrete problem; its time against the number of steps; re-planning.

mod actuators;
mod beside;
mod case;
mod guess;
mod ours;
mod peer;
mod peers;
mod replan;
mod sample;
mod scaling;
mod varied;

use std::path::Path;

use clap::Args;
use serde::Serialize;

use crate::error::{BenchError, write_json};
use crate::peer::Python;
pub(crate) use actuators::run as actuators;
use case::Case;
pub(crate) use varied::run as varied;

/// The scenes with the two maneuvers of §4.7.
const SCENES: [&str; 2] = ["inclination_change", "orbital_capture"];

/// What to measure; everything without an option.
#[derive(Args)]
pub(crate) struct Options {
    /// Only the solver and its peers.
    #[arg(long)]
    peers: bool,
    /// Only the time against the number of steps.
    #[arg(long)]
    scaling: bool,
    /// Only plans from the plan before.
    #[arg(long)]
    replan: bool,
    /// Fewer and smaller problems.
    #[arg(long)]
    quick: bool,
    /// Only problems of so many steps.
    #[arg(long)]
    steps: Vec<usize>,
}

impl Options {
    /// All of it, or a quick run.
    pub(crate) fn all(quick: bool) -> Self {
        Self {
            peers: false,
            scaling: false,
            replan: false,
            quick,
            steps: Vec::new(),
        }
    }

    /// Whether solvers of peers are asked for.
    pub(crate) fn beside_peers(&self) -> bool {
        self.peers || !(self.scaling || self.replan)
    }

    /// The numbers of steps to measure, of all or of the few of a quick run.
    fn steps(&self, all: &[usize], quick: &[usize]) -> Vec<usize> {
        match (self.steps.as_slice(), self.quick) {
            ([], false) => all.to_vec(),
            ([], true) => quick.to_vec(),
            (asked, _) => asked.to_vec(),
        }
    }
}

/// Everything that was measured; times in seconds of the thread's CPU clock.
#[derive(Serialize)]
struct Report {
    peers: Vec<peers::Comparison>,
    scaling: Vec<scaling::Scaling>,
    replan: Vec<replan::Replan>,
}

/// Measures, prints tables, writes `planner.json` and the pictures.
pub(crate) fn run(
    options: &Options,
    python: Option<&Python>,
    repeats: u32,
    images: &Path,
) -> Result<(), BenchError> {
    let all = !(options.peers || options.scaling || options.replan);
    let cases = SCENES
        .into_iter()
        .map(Case::load)
        .collect::<Result<Vec<_>, _>>()?;
    let mut report = Report {
        peers: Vec::new(),
        scaling: Vec::new(),
        replan: Vec::new(),
    };
    // a peer that fails does not keep the rest from being measured
    let mut beside = Ok(());
    if options.beside_peers() {
        beside = peers::run(&cases, options, python, repeats, &mut report.peers);
        if let (Ok(()), Some(table)) = (&beside, peers::table(&report.peers)) {
            table.keep(images, "planner")?;
        }
    }
    if all || options.scaling {
        report.scaling = scaling::run(&cases, options, repeats, images)?;
    }
    if all || options.replan {
        report.replan = replan::run(&cases, options, repeats)?;
    }
    write_json(&images.join("planner.json"), &report)?;
    beside
}
