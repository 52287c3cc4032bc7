//! The RTPS messages that the node sends itself, beside those of RustDDS.

use rustdds::GUID;

/// Protocol version 2.4, and the vendor's number of RustDDS.
const VERSION: [u8; 2] = [2, 4];
const VENDOR: [u8; 2] = [1, 18];

/// What the identities of the participants of a vendor begin with.
pub(super) const FAST_DDS: [u8; 2] = [1, 15];
pub(super) const CYCLONE_DDS: [u8; 2] = [1, 16];

const LITTLE_ENDIAN: u8 = 0b01;
/// In an ACKNACK or a HEARTBEAT: no answer is needed.
const FINAL: u8 = 0b10;
/// In DATA.
const INLINE_QOS: u8 = 0b10;
const KEY: u8 = 0b1000;

/// What DATA about participants begins with: extra flags and where the inline QoS or the payload begins; the built-in
/// reader and writer (RTPS 2.5, 9.3.1.5).
const PARTICIPANT_DATA: [u8; 12] = [0, 0, 16, 0, 0, 1, 0, 0xc7, 0, 1, 0, 0xc2];

/// To the participant of `writer` from itself, in the name of `reader`: all samples before `before` are received.
pub(super) fn acknowledgment(writer: GUID, reader: GUID, before: i64, count: i32) -> Vec<u8> {
    let (writer_prefix, writer_id) = parts(writer);
    let (reader_prefix, reader_id) = parts(reader);
    let mut message = in_the_name_of(writer_prefix, reader_prefix);
    let received = [
        &reader_id[..],
        &writer_id,
        &sequence_number(before),
        // An empty set of missing ones.
        &0_u32.to_le_bytes(),
        &count.to_le_bytes(),
    ];
    push(
        &mut message,
        0x06,
        LITTLE_ENDIAN | FINAL,
        &received.concat(),
    );
    message
}

/// To the participant of `reader` from itself, in the name of `writer`: its first sample is there, and no answer is needed if
/// the reader has it.
pub(super) fn first_sample(writer: GUID, reader: GUID) -> Vec<u8> {
    let (writer_prefix, writer_id) = parts(writer);
    let (reader_prefix, reader_id) = parts(reader);
    let mut message = in_the_name_of(reader_prefix, writer_prefix);
    let heartbeat = [
        &reader_id[..],
        &writer_id,
        &sequence_number(1),
        &sequence_number(1),
        // The count.
        &1_i32.to_le_bytes(),
    ];
    push(
        &mut message,
        0x07,
        LITTLE_ENDIAN | FINAL,
        &heartbeat.concat(),
    );
    message
}

/// From `writer` to the participant of `reader`: no sample before `before` will come.
pub(super) fn gap(writer: GUID, reader: GUID, before: i64) -> Vec<u8> {
    let (writer_prefix, writer_id) = parts(writer);
    let (reader_prefix, reader_id) = parts(reader);
    let mut message = header(writer_prefix);
    push(&mut message, 0x0e, LITTLE_ENDIAN, &reader_prefix);
    let irrelevant = [
        &reader_id[..],
        &writer_id,
        &sequence_number(1),
        &sequence_number(before),
        &0_u32.to_le_bytes(),
    ];
    push(&mut message, 0x08, LITTLE_ENDIAN, &irrelevant.concat());
    message
}

/// To `participant` from itself, in the name of `other`, another participant: somebody leaves, it is not said who; then
/// that one leaves.
pub(super) fn departures(participant: GUID, other: GUID) -> Vec<u8> {
    let mut message = in_the_name_of(parts(participant).0, parts(other).0);
    let nobody = [
        &PARTICIPANT_DATA[..],
        &sequence_number(1),
        &[0, 3, 0, 0],
        &[1, 0, 0, 0],
    ];
    push(&mut message, 0x15, LITTLE_ENDIAN | KEY, &nobody.concat());
    let departure = [
        &PARTICIPANT_DATA[..],
        &sequence_number(2),
        // A parameter list in little-endian CDR: PID_PARTICIPANT_GUID, PID_SENTINEL (RTPS 2.5, 9.4.2.11 and 9.6.3).
        &[0, 3, 0, 0],
        &[0x50, 0, 16, 0],
        &other.to_bytes(),
        &[1, 0, 0, 0],
    ];
    push(&mut message, 0x15, LITTLE_ENDIAN | KEY, &departure.concat());
    message
}

