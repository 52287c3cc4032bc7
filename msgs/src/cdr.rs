//! Messages as plain CDR with the encapsulation header, as they lie in bags and on the wire.

use byteorder::{BigEndian, LittleEndian};
use thiserror::Error;

use crate::RosMessage;

/// Encapsulation header of little-endian plain CDR, the only one written.
pub const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];

/// CDR payloads are padded to four bytes, so that up to this many may follow the message.
const MAX_PADDING: usize = 3;

/// A message that cannot be encoded, or bytes that are not the message they are taken for.
#[derive(Debug, Error)]
pub enum CdrError {
    /// The message could not be encoded.
    #[error("cannot encode {type_name}: {source}")]
    Encode {
        /// Name of the message type.
        type_name: &'static str,
        /// What the encoder says.
        source: cdr_encoding::Error,
    },
    /// Fewer bytes than the encapsulation header has.
    #[error("{type_name}: {length} bytes are too few for the encapsulation header of 4 bytes")]
    TooShort {
        /// Name of the message type.
        type_name: &'static str,
        /// Bytes found.
        length: usize,
    },
    /// An encapsulation other than plain CDR (0x0000, 0x0001).
    #[error("{type_name}: encapsulation {found:#06x}, expected plain CDR: 0x0000 or 0x0001")]
    Encapsulation {
        /// Name of the message type.
        type_name: &'static str,
        /// The encapsulation identifier found.
        found: u16,
    },
    /// The bytes end too early or hold a value that the type cannot have.
    #[error("payload of {length} bytes is no {type_name}: {source}")]
    Decode {
        /// Name of the message type.
        type_name: &'static str,
        /// Bytes found, encapsulation header included.
        length: usize,
        /// What the decoder says.
        source: cdr_encoding::Error,
    },
    /// A message that was recorded with another definition of its type, which may mean other things.
    #[error("recorded with another definition of {type_name}, {found}, expected {expected}")]
    Definition {
        /// Name of the message type.
        type_name: &'static str,
        /// The type hash found.
        found: String,
        /// That of the type.
        expected: &'static str,
    },
    /// More bytes than the message and its padding take.
    #[error(
        "{type_name} ends after {consumed} of {length} bytes, expected at most {MAX_PADDING} bytes of padding"
    )]
    TrailingBytes {
        /// Name of the message type.
        type_name: &'static str,
        /// Bytes that the message takes, encapsulation header included.
        consumed: usize,
        /// Bytes found, encapsulation header included.
        length: usize,
    },
}

/// Encodes a message as little-endian CDR behind its encapsulation header.
///
/// # Errors
/// [`CdrError::Encode`], which no generated message type can cause.
pub fn encode<M: RosMessage>(message: &M) -> Result<Vec<u8>, CdrError> {
    let mut bytes = Vec::new();
    encode_into(&mut bytes, message)?;
    Ok(bytes)
}

/// Appends a message to `bytes` as [`encode`] makes it.
///
/// # Errors
/// As [`encode`]; `bytes` may hold part of the message then.
pub fn encode_into<M: RosMessage>(bytes: &mut Vec<u8>, message: &M) -> Result<(), CdrError> {
    bytes.extend_from_slice(&LITTLE_ENDIAN);
    cdr_encoding::to_writer::<M, LittleEndian, _>(bytes, message).map_err(|source| {
        CdrError::Encode {
            type_name: M::TYPE_NAME,
            source,
        }
    })
}

/// Decodes a message from CDR of either byte order behind its encapsulation header.
///
/// Memory is bounded by a small multiple of the payload's length, whatever lengths it claims.
///
/// # Errors
/// All of [`CdrError`] but `Encode`.
pub fn decode<M: RosMessage>(bytes: &[u8]) -> Result<M, CdrError> {
    let (type_name, length) = (M::TYPE_NAME, bytes.len());
    let Some((header, body)) = bytes.split_first_chunk::<4>() else {
        return Err(CdrError::TooShort { type_name, length });
    };
    let decoded = match u16::from_be_bytes([header[0], header[1]]) {
        0 => cdr_encoding::from_bytes::<M, BigEndian>(body),
        1 => cdr_encoding::from_bytes::<M, LittleEndian>(body),
        found => return Err(CdrError::Encapsulation { type_name, found }),
    };
    let (message, consumed) = decoded.map_err(|source| CdrError::Decode {
        type_name,
        length,
        source,
    })?;
    if body.len() - consumed > MAX_PADDING {
        return Err(CdrError::TrailingBytes {
            type_name,
            consumed: consumed + header.len(),
            length,
        });
    }
    Ok(message)
}

/// Earlier definitions of messages, by their type hashes, and the bytes of CDR that the empty fields take which have been
/// appended since.
const EARLIER: [(&str, usize); 1] = [
    // `lgvi_msgs/msg/ControlSequence` without `moment_in_frame`, `wheel_torque` and `thrust`.
    (
        "RIHS01_c21b61dbfe265ac968908f8b0c8689db76273184f3b68f1ec3f6a2494bf7465a",
        12,
    ),
];

