//! Run time against error of every integrator on the reference cases, beside peers.

mod cases;
mod contestant;
mod measure;
mod ratio;
mod report;

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

use clap::Args;
use lgvi_truth::Case;

use crate::error::BenchError;
use crate::methods::families;
use crate::peer::{Flyer, INTEGRATORS, Python};
use cases::{CASES, Judge, Setting};
use contestant::{Contestant, Own, Peers};
use measure::{Effort, LeftOut, measure};
use report::Report;

/// What to measure.
#[derive(Args)]
pub(crate) struct Options {
    /// The case, such as `a1_two_dumbbells_regular`; all of them without one.
    case: Option<String>,
    /// Only the coarsest flights, without peers.
    #[arg(long)]
    pub quick: bool,
}

impl Options {
    pub(crate) fn all(quick: bool) -> Self {
        Self { case: None, quick }
    }
}

/// A method of a peer that failed, and the table that it is missing from.
#[derive(Clone, Debug)]
pub(crate) struct Lost {
    pub table: String,
    pub method: String,
    why: String,
}

impl Lost {
    /// Whether the file is the table or one of its pictures.
    pub(crate) fn belongs(&self, file: &Path) -> bool {
        let stem = file.file_stem().unwrap_or_default();
        stem.to_string_lossy().starts_with(&self.table)
    }
}

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}: {}", self.table, self.method, self.why)
    }
}

/// Measures and keeps each case; a peer that fails does not keep the rest from being measured.
pub(crate) fn run(
    options: &Options,
    python: Option<&Python>,
    repeats: u32,
    directory: &Path,
) -> Result<Vec<Lost>, BenchError> {
    let settings = match &options.case {
        Some(name) => vec![Setting::named(name)?],
        None => CASES.iter().collect(),
    };
    let effort = Effort {
        repeats,
        quick: options.quick,
    };
    let mut flyers = Vec::new();
    if let Some(python) = python.filter(|_| !options.quick) {
        for peer in INTEGRATORS {
            if python.has(peer) {
                flyers.push(Rc::new(RefCell::new(Flyer::new(python, peer))));
            }
        }
    }
    let mut lost = Vec::new();
    for setting in settings {
        println!("\n{}", setting.name);
        let report = case(setting, &flyers, effort)?;
        report.keep(setting, directory)?;
        for left_out in &report.left_out {
            println!("left out: {}: {}", left_out.method, left_out.why);
        }
        let failed = report.left_out.iter().filter(|left_out| left_out.failed);
        lost.extend(failed.map(|left_out| Lost {
            table: report.name(),
            method: left_out.method.clone(),
            why: left_out.why.clone(),
        }));
    }
    Ok(lost)
}

fn case(
    setting: &Setting,
    flyers: &[Rc<RefCell<Flyer>>],
    effort: Effort,
) -> Result<Report, BenchError> {
    let case = Case::load(setting.name)?;
    let judge = Judge::new(&case, setting)?;
    let times = setting.times(&case);
    let mut contestants: Vec<Box<dyn Contestant + '_>> = Vec::new();
    for (label, family) in families() {
        contestants.push(Box::new(Own {
            label,
            family,
            case: &case,
            times: &times,
        }));
    }
    let (mut peers, mut refused) = (Vec::new(), Vec::new());
    for flyer in flyers {
        let offers = flyer.borrow_mut().offer_case(setting.name, &times);
        let offers = offers.unwrap_or_else(|error| {
            refused.push(LeftOut {
                method: flyer.borrow().name.into(),
                peer: true,
                why: error.to_string(),
                failed: true,
            });
            Vec::new()
        });
        if !offers.is_empty() {
            peers.push(flyer.borrow().version.clone());
        }
        for offer in offers {
            contestants.push(Box::new(Peers {
                label: format!("{} {}", flyer.borrow().name, offer.name),
                name: offer.name,
                tuning: offer.tuning,
                flyer: Rc::clone(flyer),
                system: &judge.system,
            }));
        }
    }
    let (methods, left_out) = measure(&mut contestants, setting, &judge, effort)?;
    refused.extend(left_out);
    Ok(Report::new(setting, peers, methods, refused))
}
