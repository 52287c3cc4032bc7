//! Whether definitions that no checksum covers may be right.

use super::definition_text;
use crate::{
    ROS2MSG,
    records::{Channel, Schema},
};

/// What type hashes begin with, and their length.
const HASH: (&str, usize) = ("RIHS01_", 71);

pub(super) fn is_plausible_schema(schema: &Schema) -> bool {
    let is_definition = || match std::str::from_utf8(&schema.data) {
        Ok(text) if schema.encoding == ROS2MSG => definition_text::is_plausible(text),
        Ok(_) => true,
        // Binary ones there are too.
        Err(_) => !["ros2idl", ROS2MSG].contains(&&*schema.encoding),
    };
    let mut encoding = schema.encoding.chars();
    is_graphic(&schema.name) && encoding.all(|letter| letter.is_ascii_graphic()) && is_definition()
}

pub(super) fn is_plausible_channel(channel: &Channel) -> bool {
    is_graphic(&channel.topic) && is_graphic(&channel.encoding)
}

/// Whether it is a type hash, or the place of one.
pub(super) fn is_type_hash(text: &str) -> bool {
    let (begin, length) = HASH;
    let digits = text.strip_prefix(begin).unwrap_or("-");
    text.is_empty() || text.len() == length && digits.bytes().all(|byte| byte.is_ascii_hexdigit())
}

/// A name of visible letters.
pub(super) fn is_graphic(text: &str) -> bool {
    !text.is_empty() && text.chars().all(|letter| letter.is_ascii_graphic())
}
