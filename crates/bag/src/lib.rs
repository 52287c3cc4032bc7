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
//!     definition_encoding: lgvi_bag::ROS2MSG.to_owned(),
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
mod metadata;
mod new_directory;
mod qos;
mod read;
mod record;
mod recover;
mod times;
mod topic;
mod write;
mod yaml;

pub use error::{BagError, Damage, RecoverError, Rest, WriteError};
pub use new_directory::NewDirectory;
pub use qos::{History, Qos};
pub use read::{BagFile, BagReader, Chunks, Message, Messages};
pub use recover::{LeftOut, RecoveredFile, Recovery, recover, recover_in_place};
pub use topic::{LeftOutTopic, Topic};
pub use write::{BagOptions, BagSummary, BagWriter, Compression, TopicId};

/// Name of rosbag2's description of a bag inside the bag's directory.
const METADATA_FILE: &str = "metadata.yaml";

/// Encoding of all messages.
const SERIALIZATION_FORMAT: &str = "cdr";

/// Encoding of message definitions as texts of `.msg` files.
pub const ROS2MSG: &str = "ros2msg";

/// Name of the MCAP metadata record that tells which messages are repeated from an earlier file of the bag: topics and
/// how many of their first messages are.
const REPEATED: &str = "lgvi_repeated";

/// Name of the MCAP metadata record with a bag's custom data as they were while the file was written: keys and values.
/// The last one of a file counts.
const CUSTOM_DATA: &str = "lgvi_custom_data";

/// MCAP profile of ROS 2 bags.
const PROFILE: &str = "ros2";

/// Keys of an MCAP channel's metadata, as rosbag2 writes them.
mod channel_key {
    pub const QOS: &str = "offered_qos_profiles";
    pub const TYPE_HASH: &str = "topic_type_hash";
}
