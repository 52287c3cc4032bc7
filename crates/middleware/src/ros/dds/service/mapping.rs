//! How a request and its reply carry the identity that ties them together.

use rustdds::GUID;

use crate::{
    ServiceMapping,
    ros::{
        RequestId, Sample, SampleId, WriterId,
        dds::rtps::{CYCLONE_DDS, FAST_DDS},
    },
};

/// The client's reader of replies, where the request names it.
pub(super) fn reader(id: &RequestId) -> Option<GUID> {
    let client = GUID::from_bytes(id.client);
    let is_guid = id.client[..8] != [0; 8];
    (is_guid && client.entity_id.kind().is_reader()).then_some(client)
}

/// Encapsulation header of a payload, and the identity that Cyclone DDS puts behind it.
const ENCAPSULATION: usize = 4;
const IDENTITY: usize = 16;

/// A related sample identity that names the client's reader only, as Fast DDS sends with requests.
const UNKNOWN_SEQUENCE: i64 = -(1 << 32);

/// A related sample identity that names nobody.
const UNKNOWN_WRITER: WriterId = WriterId([0; 16]);

/// Whether an endpoint's make tells that it takes and gives identities by the other mapping.
pub(super) fn differs(mapping: ServiceMapping, endpoint: [u8; 16]) -> bool {
    endpoint.starts_with(match mapping {
        ServiceMapping::FastDds => &CYCLONE_DDS,
        ServiceMapping::Cyclone => &FAST_DDS,
    })
}

/// What a client sends: the identity is `id`'s where the payload carries it, and otherwise that of the sample itself,
/// beside which the client's reader of replies is named.
pub(super) fn request(
    mapping: ServiceMapping,
    cdr: Vec<u8>,
    id: RequestId,
    reader: GUID,
) -> (Vec<u8>, Option<SampleId>) {
    let named = RequestId {
        client: reader.to_bytes(),
        sequence: UNKNOWN_SEQUENCE,
        ..id
    };
    match mapping {
        ServiceMapping::FastDds => reply(mapping, cdr, named),
        ServiceMapping::Cyclone => reply(mapping, cdr, id),
    }
}

/// What a server sends in reply.
pub(super) fn reply(
    mapping: ServiceMapping,
    cdr: Vec<u8>,
    id: RequestId,
) -> (Vec<u8>, Option<SampleId>) {
    let related = SampleId {
        writer: WriterId(id.client),
        sequence: id.sequence,
    };
    match mapping {
        ServiceMapping::FastDds => (cdr, Some(related)),
        ServiceMapping::Cyclone => (with_identity(cdr, id), None),
    }
}

/// Takes a request apart into its identity and the message; `None` if it is too short to have an identity.
pub(super) fn taken_request(
    mapping: ServiceMapping,
    mut sample: Sample<Vec<u8>>,
) -> Option<(RequestId, Vec<u8>)> {
    // The reader that is named is the client, and the number the sample's own.
    let info = &mut sample.info;
    let named = info.related.map(|related| related.writer);
    let client = named.filter(|writer| *writer != UNKNOWN_WRITER);
    info.related = Some(SampleId {
        writer: client.unwrap_or(info.writer),
        sequence: i64::try_from(info.sequence).ok()?,
    });
    taken_reply(mapping, sample)
}

/// Takes a reply apart, by the same rules.
pub(super) fn taken_reply(
    mapping: ServiceMapping,
    sample: Sample<Vec<u8>>,
) -> Option<(RequestId, Vec<u8>)> {
    let Sample { message, info } = sample;
    match mapping {
        ServiceMapping::FastDds => {
            let related = info.related?;
            let id = RequestId {
                writer: info.writer,
                client: related.writer.0,
                sequence: related.sequence,
            };
            Some((id, message))
        }
        ServiceMapping::Cyclone => without_identity(message, info.writer),
    }
}

/// What a client calls itself in the payload: the end of its GUID.
pub(super) fn cyclone_client(guid: GUID) -> [u8; 16] {
    let mut client = guid.to_bytes();
    client[..8].fill(0);
    client
}

/// Puts the identity between header and message, which keeps the alignment to eight bytes.
fn with_identity(mut cdr: Vec<u8>, id: RequestId) -> Vec<u8> {
    let identity = id.client[8..]
        .iter()
        .copied()
        .chain(id.sequence.to_le_bytes());
    cdr.splice(ENCAPSULATION..ENCAPSULATION, identity);
    cdr
}

