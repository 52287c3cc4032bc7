//! Parts of a bag's description.

use serde::{Deserialize, Deserializer, Serialize, de::Error};
use serde_yaml_ng::{Number, Value};

/// What rosbag2 writes as the starting time of a bag without messages.
const NO_START: u64 = i64::MAX as u64;

#[derive(Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Nanoseconds {
    #[serde(deserialize_with = "not_negative")]
    pub nanoseconds: u64,
}

/// A bag without messages ends, as some recorders write it, before it begins.
fn not_negative<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    let number = Number::deserialize(deserializer)?;
    let negative = number.as_i64().filter(|number| *number < 0).map(|_| 0);
    let expected = || D::Error::custom(format!("{number}, expected a whole number"));
    number.as_u64().or(negative).ok_or_else(expected)
}

#[derive(Clone, Copy, Serialize, Deserialize)]
pub(crate) struct NanosecondsSinceEpoch {
    pub nanoseconds_since_epoch: u64,
}

#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct TopicWithCount {
    pub topic_metadata: TopicMetadata,
    pub message_count: u64,
}

#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct TopicMetadata {
    pub name: String,
    pub r#type: String,
    /// Readers take it from the MCAP file instead.
    pub serialization_format: String,
    /// A list of profiles; up to version 8 a text. Readers take it from the MCAP file instead.
    #[serde(default)]
    pub offered_qos_profiles: Value,
    #[serde(default)]
    pub type_description_hash: String,
}

#[derive(Serialize, Deserialize)]
pub(crate) struct FileInformation {
    pub path: String,
    pub starting_time: NanosecondsSinceEpoch,
    pub duration: Nanoseconds,
    pub message_count: u64,
}

/// A file of a bag.
#[derive(Clone)]
pub(crate) struct File {
    pub name: String,
    /// First and last log time (ns).
    pub times: Option<(u64, u64)>,
    pub messages: u64,
}

impl FileInformation {
    pub fn new(file: &File) -> Self {
        let (starting_time, duration) = span(file.times);
        Self {
            path: file.name.clone(),
            starting_time,
            duration,
            message_count: file.messages,
        }
    }
}

/// Starting time and duration.
pub(crate) fn span(times: Option<(u64, u64)>) -> (NanosecondsSinceEpoch, Nanoseconds) {
    let (start, end) = times.unwrap_or((NO_START, NO_START));
    let start_time = NanosecondsSinceEpoch {
        nanoseconds_since_epoch: start,
    };
    let duration = Nanoseconds {
        nanoseconds: end - start,
    };
    (start_time, duration)
}
