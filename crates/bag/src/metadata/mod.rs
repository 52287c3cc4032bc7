//! `metadata.yaml`, field by field as rosbag2 (Jazzy, `rosbag2_storage/yaml.hpp`) writes it.

mod entries;
mod paths;

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

pub(crate) use entries::File;
pub(crate) use paths::within;

use entries::{
    FileInformation, Nanoseconds, NanosecondsSinceEpoch, TopicMetadata, TopicWithCount, span,
};

use crate::{BagError, SERIALIZATION_FORMAT, Topic, regular, times::around, yaml};

/// The version that Jazzy writes, and the newest known.
pub(crate) const VERSION: u32 = 9;

/// Name and only key of the metadata record in which rosbag2 repeats the description in each file.
pub(crate) const RECORD: (&str, &str) = ("rosbag2", "serialized_metadata");

/// How many of the files before it the record of a file lists.
pub(crate) const LISTED: usize = 64;

const STORAGE: &str = "mcap";

/// Key of how rosbag2 compressed whole files or messages itself (MCAP's own chunk compression is read).
pub(crate) const COMPRESSION: &str = "compression_mode";

/// The distribution whose message definitions and format are written.
const ROS_DISTRO: &str = "jazzy";

/// The document in `metadata.yaml`.
#[derive(Serialize, Deserialize)]
pub(crate) struct Document<T> {
    pub(crate) rosbag2_bagfile_information: T,
}

/// A bag's description.
#[derive(Serialize, Deserialize)]
pub(crate) struct Metadata {
    pub(crate) version: u32,
    storage_identifier: String,
    duration: Nanoseconds,
    starting_time: NanosecondsSinceEpoch,
    pub(crate) message_count: u64,
    topics_with_message_count: Vec<TopicWithCount>,
    #[serde(default)]
    compression_format: String,
    #[serde(default)]
    pub(crate) compression_mode: String,
    pub(crate) relative_file_paths: Vec<String>,
    #[serde(default)]
    files: Vec<FileInformation>,
    #[serde(default)]
    custom_data: Option<BTreeMap<String, String>>,
    #[serde(default)]
    ros_distro: String,
}

impl Metadata {
    /// Describes a bag of files and of topics with their message counts.
    pub(crate) fn new<'a>(
        files: &[File],
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
        let topics_with_message_count = topics.collect::<Result<_, serde_yaml_ng::Error>>()?;
        let (starting_time, duration) = span(around(files.iter().filter_map(|file| file.times)));
        Ok(Self {
            version: VERSION,
            storage_identifier: STORAGE.to_owned(),
            duration,
            starting_time,
            message_count: files.iter().map(|file| file.messages).sum(),
            topics_with_message_count,
            compression_format: String::new(),
            compression_mode: String::new(),
            relative_file_paths: files.iter().map(|file| file.name.clone()).collect(),
            files: files.iter().map(FileInformation::new).collect(),
            custom_data: Some(custom).filter(|custom| !custom.is_empty()),
            ros_distro: ROS_DISTRO.to_owned(),
        })
    }

    /// The text that rosbag2 puts into the MCAP file: with the counts of the whole bag so far, but only so many of the files
    /// before that one, for many files would else consist of lists of each other.
    pub(crate) fn into_yaml(mut self) -> Result<String, serde_yaml_ng::Error> {
        let surplus = self.files.len().saturating_sub(LISTED + 1);
        self.files.drain(..surplus);
        self.relative_file_paths.drain(..surplus);
        serde_yaml_ng::to_string(&self)
    }

    /// Writes `metadata.yaml` at `path`, at once or not at all.
    pub(crate) fn write(self, path: &Path) -> io::Result<()> {
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

    /// Reads `metadata.yaml` and refuses what this crate cannot read.
    pub(crate) fn read(file: &Path) -> Result<Self, BagError> {
        #[derive(Deserialize)]
        struct Versioned {
            version: u32,
            #[serde(default)]
            storage_identifier: Option<String>,
        }

        let yaml_error = |source| BagError::Metadata {
            file: file.to_owned(),
            source,
        };
        let text = regular::text(file, yaml::MAX_TEXT).map_err(BagError::io(file))?;
        let versioned: Document<Versioned> = yaml::read(&text).map_err(yaml_error)?;
        let Versioned {
            version: found,
            storage_identifier,
        } = versioned.rosbag2_bagfile_information;
        if let Some(found) = storage_identifier.filter(|storage| storage != STORAGE) {
            return Err(BagError::Storage {
                file: file.to_owned(),
                found,
            });
        }
        if found > VERSION {
            let expected = format!("at most {VERSION}");
            return Err(BagError::unexpected(file, "version", found, expected));
        }
        let document: Document<Self> = yaml::read(&text).map_err(yaml_error)?;
        let metadata = document.rosbag2_bagfile_information;
        // Files and messages that are compressed with zstd are known by their first bytes.
        let mode = metadata.compression_mode.to_lowercase();
        if !["", "none"].contains(&&*mode) && metadata.compression_format != "zstd" {
            return Err(metadata.compressed(file));
        }
        Ok(metadata)
    }

    pub(crate) fn compressed(&self, file: &Path) -> BagError {
        let Self {
            compression_mode: mode,
            compression_format: format,
            ..
        } = self;
        let found = format!("{mode:?} ({format})");
        BagError::unexpected(
            file,
            COMPRESSION,
            found,
            "none; convert the bag: ros2 bag convert",
        )
    }

    /// Number of messages of each topic.
    pub(crate) fn message_counts(&self) -> BTreeMap<&str, u64> {
        let mut counts = BTreeMap::new();
        for topic in &self.topics_with_message_count {
            let count: &mut u64 = counts.entry(&*topic.topic_metadata.name).or_default();
            *count = count.saturating_add(topic.message_count);
        }
        counts
    }

    /// Number of messages in each file, by its path relative to the bag's directory.
    pub(crate) fn file_counts(&self) -> impl Iterator<Item = (PathBuf, u64)> {
        let files = self.files.iter();
        files.filter_map(|file| Some((within(&file.path, self.version)?, file.message_count)))
    }

    /// Hash of each topic's type by the topic's name and type.
    pub(crate) fn type_hashes(&self) -> BTreeMap<(&str, &str), &str> {
        let topics = self.topics_with_message_count.iter();
        let hashes = topics.rev().map(|topic| {
            let known = &topic.topic_metadata;
            (
                (&*known.name, &*known.r#type),
                &*known.type_description_hash,
            )
        });
        hashes.collect()
    }

    /// What the recorder added.
    pub(crate) fn into_custom(self) -> BTreeMap<String, String> {
        self.custom_data.unwrap_or_default()
    }
}
