//! Against typed decoding, which `lgvi_msgs` does in another way; and what is hostile.

mod bags;
mod columns;
mod hostile;
mod random;
mod typed;
mod wide;

use std::sync::Arc;

use crate::cdr::{DecodeError, Reader};
use crate::definition::{Message, Type};
use crate::text;

/// A whole message as JSON.
fn json(message: &Arc<Message>, payload: &[u8]) -> Result<serde_json::Value, DecodeError> {
    let mut reader = Reader::new(payload)?;
    let mut json = String::new();
    text::json(&mut json, &mut reader, &Type::Message(Arc::clone(message)))?;
    reader.finish()?;
    Ok(serde_json::from_str(&json).expect(&json))
}

/// Plain CDR of little endian.
fn little_endian(body: &[u8]) -> Vec<u8> {
    [&[0, 1, 0, 0], body].concat()
}
