//! YAML of bags that others made, with bounds on what it may ask for.
//!
//! The parser below serde expands aliases and holds all of a document before anything of it is used: aliases of aliases,
//! or of a long text, take memory without bound, and deep nesting takes time that grows with its square.

use std::fmt::Display;

use saphyr_parser::{Event, Parser};
use serde::de::{DeserializeOwned, Error as _};
use serde_yaml_ng::Error;

/// Longest text (bytes): a bag of a hundred thousand files needs less.
pub(crate) const MAX_TEXT: usize = 64 << 20;

/// The most scalars, and beginnings and ends of lists and maps. Each takes some two hundred bytes of memory while it is
/// parsed; a file of a bag has seventeen, a topic some fifty.
const MAX_EVENTS: usize = 2 << 20;

/// Nesting beyond this is refused; that of rosbag2 is less than ten.
const MAX_DEPTH: usize = 64;

/// Reads a document without aliases, which rosbag2 never writes.
pub(crate) fn read<T: DeserializeOwned>(text: &str) -> Result<T, Error> {
    check(text)?;
    serde_yaml_ng::from_str(text)
}

fn check(text: &str) -> Result<(), Error> {
    if text.len() > MAX_TEXT {
        let length = text.len();
        return Err(Error::custom(format!(
            "{length} bytes of YAML, expected at most {MAX_TEXT}"
        )));
    }
    let mut depth = 0_usize;
    for (count, event) in Parser::new_from_str(text).enumerate() {
        let (event, span) = event.map_err(Error::custom)?;
        let refused = |reason: &dyn Display| {
            let line = span.start.line();
            Err(Error::custom(format!("line {line}: {reason}")))
        };
        match event {
            Event::Alias(_) => return refused(&"an alias"),
            Event::SequenceStart(..) | Event::MappingStart(..) => depth += 1,
            Event::SequenceEnd | Event::MappingEnd => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > MAX_DEPTH {
            return refused(&format!("nested more than {MAX_DEPTH} deep"));
        }
        if count > MAX_EVENTS {
            return refused(&format!("more than {MAX_EVENTS} scalars and brackets"));
        }
    }
    Ok(())
}
