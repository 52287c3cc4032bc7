//! Standard output, which may be a closed pipe or a full device.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

use lgvi_node::NodeError;

/// Writes a text and a newline. A reader that has gone has read enough.
pub(crate) fn say(text: &dyn Display) -> Result<(), NodeError> {
    match write(&mut io::stdout().lock(), text) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|error| {
            NodeError::Runtime(format!("cannot write to standard output: {error}"))
        }),
    }
}

fn write(output: &mut impl Write, text: &dyn Display) -> io::Result<()> {
    writeln!(output, "{text}")?;
    output.flush()
}