/// To `participant` from itself, in the name of `other`, another participant: that one is there. It says nothing more, so
/// that nothing of what is known of it changes.
pub(super) fn sign_of_life(participant: GUID, other: [u8; 12]) -> Vec<u8> {
    let mut message = in_the_name_of(parts(participant).0, other);
    let nothing = [&PARTICIPANT_DATA[..], &sequence_number(1)];
    push(&mut message, 0x15, LITTLE_ENDIAN, &nothing.concat());
    message
}

/// From `participant` to all others: it leaves.
///
/// RustDDS 0.15 says so in another way, without the key hash by which Fast DDS would know of whom it is said.
pub(super) fn departure(participant: GUID) -> Vec<u8> {
    let (prefix, _) = parts(participant);
    let mut message = header(prefix);
    let departure = [
        &PARTICIPANT_DATA[..],
        // Later than anything that RustDDS has announced.
        &sequence_number(1 << 40),
        // PID_KEY_HASH, PID_STATUS_INFO (disposed and unregistered), PID_SENTINEL (9.6.3).
        &[0x70, 0, 16, 0],
        &participant.to_bytes(),
        &[0x71, 0, 4, 0, 0, 0, 0, 0b11],
        &[1, 0, 0, 0],
    ];
    push(
        &mut message,
        0x15,
        LITTLE_ENDIAN | INLINE_QOS,
        &departure.concat(),
    );
    message
}

/// The participant's prefix and the entity's identifier.
fn parts(endpoint: GUID) -> ([u8; 12], [u8; 4]) {
    let mut parts = ([0; 12], [0; 4]);
    let bytes = endpoint.to_bytes();
    parts.0.copy_from_slice(&bytes[..12]);
    parts.1.copy_from_slice(&bytes[12..]);
    parts
}

fn header(prefix: [u8; 12]) -> Vec<u8> {
    [b"RTPS", &VERSION[..], &VENDOR, &prefix].concat()
}

/// A message of `participant` to itself that says that what follows is another's (INFO_SRC: RTPS 2.5, 8.3.8.9), so that
/// nothing is learnt about where that one is.
fn in_the_name_of(participant: [u8; 12], other: [u8; 12]) -> Vec<u8> {
    let mut message = header(participant);
    let source = [&[0; 4], &VERSION[..], &VENDOR, &other].concat();
    push(&mut message, 0x0c, LITTLE_ENDIAN, &source);
    message
}

fn push(message: &mut Vec<u8>, kind: u8, flags: u8, body: &[u8]) {
    // All messages have fixed lengths, of less than a hundred bytes.
    message.extend([kind, flags, body.len() as u8, 0]);
    message.extend(body);
}

