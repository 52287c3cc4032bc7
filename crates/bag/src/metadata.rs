//! `metadata.yaml`, field by field as rosbag2 (Jazzy, `rosbag2_storage/yaml.hpp`) writes it.

use std::{collections::BTreeMap, fs, path::Path};

use serde::{Deserialize, Serialize};
use serde_yaml_ng::Value;

use crate::{BagError, METADATA_FILE, SERIALIZATION_FORMAT, Topic, WriteError};

/// The version that Jazzy writes, and the newest known.
const VERSION: u32 = 9;

const STORAGE: &str = "mcap";

/// The distribution whose message definitions and format are written.
const ROS_DISTRO: &str = "jazzy";

/// What rosbag2 writes as the starting time of a bag without messages.
const NO_START: u64 = i64::MAX as u64;

#[derive(Serialize, Deserialize)]
struct Document {
    rosbag2_bagfile_information: Metadata,
}

/// A bag's description.
#[derive(Serialize, Deserialize)]
pub(crate) struct Metadata {
    version: u32,
    storage_identifier: String,
    duration: Nanoseconds,
    starting_time: NanosecondsSinceEpoch,
    message_count: u64,
    topics_with_message_count: Vec<TopicWithCount>,
    #[serde(default)]
    compression_format: String,
    #[serde(default)]
    compression_mode: String,
    pub(crate) relative_file_paths: Vec<String>,
    #[serde(default)]
    files: Vec<FileInformation>,
    #[serde(default)]
    custom_data: Option<BTreeMap<String, String>>,
    #[serde(default)]
    ros_distro: String,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
struct Nanoseconds {
    nanoseconds: u64,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
struct NanosecondsSinceEpoch {
    nanoseconds_since_epoch: u64,
}

#[derive(Serialize, Deserialize)]
struct TopicWithCount {
    topic_metadata: TopicMetadata,
    message_count: u64,
}

#[derive(Serialize, Deserialize)]
struct TopicMetadata {
    name: String,
    r#type: String,
    serialization_format: String,
    /// A list of profiles; up to version 8 a text. Readers take it from the MCAP file instead.
    #[serde(default)]
    offered_qos_profiles: Value,
    #[serde(default)]
    type_description_hash: String,
}

#[derive(Serialize, Deserialize)]
struct FileInformation {
    path: String,
    starting_time: NanosecondsSinceEpoch,
    duration: Nanoseconds,
    message_count: u64,
}

impl Metadata {
    /// Describes a bag of one file with the given topics and their message counts; `times` are the first and the last
    /// log time.
    pub(crate) fn new(
        file_name: &str,
        topics: &[(Topic, u64)],
        times: Option<(u64, u64)>,
        custom: BTreeMap<String, String>,
    ) -> Result<Self, serde_yaml_ng::Error> {
        let (start, end) = times.unwrap_or((NO_START, NO_START));
        let duration = Nanoseconds {
            nanoseconds: end - start,
        };
        let starting_time = NanosecondsSinceEpoch {
            nanoseconds_since_epoch: start,
        };
        let message_count = topics.iter().map(|(_, count)| count).sum();
        let topics_with_message_count = topics
            .iter()
            .map(|(topic, count)| {
                Ok(TopicWithCount {
                    topic_metadata: TopicMetadata {
                        name: topic.name.clone(),
                        r#type: topic.type_name.clone(),
                        serialization_format: SERIALIZATION_FORMAT.to_owned(),
                        offered_qos_profiles: serde_yaml_ng::to_value([topic.qos.profile()])?,
                        type_description_hash: topic.type_hash.clone(),
                    },
                    message_count: *count,
                })
            })
            .collect::<Result<_, serde_yaml_ng::Error>>()?;
        Ok(Self {
            version: VERSION,
            storage_identifier: STORAGE.to_owned(),
            duration,
            starting_time,
            message_count,
            topics_with_message_count,
            compression_format: String::new(),
            compression_mode: String::new(),
            relative_file_paths: vec![file_name.to_owned()],
            files: vec![FileInformation {
                path: file_name.to_owned(),
                starting_time,
                duration,
                message_count,
            }],
            custom_data: Some(custom).filter(|custom| !custom.is_empty()),
            ros_distro: ROS_DISTRO.to_owned(),
        })
    }

