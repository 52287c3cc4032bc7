//! ROS 2 messages of lgvi and the standard ones it uses, generated from the `.msg` files beside this crate.
//!
//! - One module per ROS package ([`geometry_msgs`], [`nav_msgs`], …); our own messages are in [`msg`].
//! - [`RosMessage`] and [`lookup`] give type names, hashes and definitions, as bags and peers need them.
//! - [`cdr`] encodes messages as they lie in bags and on the wire.
//! - [`shm`] holds the plain samples that cross shared memory and their conversion to messages.
//! - [`stamp`] converts times.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod cdr;
pub mod shm;
pub mod stamp;

use serde::{Serialize, de::DeserializeOwned};

include!(concat!(env!("OUT_DIR"), "/messages.rs"));

/// A ROS 2 message type.
pub trait RosMessage: Serialize + DeserializeOwned {
    /// Name in the ROS 2 form, `pkg/msg/Type`.
    const TYPE_NAME: &'static str;
    /// REP-2011 type hash, `RIHS01_…`.
    const TYPE_HASH: &'static str;
    /// Text of the `.msg` file followed by those of all messages it needs, as rosbag2 stores it.
    const DEFINITION: &'static str;
}

/// What is known of a message type at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageType {
    /// [`RosMessage::TYPE_NAME`]
    pub name: &'static str,
    /// [`RosMessage::TYPE_HASH`]
    pub hash: &'static str,
    /// [`RosMessage::DEFINITION`]
    pub definition: &'static str,
}

impl MessageType {
    /// Describes the message type `M`.
    pub const fn of<M: RosMessage>() -> Self {
        Self {
            name: M::TYPE_NAME,
            hash: M::TYPE_HASH,
            definition: M::DEFINITION,
        }
    }
}

/// All message types of this crate, ordered by name.
pub fn message_types() -> &'static [MessageType] {
    MESSAGE_TYPES
}

/// Finds a message type by its name in the ROS 2 form, `pkg/msg/Type`.
pub fn lookup(type_name: &str) -> Option<MessageType> {
    MESSAGE_TYPES
        .binary_search_by_key(&type_name, |message_type| message_type.name)
        .ok()
        .map(|index| MESSAGE_TYPES[index])
}