fn without_identity(mut cdr: Vec<u8>, writer: WriterId) -> Option<(RequestId, Vec<u8>)> {
    if cdr.len() < ENCAPSULATION + IDENTITY {
        return None;
    }
    let little_endian = cdr[1] & 1 == 1;
    let mut words = [[0; 8]; 2];
    for (byte, taken) in words
        .as_flattened_mut()
        .iter_mut()
        .zip(cdr.drain(ENCAPSULATION..ENCAPSULATION + IDENTITY))
    {
        *byte = taken;
    }
    // Both are numbers to Cyclone DDS; ours are little-endian.
    if !little_endian {
        words.iter_mut().for_each(|word| word.reverse());
    }
    let mut client = [0; 16];
    client[8..].copy_from_slice(&words[0]);
    let id = RequestId {
        writer,
        client,
        sequence: i64::from_le_bytes(words[1]),
    };
    Some((id, cdr))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::SampleInfo;

    fn sample(message: Vec<u8>, related: Option<SampleId>) -> Sample<Vec<u8>> {
        Sample {
            message,
            info: SampleInfo {
                writer: WriterId([3; 16]),
                sequence: 7,
                source_time: None,
                received_time: 0,
                related,
            },
        }
    }

    fn id() -> RequestId {
        RequestId {
            writer: WriterId([3; 16]),
            client: [0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8],
            sequence: 0x0102_0304_0506_0708,
        }
    }

    #[test]
    fn cyclone_has_client_and_number_before_the_message() {
        let (bytes, related) = reply(ServiceMapping::Cyclone, vec![0, 1, 0, 0, 42], id());
        assert_eq!(
            bytes,
            [
                0, 1, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 8, 7, 6, 5, 4, 3, 2, 1, 42
            ]
        );
        assert_eq!(related, None);
        for taken in [taken_request, taken_reply] {
            let taken = taken(ServiceMapping::Cyclone, sample(bytes.clone(), None));
            assert_eq!(taken, Some((id(), vec![0, 1, 0, 0, 42])));
        }
    }

    #[test]
    fn big_endian_identities_are_the_same_numbers() {
        let bytes = vec![0, 0, 0, 0, 8, 7, 6, 5, 4, 3, 2, 1, 1, 2, 3, 4, 5, 6, 7, 8];
        let taken = taken_request(ServiceMapping::Cyclone, sample(bytes, None));
        assert_eq!(taken, Some((id(), vec![0, 0, 0, 0])));
    }

    #[test]
    fn a_vendor_tells_the_mapping() {
        let endpoint = |vendor: u8| {
            let mut endpoint = [7; 16];
            endpoint[..2].copy_from_slice(&[1, vendor]);
            endpoint
        };
        let differing = |vendor| {
            [ServiceMapping::FastDds, ServiceMapping::Cyclone]
                .map(|mapping| differs(mapping, endpoint(vendor)))
        };
        assert_eq!(differing(15), [false, true]);
        assert_eq!(differing(16), [true, false]);
        // RustDDS, which may have either.
        assert_eq!(differing(18), [false, false]);
    }

    #[test]
    fn payloads_without_room_for_an_identity_are_refused() {
        for length in 0..ENCAPSULATION + IDENTITY {
            let sample = sample(vec![0; length], None);
            assert_eq!(taken_request(ServiceMapping::Cyclone, sample), None);
        }
        let sample = sample(vec![0; 30], None);
        assert_eq!(taken_reply(ServiceMapping::FastDds, sample), None);
    }

    #[test]
    fn fast_dds_replies_to_the_named_reader_and_the_sample_s_number() {
        let replies = GUID::from_bytes([4; 16]);
        let (bytes, related) = request(ServiceMapping::FastDds, vec![0, 1, 0, 0], id(), replies);
        assert_eq!(bytes, [0, 1, 0, 0]);
        let (id, _) = taken_request(ServiceMapping::FastDds, sample(bytes, related)).unwrap();
        assert_eq!((id.client, id.sequence), ([4; 16], 7));
        assert_eq!(reader(&id), Some(replies));
        let (_, related) = reply(ServiceMapping::FastDds, Vec::new(), id);
        let expected = SampleId {
            writer: WriterId([4; 16]),
            sequence: 7,
        };
        assert_eq!(related, Some(expected));
        // Without a reader, the writer of the request stands for the client.
        let nobody = SampleId {
            writer: UNKNOWN_WRITER,
            sequence: UNKNOWN_SEQUENCE,
        };
        for related in [None, Some(nobody)] {
            let sample = sample(Vec::new(), related);
            let (id, _) = taken_request(ServiceMapping::FastDds, sample).unwrap();
            assert_eq!((id.client, id.sequence), ([3; 16], 7));
            assert_eq!(reader(&id), None);
        }
    }
}
