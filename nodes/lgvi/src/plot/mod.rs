//! `lgvi plot`: a picture of a recorded flight.
//!
//! [`data`] reads the bag; [`space`] or [`sphere`] draws the motion on the left, [`chart`] what [`series`] finds worth
//! seeing over time on the right. The same bag gives the same bytes: nothing depends on clock, fonts or platform.

mod bodies;
mod cage;
mod canvas;
mod chart;
mod controls;
mod data;
mod legend;
mod maneuver;
mod marks;
mod orbit;
mod page;
mod polhode;
mod series;
mod space;
mod sphere;
mod style;
mod thin;
mod ticks;
mod view;

use std::path::{Path, PathBuf};

use lgvi_node::NodeError;

use data::FlightData;

/// Draws the flight in the bag at `path` and says where: at `output`, or beside the bag's files.
pub(crate) fn plot(path: &Path, output: Option<&Path>) -> Result<PathBuf, NodeError> {
    let picture = page::draw(&FlightData::read(path)?)?;
    let output = output.map_or_else(|| default_output(path), Path::to_owned);
    std::fs::write(&output, picture).map_err(|error| {
        NodeError::Runtime(format!("cannot write {}: {error}", output.display()))
    })?;
    Ok(output)
}

/// `flight.svg` in the bag's directory; beside a single MCAP file, with its name.
fn default_output(bag: &Path) -> PathBuf {
    if bag.is_dir() {
        bag.join("flight.svg")
    } else {
        bag.with_extension("svg")
    }
}
