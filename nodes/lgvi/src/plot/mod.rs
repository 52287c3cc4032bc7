//! `lgvi plot`: a picture of a recorded flight.
//!
//! [`data`] reads the bag; [`subject`] says what the flight is about; [`space`], [`proximity`], [`pointing`] or [`tumbling`] draws the motion
//! on the left, [`chart`] what [`series`] finds worth seeing over time on the right. The same bag gives the same bytes: nothing depends on clock, fonts or platform.

mod bodies;
mod cage;
mod canvas;
mod chart;
mod controls;
pub(crate) mod data;
mod globe;
mod kept;
mod legend;
mod limits;
pub(crate) mod maneuver;
pub(crate) mod margins;
mod marks;
mod motion;
mod orbit;
mod page;
pub(crate) mod panels;
mod pointing;
mod polhode;
mod proximity;
mod scenery;
mod series;
mod space;
mod style;
mod subject;
pub(crate) mod thin;
mod thrusters;
mod ticks;
mod tumbling;
mod view;
mod wheels;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use lgvi_middleware::node::NodeError;

use crate::drawn;
use data::FlightData;

/// Draws the flight in the bag at `path` and prints the picture's path. `flight` names the propagator if there are
/// several. The picture is `output`, which must not exist; else `flight.svg` in the bag's directory, which is overwritten;
/// else it lies beside a single MCAP file and has its name.
pub(crate) fn plot(
    path: &Path,
    flight: Option<&str>,
    output: Option<&Path>,
) -> Result<PathBuf, NodeError> {
    let picture = page::draw(&FlightData::read(path, flight)?)?;
    drawn::write(path, output, "flight.svg", picture.as_bytes())
}
