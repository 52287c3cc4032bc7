//! rosbag2 directories as ROS 2 Jazzy makes them: MCAP files and a `metadata.yaml` of version 9.
//!
//! Messages are opaque CDR here; `lgvi_msgs` encodes and decodes them. Times are nanoseconds since the UNIX epoch.
//! The crate starts no thread and reads no clock.
//!
//! ```
//! use std::collections::BTreeMap;
//!
//! use lgvi_bag::{BagOptions, BagReader, BagWriter, Qos, Topic};
//! use lgvi_msgs::{RosMessage, cdr, msg::SystemState};
//!
//! # let folder = tempfile::tempdir()?;
//! # let directory = folder.path().join("run");
//! let mut writer = BagWriter::create(&directory, BagOptions::default())?;
//! let topic = writer.add_topic(&Topic {
//!     name: "/lgvi_propagator/state".to_owned(),
//!     type_name: SystemState::TYPE_NAME.to_owned(),
//!     type_hash: SystemState::TYPE_HASH.to_owned(),
//!     definition: SystemState::DEFINITION.to_owned(),
//!     qos: Qos::default(),
//! })?;
//! let state = SystemState { step: 7, ..SystemState::default() };
//! writer.write(topic, 1_000, 1_000, 0, &cdr::encode(&state)?)?;
//! writer.finish(BTreeMap::from([("lgvi_scene".to_owned(), "dumbbells".to_owned())]))?;
//!
//! let bag = BagReader::open(&directory)?;
//! for message in bag.messages() {
//!     let message = message?;
//!     assert_eq!(message.topic.name, "/lgvi_propagator/state");
//!     assert_eq!(cdr::decode::<SystemState>(&message.data)?, state);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod error;
mod mcap_file;
mod metadata;
mod qos;
mod reader;
mod records;
mod topic;
mod writer;

pub use error::{BagError, Damage, WriteError};
pub use qos::{Durability, History, Qos, Reliability};
pub use reader::{BagReader, Message, Messages};
pub use topic::Topic;
pub use writer::{BagOptions, BagSummary, BagWriter, Compression, TopicId};

/// Name of rosbag2's description of a bag inside the bag's directory.
const METADATA_FILE: &str = "metadata.yaml";

/// Encoding of all messages.
const SERIALIZATION_FORMAT: &str = "cdr";

/// Encoding of all message definitions.
const SCHEMA_ENCODING: &str = "ros2msg";

/// MCAP profile of ROS 2 bags.
const PROFILE: &str = "ros2";

/// Keys of an MCAP channel's metadata, as rosbag2 writes them.
mod channel_key {
    pub const QOS: &str = "offered_qos_profiles";
    pub const TYPE_HASH: &str = "topic_type_hash";
}
