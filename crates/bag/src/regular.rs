use std::{
    fs,
    io::{self, ErrorKind},
    path::Path,
};

/// Length of a regular file (bytes). Pipes and devices are refused, which are waited for or never end.
pub(crate) fn length(path: &Path) -> io::Result<u64> {
    let metadata = fs::metadata(path)?;
    if metadata.is_file() {
        Ok(metadata.len())
    } else {
        Err(io::Error::new(
            ErrorKind::InvalidInput,
            "is not a regular file",
        ))
    }
}

/// The text of a regular file of at most `most` bytes.
pub(crate) fn text(path: &Path, most: usize) -> io::Result<String> {
    let length = length(path)?;
    if length > most as u64 {
        return Err(io::Error::new(
            ErrorKind::InvalidData,
            format!("{length} bytes, expected at most {most}"),
        ));
    }
    fs::read_to_string(path)
}
