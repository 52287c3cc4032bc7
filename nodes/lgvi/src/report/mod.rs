//! `lgvi report`: a page of a recorded flight for a browser, in one file that needs no network.
//!
//! [`flight`] packs what the bag tells over time, [`scenery`] what there is to see, with the [`limits`] of a maneuver; [`page`] puts them into one file with the
//! scripts in `assets`, which draw it. The same bag gives the same bytes.

mod flight;
mod limits;
mod packed;
mod page;
mod scenery;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use lgvi_middleware::node::NodeError;
use serde::Serialize;

use crate::drawn;
use crate::output::say;
use crate::plot::data::FlightData;
use crate::values;
use flight::Flight;

/// The command line of `lgvi report`.
#[derive(Args)]
pub(crate) struct Options {
    /// Directory of the bag, or one MCAP file.
    #[arg(value_parser = values::path())]
    bag: PathBuf,
    /// Node name of the propagator, such as `/lgvi_propagator`, if the bag has flights of several.
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    /// HTML file to write (default: `report.html` in the bag's directory).
    #[arg(long, value_name = "FILE", value_parser = values::path())]
    output: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The result as JSON.
#[derive(Serialize)]
struct Report {
    bag: String,
    output: String,
    bodies: usize,
    /// States of the flight in the bag, and how many of them the page holds.
    recorded: u64,
    shown: usize,
    /// Size of the page.
    bytes: usize,
}

/// Writes the page and prints its path.
pub(crate) fn report(options: &Options) -> Result<ExitCode, NodeError> {
    let data = FlightData::read(&options.bag, options.flight.as_deref())?;
    let flight = Flight::of(&data);
    let page = page::page(&flight).map_err(NodeError::runtime)?;
    let output = options.output.as_deref();
    let output = drawn::write(&options.bag, output, "report.html", page.as_bytes())?;
    if options.json {
        let report = Report {
            bag: options.bag.display().to_string(),
            output: output.display().to_string(),
            bodies: data.scene.bodies.len(),
            recorded: data.recorded,
            shown: flight.shown(),
            bytes: page.len(),
        };
        say(&serde_json::to_string(&report).map_err(NodeError::runtime)?)?;
    } else {
        say(&output.display())?;
    }
    Ok(ExitCode::SUCCESS)
}
