//! `metadata.yaml`, field by field as rosbag2 (Jazzy, `rosbag2_storage/yaml.hpp`) writes it.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Component, Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use serde_yaml_ng::Value;

use crate::{
    BagError, SERIALIZATION_FORMAT, Topic,
    read::Source,
    times::{Times, around},
    yaml,
};

/// The version that Jazzy writes, and the newest known.
const VERSION: u32 = 9;

/// Metadata up to this version lists files with the directory's name before theirs.
const LAST_WITH_DIRECTORY: u32 = 3;

/// Name and only key of the metadata record in which rosbag2 repeats the description in each file.
pub(crate) const RECORD: (&str, &str) = ("rosbag2", "serialized_metadata");

/// How many of the files before it the record of a file lists.
pub(crate) const LISTED: usize = 64;

const STORAGE: &str = "mcap";

/// The distribution whose message definitions and format are written.
const ROS_DISTRO: &str = "jazzy";

/// What rosbag2 writes as the starting time of a bag without messages.
const NO_START: u64 = i64::MAX as u64;

/// The document in `metadata.yaml`.
#[derive(Serialize, Deserialize)]
struct Document<T> {
    rosbag2_bagfile_information: T,
}

/// A bag's description.
#[derive(Serialize, Deserialize)]
pub(crate) struct Metadata {
    pub version: u32,
    storage_identifier: String,
    duration: Nanoseconds,
    starting_time: NanosecondsSinceEpoch,
    pub message_count: u64,
    topics_with_message_count: Vec<TopicWithCount>,
    #[serde(default)]
    compression_format: String,
    /// How rosbag2 compressed whole files or messages itself (MCAP's own chunk compression is read).
    #[serde(default)]
    compression_mode: String,
    pub relative_file_paths: Vec<String>,
    #[serde(default)]
    files: Vec<File>,
    #[serde(default)]
    custom_data: Option<BTreeMap<String, String>>,
    #[serde(default)]
    ros_distro: String,
}

/// A file of a bag.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct File {
    pub path: String,
    starting_time: NanosecondsSinceEpoch,
    duration: Nanoseconds,
    message_count: u64,
    #[serde(skip)]
    times: Times,
}

#[derive(Clone, Serialize, Deserialize)]
struct TopicWithCount {
    topic_metadata: TopicMetadata,
    message_count: u64,
}

/// Readers take the encoding and the quality of service from the MCAP file instead.
#[derive(Clone, Serialize, Deserialize)]
struct TopicMetadata {
    name: String,
    r#type: String,
    serialization_format: String,
    /// A list of profiles; up to version 8 a text.
    #[serde(default)]
    offered_qos_profiles: Value,
    #[serde(default)]
    type_description_hash: String,
}

/// A bag without messages ends, as some recorders write it, before it begins.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Nanoseconds {
    nanoseconds: i128,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
struct NanosecondsSinceEpoch {
    nanoseconds_since_epoch: u64,
}

/// Starting time and duration.
fn span(times: Times) -> (NanosecondsSinceEpoch, Nanoseconds) {
    let (start, end) = times.unwrap_or((NO_START, NO_START));
    let start_time = NanosecondsSinceEpoch {
        nanoseconds_since_epoch: start,
    };
    let nanoseconds = i128::from(end) - i128::from(start);
    (start_time, Nanoseconds { nanoseconds })
}

impl File {
    pub fn new(path: String, times: Times, message_count: u64) -> Self {
        let (starting_time, duration) = span(times);
        Self {
            path,
            starting_time,
            duration,
            message_count,
            times,
        }
    }
}

impl Metadata {
    /// Describes a bag of files and of topics with their message counts.
    pub fn new<'a>(
        files: Vec<File>,
        topics: impl Iterator<Item = (&'a Topic, u64)>,
        custom: BTreeMap<String, String>,
    ) -> Result<Self, serde_yaml_ng::Error> {
        let topics = topics.map(|(topic, message_count)| {
            Ok(TopicWithCount {
                topic_metadata: TopicMetadata {
                    name: topic.name.clone(),
                    r#type: topic.type_name.clone(),
                    serialization_format: SERIALIZATION_FORMAT.to_owned(),
                    offered_qos_profiles: serde_yaml_ng::to_value([topic.qos.profile()])?,
                    type_description_hash: topic.type_hash.clone(),
                },
                message_count,
            })
        });
        let (starting_time, duration) = span(around(files.iter().filter_map(|file| file.times)));
        Ok(Self {
            version: VERSION,
            storage_identifier: STORAGE.to_owned(),
            duration,
            starting_time,
            message_count: files.iter().map(|file| file.message_count).sum(),
            topics_with_message_count: topics.collect::<Result<_, serde_yaml_ng::Error>>()?,
            compression_format: String::new(),
            compression_mode: String::new(),
            relative_file_paths: files.iter().map(|file| file.path.clone()).collect(),
            files,
            custom_data: Some(custom).filter(|custom| !custom.is_empty()),
            ros_distro: ROS_DISTRO.to_owned(),
        })
    }

