//! Where what is drawn of a bag is written.

use std::fs::Permissions;
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::PermissionsExt;
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
    whole(&output, bytes, own).map_err(|error| {
        let message = format!("cannot write {}: {error}", output.display());
        match error.kind() {
            ErrorKind::AlreadyExists => NodeError::Input(message),
            _ => NodeError::Runtime(message),
        }
    })?;
    Ok(output)
}

/// Writes a file as a whole or not at all. One that exists is an error or is replaced.
fn whole(path: &Path, bytes: &[u8], replace: bool) -> io::Result<()> {
    let directory = path.parent().filter(|parent| *parent != Path::new(""));
    let mut file = tempfile::Builder::new()
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(directory.unwrap_or(Path::new(".")))?;
    file.write_all(bytes)?;
    let kept = if replace {
        file.persist(path)
    } else {
        file.persist_noclobber(path)
    };
    kept.map(drop).map_err(|error| error.error)
}