/// Decodes a message that was recorded under a type hash, or under none. Fields that an earlier definition lacks are empty.
///
/// # Errors
/// [`CdrError::Definition`] for the hash of another definition, and those of [`decode`].
pub fn decode_recorded<M: RosMessage>(type_hash: &str, bytes: &[u8]) -> Result<M, CdrError> {
    if type_hash.is_empty() || type_hash == M::TYPE_HASH {
        return decode(bytes);
    }
    match appended_since(type_hash) {
        0 => Err(CdrError::Definition {
            type_name: M::TYPE_NAME,
            found: type_hash.to_owned(),
            expected: M::TYPE_HASH,
        }),
        length => decode(&[bytes, &vec![0; length]].concat()),
    }
}

/// A message that was recorded under a type hash, with the empty fields that its definition lacks, if it is an earlier one.
pub fn completed(type_hash: &str, mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.resize(bytes.len() + appended_since(type_hash), 0);
    bytes
}

fn appended_since(type_hash: &str) -> usize {
    let mut earlier = EARLIER.iter();
    earlier
        .find(|(hash, _)| *hash == type_hash)
        .map_or(0, |(_, length)| *length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        builtin_interfaces::Time,
        diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue},
        msg::{BodyState, ControlSequence, SystemState},
        nav_msgs::Odometry,
        std_msgs::{Header, String as StringMessage},
    };

    #[test]
    fn a_sequence_of_an_earlier_definition_lacks_the_last_fields() {
        let sequence = ControlSequence {
            body: "chaser".into(),
            feedback: vec![1.0, 2.0],
            ..ControlSequence::default()
        };
        let bytes = encode(&sequence).unwrap();
        let (hash, length) = EARLIER[0];
        let old = &bytes[..bytes.len() - length];
        assert!(decode::<ControlSequence>(old).is_err());
        let found: ControlSequence = decode_recorded(hash, old).unwrap();
        assert_eq!(found, sequence);
        assert_eq!(completed(hash, old.to_vec()), bytes);
        assert_eq!(completed(ControlSequence::TYPE_HASH, bytes.clone()), bytes);
        let found: ControlSequence = decode_recorded("", &bytes).unwrap();
        assert_eq!(found, sequence);
        let refused = decode_recorded::<ControlSequence>("RIHS01_1", &bytes).unwrap_err();
        assert!(
            refused
                .to_string()
                .starts_with("recorded with another definition of lgvi_msgs/msg/ControlSequence, RIHS01_1, expected RIHS01_"),
            "{refused}"
        );
    }

    fn diagnostics() -> DiagnosticArray {
        let value = KeyValue {
            key: "steps".to_owned(),
            value: "12".to_owned(),
        };
        let status = DiagnosticStatus {
            level: DiagnosticStatus::WARN,
            name: "propagator".to_owned(),
            values: vec![value; 3],
            ..Default::default()
        };
        DiagnosticArray {
            status: vec![status; 2],
            ..Default::default()
        }
    }

    #[test]
    fn layout_is_that_of_the_standard() {
        let header = Header {
            stamp: Time {
                sec: 1,
                nanosec: 0x0203,
            },
            frame_id: "ab".to_owned(),
        };
        let expected = b"\x00\x01\x00\x00\x01\x00\x00\x00\x03\x02\x00\x00\x03\x00\x00\x00ab\x00";
        assert_eq!(encode(&header).unwrap(), expected);

        let big_endian = b"\x00\x00\x00\x00\x00\x00\x00\x01\x00\x00\x02\x03\x00\x00\x00\x03ab\x00";
        assert_eq!(decode::<Header>(big_endian).unwrap(), header);
    }

    #[test]
    fn padding_is_accepted_and_more_is_not() {
        let message = StringMessage {
            data: "x".to_owned(),
        };
        let mut bytes = encode(&message).unwrap();
        bytes.extend([0; 3]);
        assert_eq!(decode::<StringMessage>(&bytes).unwrap(), message);
        bytes.push(0);
        assert!(matches!(
            decode::<StringMessage>(&bytes),
            Err(CdrError::TrailingBytes {
                consumed: 10,
                length: 14,
                ..
            })
        ));
    }

    #[test]
    fn other_encapsulations_are_refused() {
        assert!(matches!(
            decode::<Header>(&[0, 3, 0, 0, 0, 0, 0, 0]),
            Err(CdrError::Encapsulation { found: 3, .. })
        ));
        for length in 0..4 {
            let bytes = vec![0; length];
            assert!(
                matches!(decode::<Header>(&bytes), Err(CdrError::TooShort { length: found, .. }) if found == length)
            );
        }
    }

    fn every_truncation_is_an_error<M: RosMessage>(message: &M) {
        let bytes = encode(message).unwrap();
        for length in 0..bytes.len() {
            assert!(
                decode::<M>(&bytes[..length]).is_err(),
                "{length} of {} bytes",
                bytes.len()
            );
        }
    }

    #[test]
    fn truncated_payloads_are_errors() {
        every_truncation_is_an_error(&diagnostics());
        every_truncation_is_an_error(&Odometry::default());
        let bodies = vec![BodyState {
            name: "chaser".to_owned(),
            ..Default::default()
        }];
        every_truncation_is_an_error(&SystemState {
            bodies,
            ..Default::default()
        });
    }
}