    /// The text that rosbag2 puts into the MCAP file: with the counts of the whole bag so far, but only so many of the files
    /// before that one, for many files would else consist of lists of each other.
    pub fn into_yaml(mut self) -> Result<String, serde_yaml_ng::Error> {
        let surplus = self.files.len().saturating_sub(LISTED + 1);
        self.files.drain(..surplus);
        self.relative_file_paths.drain(..surplus);
        serde_yaml_ng::to_string(&self)
    }

    /// Writes `metadata.yaml` at `path`, at once or not at all.
    pub fn write(self, path: &Path) -> io::Result<()> {
        let text = serde_yaml_ng::to_string(&Document {
            rosbag2_bagfile_information: self,
        });
        let text = text.map_err(io::Error::other)?;
        let unfinished = path.with_extension("yaml.tmp");
        let written = fs::write(&unfinished, text).and_then(|()| fs::rename(&unfinished, path));
        if written.is_err() {
            let _ = fs::remove_file(&unfinished);
        }
        written
    }

    /// Reads `metadata.yaml` and refuses what this crate cannot read, and files that are compressed as a whole unless they
    /// may be.
    pub fn read(file: &Path, may_be_compressed: bool) -> Result<Self, BagError> {
        #[derive(Deserialize)]
        struct Versioned {
            version: u32,
            #[serde(default)]
            storage_identifier: Option<String>,
        }

        let yaml_error = |error: serde_yaml_ng::Error| BagError::invalid(file, error.to_string());
        let text = Source::open_damaged(file)?.bytes(0, yaml::MAX_TEXT as u64 + 1)?;
        let text =
            String::from_utf8(text).map_err(|error| BagError::invalid(file, error.to_string()))?;
        let versioned: Document<Versioned> = yaml::read(&text).map_err(yaml_error)?;
        let versioned = versioned.rosbag2_bagfile_information;
        let storage = versioned.storage_identifier;
        let refused = |found: String| BagError::Storage {
            file: file.to_owned(),
            found,
        };
        if let Some(storage) = storage.filter(|storage| storage != STORAGE) {
            return Err(refused(storage));
        }
        if versioned.version > VERSION {
            let found = versioned.version;
            let reason = format!("version is {found}, expected at most {VERSION}");
            return Err(BagError::invalid(file, reason));
        }
        let document: Document<Self> = yaml::read(&text).map_err(yaml_error)?;
        let metadata = document.rosbag2_bagfile_information;
        // Files and messages that are compressed with zstd are known by their first bytes.
        let (mode, format) = (&metadata.compression_mode, &*metadata.compression_format);
        match (&*mode.to_lowercase(), format) {
            ("" | "none", _) | ("message", "zstd") => Ok(metadata),
            ("file", "zstd") if may_be_compressed => Ok(metadata),
            _ => Err(BagError::Compressed {
                file: file.to_owned(),
                mode: mode.clone(),
                format: format.to_owned(),
            }),
        }
    }

    /// Number of messages of each topic.
    pub fn message_counts(&self) -> BTreeMap<&str, u64> {
        let mut counts = BTreeMap::new();
        for topic in &self.topics_with_message_count {
            let count: &mut u64 = counts.entry(&*topic.topic_metadata.name).or_default();
            *count = count.saturating_add(topic.message_count);
        }
        counts
    }

    /// Number of messages in each file, by its path relative to the bag's directory.
    pub fn file_counts(&self) -> BTreeMap<PathBuf, u64> {
        let files = self.files.iter();
        let counts =
            files.filter_map(|file| Some((within(&file.path, self.version)?, file.message_count)));
        counts.collect()
    }

    /// Hash of each topic's type by the topic's name and type.
    pub fn type_hashes(&self) -> BTreeMap<(&str, &str), &str> {
        let topics = self.topics_with_message_count.iter().rev();
        let hashes = topics.map(|TopicWithCount { topic_metadata, .. }| {
            let key = (&*topic_metadata.name, &*topic_metadata.r#type);
            (key, &*topic_metadata.type_description_hash)
        });
        hashes.collect()
    }

    /// What the recorder added.
    pub fn into_custom(self) -> BTreeMap<String, String> {
        self.custom_data.unwrap_or_default()
    }
}

/// A listed path relative to the bag's directory, whatever that is called now, if it lies therein.
pub(crate) fn within(listed: &str, version: u32) -> Option<PathBuf> {
    let mut parts = Vec::new();
    for component in Path::new(listed).components() {
        match component {
            Component::Normal(part) => parts.push(part),
            Component::CurDir => {}
            _ => return None,
        }
    }
    if version <= LAST_WITH_DIRECTORY && parts.len() > 1 {
        parts.remove(0);
    }
    (!parts.is_empty()).then(|| parts.into_iter().collect())
}
