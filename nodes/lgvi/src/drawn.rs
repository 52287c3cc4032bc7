//! Where what is drawn of a bag is written.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use lgvi_middleware::node::NodeError;

/// Writes what was drawn of `bag` and returns its path: `output`, which must not exist; else `name` in the bag's directory,
/// which is overwritten; else beside a single MCAP file, with its name and the extension of `name`.
pub(crate) fn write(
    bag: &Path,
    output: Option<&Path>,
    name: &str,
    bytes: &[u8],
) -> Result<PathBuf, NodeError> {
    let own = output.is_none() && bag.is_dir();
    let extension = Path::new(name).extension().unwrap_or_default();
    let output = match output {
        Some(output) => output.to_owned(),
        None if own => bag.join(name),
        None => bag.with_extension(extension),
    };
    let written = if own {
        fs::write(&output, bytes)
    } else {
        write_new(&output, bytes)
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
