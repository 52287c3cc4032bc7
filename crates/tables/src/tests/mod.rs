//! Comparisons with the independent typed decoding of `lgvi_msgs`, and tests of malformed input.

mod bags;
mod columns;
mod hostile;
mod memory;
mod random;
mod typed;
mod wide;

use std::sync::Arc;

use crate::cdr::{DecodeError, Reader};
use crate::definition::{Message, Type};
use crate::text;

/// Decodes a whole message to JSON.
fn json(message: &Arc<Message>, payload: &[u8]) -> Result<serde_json::Value, DecodeError> {
    let mut reader = Reader::new(payload)?;
    let mut json = String::new();
    text::json(&mut json, &mut reader, &Type::Message(Arc::clone(message)))?;
    reader.finish()?;
    Ok(serde_json::from_str(&json).expect(&json))
}

/// Returns a payload in little-endian plain CDR.
fn little_endian(body: &[u8]) -> Vec<u8> {
    [&[0, 1, 0, 0], body].concat()
}