/// High half first, each half little-endian.
fn sequence_number(number: i64) -> [u8; 8] {
    let mut bytes = number.to_le_bytes();
    bytes.rotate_left(4);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guid(prefix: u8, entity: u8) -> GUID {
        let mut bytes = [prefix; 16];
        bytes[12..].fill(entity);
        GUID::from_bytes(bytes)
    }

    /// RTPS 2.5, 9.4.5.3 (ACKNACK), 9.4.5.10 (INFO_SRC), with all numbers little-endian.
    #[test]
    fn an_acknowledgment_is_the_reader_s_and_misses_nothing() {
        let message = acknowledgment(guid(1, 2), guid(3, 4), 0x0000_0005_0000_0006, 7);
        let expected: &[&[u8]] = &[
            b"RTPS\x02\x04\x01\x12",
            &[1; 12],
            &[0x0c, 1, 20, 0],
            &[0, 0, 0, 0, 2, 4, 1, 18],
            &[3; 12],
            &[0x06, 3, 24, 0],
            &[4; 4],
            &[2; 4],
            &[5, 0, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0],
            &[7, 0, 0, 0],
        ];
        assert_eq!(message, expected.concat());
    }

    /// RTPS 2.5, 9.4.5.7 (HEARTBEAT).
    #[test]
    fn a_first_sample_is_the_writer_s() {
        let message = first_sample(guid(1, 2), guid(3, 4));
        let expected: &[&[u8]] = &[
            b"RTPS\x02\x04\x01\x12",
            &[3; 12],
            &[0x0c, 1, 20, 0],
            &[0, 0, 0, 0, 2, 4, 1, 18],
            &[1; 12],
            &[0x07, 3, 28, 0],
            &[4; 4],
            &[2; 4],
            &[0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0],
            &[1, 0, 0, 0],
        ];
        assert_eq!(message, expected.concat());
    }

    #[test]
    fn a_departure_of_another_has_its_identity_as_the_key() {
        let message = departures(guid(1, 2), guid(3, 4));
        let expected: &[&[u8]] = &[
            b"RTPS\x02\x04\x01\x12",
            &[1; 12],
            &[0x0c, 1, 20, 0],
            &[0, 0, 0, 0, 2, 4, 1, 18],
            &[3; 12],
            &[0x15, 0b1001, 28, 0],
            &[0, 0, 16, 0],
            &[0x00, 0x01, 0x00, 0xc7, 0x00, 0x01, 0x00, 0xc2],
            &[0, 0, 0, 0, 1, 0, 0, 0],
            &[0, 3, 0, 0, 1, 0, 0, 0],
            &[0x15, 0b1001, 48, 0],
            &[0, 0, 16, 0],
            &[0x00, 0x01, 0x00, 0xc7, 0x00, 0x01, 0x00, 0xc2],
            &[0, 0, 0, 0, 2, 0, 0, 0],
            &[0, 3, 0, 0, 0x50, 0, 16, 0],
            &[3; 12],
            &[4; 4],
            &[1, 0, 0, 0],
        ];
        assert_eq!(message, expected.concat());
    }

    #[test]
    fn a_sign_of_life_has_no_content() {
        let message = sign_of_life(guid(1, 2), [3; 12]);
        let expected: &[&[u8]] = &[
            b"RTPS\x02\x04\x01\x12",
            &[1; 12],
            &[0x0c, 1, 20, 0],
            &[0, 0, 0, 0, 2, 4, 1, 18],
            &[3; 12],
            &[0x15, 0b0001, 20, 0],
            &[0, 0, 16, 0],
            &[0x00, 0x01, 0x00, 0xc7, 0x00, 0x01, 0x00, 0xc2],
            &[0, 0, 0, 0, 1, 0, 0, 0],
        ];
        assert_eq!(message, expected.concat());
    }

    /// RTPS 2.5, 9.4.5.4 (DATA), 9.6.4.9 (status), 9.6.4.8 (key hash).
    #[test]
    fn a_departure_names_who_leaves() {
        let message = departure(guid(1, 2));
        let expected: &[&[u8]] = &[
            b"RTPS\x02\x04\x01\x12",
            &[1; 12],
            &[0x15, 3, 52, 0],
            &[0, 0, 16, 0],
            &[0x00, 0x01, 0x00, 0xc7, 0x00, 0x01, 0x00, 0xc2],
            &[0, 1, 0, 0, 0, 0, 0, 0],
            &[0x70, 0x00, 0x10, 0x00],
            &[1; 12],
            &[2; 4],
            &[0x71, 0x00, 0x04, 0x00, 0, 0, 0, 3],
            &[0x01, 0x00, 0x00, 0x00],
        ];
        assert_eq!(message, expected.concat());
    }

    /// RTPS 2.5, 9.4.5.6 (GAP), 9.4.5.8 (INFO_DST).
    #[test]
    fn a_gap_is_the_writer_s_and_ends_before_the_sample() {
        let message = gap(guid(1, 2), guid(3, 4), 9);
        let expected: &[&[u8]] = &[
            b"RTPS\x02\x04\x01\x12",
            &[1; 12],
            &[0x0e, 1, 12, 0],
            &[3; 12],
            &[0x08, 1, 28, 0],
            &[4; 4],
            &[2; 4],
            &[0, 0, 0, 0, 1, 0, 0, 0],
            &[0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0],
        ];
        assert_eq!(message, expected.concat());
    }
}
