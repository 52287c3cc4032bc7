//! CDR of every message type, parts of services and actions included, and the conversions to samples of shared memory.

use std::{collections::BTreeMap, sync::LazyLock};

use lgvi_msgs::{RosMessage, cdr as encoding, msg::SystemState, shm::StateHeader};

type Check = fn(&[u8]);

macro_rules! checks {
    ($($message:ty),* $(,)?) => {
        [$((key(<$message as RosMessage>::TYPE_NAME), check::<$message> as Check)),*]
    };
}

static CHECKS: LazyLock<BTreeMap<[u8; 4], Check>> =
    LazyLock::new(|| BTreeMap::from(lgvi_msgs::for_every_message!(checks)));

/// The first four bytes are the [`key`] of the message type, what follows is its CDR.
pub fn cdr(data: &[u8]) {
    let Some((key, payload)) = data.split_first_chunk::<4>() else {
        return;
    };
    if let Some(check) = CHECKS.get(key) {
        check(payload);
        samples(payload);
    }
}

/// What stands for a message type in the input: a hash of its name (FNV-1a), so that it does not change when types are added.
pub fn key(type_name: &str) -> [u8; 4] {
    let fold = |hash: u32, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
    type_name.bytes().fold(0x811c_9dc5, fold).to_le_bytes()
}

/// What is decoded is encoded to bytes that are decoded to the same. Bytes are compared, as a NaN is no equal of itself.
fn check<M: RosMessage>(payload: &[u8]) {
    let message = match encoding::decode::<M>(payload) {
        Ok(message) => message,
        Err(error) => {
            let _ = error.to_string();
            return;
        }
    };
    let encode = |message: &M| match encoding::encode(message) {
        Ok(bytes) => bytes,
        Err(error) => panic!("{error}"),
    };
    let encoded = encode(&message);
    match encoding::decode::<M>(&encoded) {
        Ok(again) => assert_eq!(encode(&again), encoded, "{}", M::TYPE_NAME),
        Err(error) => panic!("what was encoded is not decoded: {error}"),
    }
}

/// Samples of shared memory become the messages that they were made from, but for the frame, which they do not have.
fn samples(payload: &[u8]) {
    if let Ok(message) = encoding::decode::<SystemState>(payload)
        && let Ok((header, bodies)) = StateHeader::from_message(&message)
    {
        let back = header.to_message(&bodies, &message.header.frame_id);
        assert!(same(&message, back.ok().as_ref()), "{message:?}");
    }
}

fn same<M: RosMessage>(message: &M, other: Option<&M>) -> bool {
    let bytes = |message| encoding::encode(message).ok();
    other.is_some_and(|other| bytes(message) == bytes(other))
}
