//! `lgvi plot`: a picture of a recorded flight.
//!
//! [`data`] reads the bag; [`space`] or [`sphere`] draws the motion on the left, [`chart`] what [`series`] finds worth
//! seeing over time on the right. The same bag gives the same bytes: nothing depends on clock, fonts or platform.

mod bodies;
mod cage;
mod canvas;
mod chart;
mod controls;
pub(crate) mod data;
mod legend;
pub(crate) mod maneuver;
mod marks;
mod orbit;
mod page;
mod polhode;
mod series;
mod space;
mod sphere;
mod style;
pub(crate) mod thin;
mod ticks;
mod view;

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
