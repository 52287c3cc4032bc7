//! What goes beside each payload: number, time and publisher.

use ::zenoh::bytes::ZBytes;
use zenoh_ext::{ZDeserializeError, ZDeserializer, ZSerializer};

use crate::{
    ros::{Sample, SampleInfo, WriterId, arrivals::UNNUMBERED},
    wall,
};

/// Sequence number from 1, nanoseconds since the UNIX epoch, and the identity of the publisher or the client.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Attachment {
    pub(super) sequence: i64,
    pub(super) time: i64,
    pub(super) gid: [u8; 16],
}

/// Of a publisher that is no node of ROS 2.
const NOBODY: Attachment = Attachment {
    sequence: UNNUMBERED as i64,
    time: 0,
    gid: [0; 16],
};

impl Attachment {
    pub(super) fn read(bytes: Option<&ZBytes>) -> Option<Self> {
        let read = |bytes| -> Result<Self, ZDeserializeError> {
            let mut bytes = ZDeserializer::new(bytes);
            Ok(Self {
                sequence: bytes.deserialize()?,
                time: bytes.deserialize()?,
                gid: bytes.deserialize()?,
            })
        };
        bytes.and_then(|bytes| read(bytes).ok())
    }

    pub(super) fn writer(&self) -> WriterId {
        WriterId(self.gid)
    }

    /// Where what it goes beside, and arrives now, comes from.
    pub(super) fn info(&self) -> SampleInfo {
        SampleInfo {
            writer: self.writer(),
            sequence: self.sequence.unsigned_abs(),
            source_time: Some(self.time),
            received_time: wall::now(),
            related: None,
        }
    }
}

/// A sample as it has arrived.
pub(super) fn taken(sample: &::zenoh::sample::Sample) -> Sample<Vec<u8>> {
    let attachment = Attachment::read(sample.attachment());
    Sample {
        message: sample.payload().to_bytes().into_owned(),
        info: SampleInfo {
            source_time: attachment.map(|attachment| attachment.time),
            ..attachment.unwrap_or(NOBODY).info()
        },
    }
}

impl From<Attachment> for ZBytes {
    fn from(attachment: Attachment) -> Self {
        let mut bytes = ZSerializer::new();
        bytes.serialize(attachment.sequence);
        bytes.serialize(attachment.time);
        bytes.serialize(attachment.gid);
        bytes.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attachments_are_those_of_rmw_zenoh() {
        let attachment = Attachment {
            sequence: 7,
            time: -2,
            gid: [3; 16],
        };
        let bytes = ZBytes::from(attachment);
        let mut expected = vec![7, 0, 0, 0, 0, 0, 0, 0, 0xfe];
        expected.extend([0xff; 7]);
        expected.push(16);
        expected.extend([3; 16]);
        assert_eq!(bytes.to_bytes(), expected);
        assert_eq!(Attachment::read(Some(&bytes)), Some(attachment));
        assert_eq!(Attachment::read(None), None);
        for length in 0..expected.len() {
            let short = ZBytes::from(expected[..length].to_vec());
            assert_eq!(Attachment::read(Some(&short)), None, "{length}");
        }
    }
}
