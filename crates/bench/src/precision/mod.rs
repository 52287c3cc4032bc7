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
use measure::{Effort, measure};
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

/// Measures and keeps each case.
pub(crate) fn run(
    options: &Options,
    python: Option<&Python>,
    repeats: u32,
    directory: &Path,
) -> Result<(), BenchError> {
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
                flyers.push(Rc::new(RefCell::new(Flyer::start(python, peer)?)));
            }
        }
    }
    for setting in settings {
        println!("\n{}", setting.name);
        case(setting, &flyers, effort)?.keep(setting, directory)?;
    }
    Ok(())
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
    let mut peers = Vec::new();
    for flyer in flyers {
        let offers = flyer.borrow_mut().offer_case(setting.name, &times)?;
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
    let methods = measure(&mut contestants, setting, &judge, effort)?;
    Ok(Report::new(setting, peers, methods))
}
