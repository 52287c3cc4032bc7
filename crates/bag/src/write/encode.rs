//! Records of an MCAP file as bytes: operation code, length of the body, body; all numbers little-endian.

use std::collections::BTreeMap;

/// Operation code and length before each record's body.
pub(crate) const PREFIX: usize = 1 + 8;

/// Bytes of a message's body before its data.
const MESSAGE_HEADER: usize = 2 + 4 + 8 + 8;

/// Appends a record, whose body `write` appends.
pub(crate) fn record(out: &mut Vec<u8>, opcode: u8, write: impl FnOnce(&mut Vec<u8>)) {
    out.push(opcode);
    let length = out.len();
    u64(out, 0);
    let body = out.len();
    write(out);
    let written = (out.len() - body) as u64;
    out[length..body].copy_from_slice(&written.to_le_bytes());
}

/// The fields of a message before its data.
#[derive(Clone, Copy)]
pub(crate) struct MessageHeader {
    pub channel: u16,
    pub sequence: u32,
    pub log_time: u64,
    pub publish_time: u64,
}

/// Length of a message's record.
pub(crate) fn message_length(data: &[u8]) -> usize {
    PREFIX + MESSAGE_HEADER + data.len()
}

/// Appends a message's record.
pub(crate) fn message(out: &mut Vec<u8>, header: MessageHeader, data: &[u8]) {
    let mut start = [0; PREFIX + MESSAGE_HEADER];
    let length = (MESSAGE_HEADER + data.len()) as u64;
    start[0] = mcap::records::op::MESSAGE;
    start[1..9].copy_from_slice(&length.to_le_bytes());
    start[9..11].copy_from_slice(&header.channel.to_le_bytes());
    start[11..15].copy_from_slice(&header.sequence.to_le_bytes());
    start[15..23].copy_from_slice(&header.log_time.to_le_bytes());
    start[23..31].copy_from_slice(&header.publish_time.to_le_bytes());
    out.extend_from_slice(&start);
    out.extend_from_slice(data);
}

pub(crate) fn u16(out: &mut Vec<u8>, value: u16) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn u32(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn u64(out: &mut Vec<u8>, value: u64) {
    out.extend_from_slice(&value.to_le_bytes());
}

/// A text or other bytes after their length.
pub(crate) fn bytes(out: &mut Vec<u8>, value: &[u8]) {
    sized(out, |out| out.extend_from_slice(value));
}

/// A map of texts.
pub(crate) fn texts(out: &mut Vec<u8>, map: &BTreeMap<String, String>) {
    for (key, value) in map {
        bytes(out, key.as_bytes());
        bytes(out, value.as_bytes());
    }
}

/// What `write` appends, after its length in 32 bits.
pub(crate) fn sized(out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    let length = out.len();
    u32(out, 0);
    let start = out.len();
    write(out);
    let written = (out.len() - start) as u32;
    out[length..start].copy_from_slice(&written.to_le_bytes());
}