    /// The text that rosbag2 puts into the MCAP file.
    pub(crate) fn to_yaml(&self) -> Result<String, serde_yaml_ng::Error> {
        serde_yaml_ng::to_string(self)
    }

    /// Writes `metadata.yaml` into a bag's directory, at once or not at all.
    pub(crate) fn write(self, directory: &Path) -> Result<(), WriteError> {
        let text = serde_yaml_ng::to_string(&Document {
            rosbag2_bagfile_information: self,
        })?;
        let path = directory.join(METADATA_FILE);
        let unfinished = path.with_extension("yaml.tmp");
        fs::write(&unfinished, text)
            .and_then(|()| fs::rename(&unfinished, &path))
            .map_err(|source| WriteError::Io { path, source })
    }

    /// Reads `metadata.yaml` and refuses what this crate cannot read.
    pub(crate) fn read(file: &Path) -> Result<Self, BagError> {
        #[derive(Deserialize)]
        struct VersionedDocument {
            rosbag2_bagfile_information: Versioned,
        }
        #[derive(Deserialize)]
        struct Versioned {
            version: u32,
        }

        let io_error = |source| BagError::Io {
            path: file.to_owned(),
            source,
        };
        let yaml_error = |source| BagError::Metadata {
            file: file.to_owned(),
            source,
        };
        let text = fs::read_to_string(file).map_err(io_error)?;
        let versioned: VersionedDocument = serde_yaml_ng::from_str(&text).map_err(yaml_error)?;
        let found = versioned.rosbag2_bagfile_information.version;
        if found > VERSION {
            return Err(BagError::MetadataVersion {
                file: file.to_owned(),
                found,
                newest: VERSION,
            });
        }
        let document: Document = serde_yaml_ng::from_str(&text).map_err(yaml_error)?;
        let metadata = document.rosbag2_bagfile_information;
        metadata.check(file)?;
        Ok(metadata)
    }

    fn check(&self, file: &Path) -> Result<(), BagError> {
        if self.storage_identifier != STORAGE {
            let found = self.storage_identifier.clone();
            return Err(BagError::Storage {
                file: file.to_owned(),
                found,
            });
        }
        if !["", "none"].contains(&&*self.compression_mode.to_lowercase()) {
            return Err(BagError::Compressed {
                file: file.to_owned(),
                mode: self.compression_mode.clone(),
                format: self.compression_format.clone(),
            });
        }
        for TopicWithCount {
            topic_metadata: topic,
            ..
        } in &self.topics_with_message_count
        {
            if topic.serialization_format != SERIALIZATION_FORMAT {
                return Err(BagError::Encoding {
                    file: file.to_owned(),
                    topic: topic.name.clone(),
                    field: "serialization_format",
                    found: topic.serialization_format.clone(),
                    expected: SERIALIZATION_FORMAT,
                });
            }
        }
        Ok(())
    }

    /// Number of messages of each topic.
    pub(crate) fn message_counts(&self) -> BTreeMap<&str, u64> {
        let mut counts = BTreeMap::new();
        for topic in &self.topics_with_message_count {
            *counts.entry(&*topic.topic_metadata.name).or_default() += topic.message_count;
        }
        counts
    }

    /// Type hash of a topic; empty if the metadata does not tell.
    pub(crate) fn type_hash(&self, topic: &Topic) -> &str {
        self.topics_with_message_count
            .iter()
            .map(|known| &known.topic_metadata)
            .find(|known| known.name == topic.name && known.r#type == topic.type_name)
            .map_or("", |known| &known.type_description_hash)
    }

    /// What the recorder added.
    pub(crate) fn into_custom(self) -> BTreeMap<String, String> {
        self.custom_data.unwrap_or_default()
    }
}
