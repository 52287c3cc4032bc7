//! Standard output, which may be a closed pipe or a full device.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

use lgvi_middleware::node::NodeError;
use serde_json::json;

/// Writes a text and a newline. A reader that has gone has read enough.
pub(crate) fn say(text: &dyn Display) -> Result<(), NodeError> {
    match write(&mut io::stdout().lock(), text) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|error| {
            NodeError::Runtime(format!("cannot write to standard output: {error}"))
        }),
    }
}

/// Writes an error as a JSON object, if possible.
pub(crate) fn fail(error: &NodeError, exit_code: u8) {
    let failure = json!({"failure": {"message": error.to_string(), "exit_code": exit_code}});
    // Whatever is wrong with standard output, standard error has the message.
    let _ = write(&mut io::stdout().lock(), &failure);
}

/// Names a topic that is left out, and why.
pub(crate) fn left_out(name: &str, type_name: &str, reason: &str) -> String {
    if type_name.is_empty() {
        format!("left out: {name}: {reason}")
    } else {
        format!("left out: {name} ({type_name}): {reason}")
    }
}

/// A text with control characters escaped, so that it cannot control the terminal or begin a new line.
pub(crate) fn shown(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for letter in text.chars() {
        if letter.is_control() {
            shown.extend(letter.escape_default());
        } else {
            shown.push(letter);
        }
    }
    shown
}

fn write(output: &mut impl Write, text: &dyn Display) -> io::Result<()> {
    writeln!(output, "{text}")?;
    output.flush()
}
