//! `lgvi plot`: a picture of a recorded flight.
//!
//! [`data`] reads the bag; [`subject`] says what the flight is about; [`space`], [`pointing`] or [`tumbling`] draws the motion
//! on the left, [`chart`] what [`series`] finds worth seeing over time on the right. The same bag gives the same bytes: nothing depends on clock, fonts or platform.

mod bodies;
mod cage;
mod canvas;
mod chart;
mod controls;
mod data;
mod globe;
mod kept;
mod legend;
mod limits;
mod maneuver;
mod marks;
mod motion;
mod orbit;
mod page;
mod pointing;
mod polhode;
mod scenery;
mod series;
mod space;
mod style;
mod subject;
mod thin;
mod ticks;
mod tumbling;
mod view;

#[cfg(test)]
mod tests;

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use lgvi_middleware::node::NodeError;

use data::FlightData;

/// Draws the flight in the bag at `path` and prints the picture's path. `flight` names the propagator if there are
/// several. The picture is `output`, which must not exist; else `flight.svg` in the bag's directory, which is overwritten;
/// else it lies beside a single MCAP file and has its name.
pub(crate) fn plot(
    path: &Path,
    flight: Option<&str>,
    output: Option<&Path>,
) -> Result<PathBuf, NodeError> {
    let own = output.is_none() && path.is_dir();
    let output = match output {
        Some(output) => output.to_owned(),
        None if own => path.join("flight.svg"),
        None => path.with_extension("svg"),
    };
    let picture = page::draw(&FlightData::read(path, flight)?)?;
    let written = if own {
        fs::write(&output, picture)
    } else {
        write_new(&output, picture.as_bytes())
    };
    written.map_err(|error| {
        let message = format!("cannot write {}: {error}", output.display());
        match error.kind() {
            ErrorKind::AlreadyExists => NodeError::Input(message),
            _ => NodeError::Runtime(message),
        }
    })?;
    Ok(output)
}

/// Writes a file that does not exist yet, or none.
fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    File::create_new(path)?.write_all(bytes).inspect_err(|_| {
        // It is of no use; what went wrong is told.
        let _ = fs::remove_file(path);
    })
}
