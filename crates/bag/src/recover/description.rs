//! The recovered bag's `metadata.yaml`.
//!
//! What publishers offered is kept word for word, where it is written as version 9 writes it.

use std::{collections::BTreeMap, path::Path};

use mcap::records::Metadata as MetadataRecord;
use serde_yaml_ng::Value;

use super::{
    RecoverError, counts::Counts, definitions::Topic, original::Original, report::Recovery,
    tally::LatchedTopic,
};
use crate::{
    METADATA_FILE, Qos, WriteError, channel_key,
    metadata::{File, Metadata, RECORD, TopicMetadata, TopicWithCount},
    records::{Channel, Schema},
    topic::is_latched,
    yaml,
};

/// Entry of the custom data in every recovered bag.
const RECOVERED: &str = "recovered";

/// Entry of the custom data that says how many messages are missing; those of earlier recoveries are added.
const MISSING: &str = "missing";

/// What the recovered bag holds so far.
pub(super) struct Description {
    pub files: Vec<File>,
    topics: Vec<TopicWithCount>,
    /// Index in `topics` by name and type.
    indexes: BTreeMap<(String, String), usize>,
    original: Original,
    /// Hash of each type in the original by the topic's name and type.
    hashes: BTreeMap<(String, String), String>,
    /// Messages that were not recovered, as far as that is known.
    pub missing: Option<u64>,
}

impl Description {
    pub fn new(original: Option<Original>) -> Self {
        let original = original.unwrap_or_default();
        Self {
            files: Vec::new(),
            topics: Vec::new(),
            indexes: BTreeMap::new(),
            hashes: hashes(&original),
            original,
            missing: None,
        }
    }

    /// Keeps what a file says of the bag, and newer custom data.
    pub fn keep(&mut self, original: Option<Original>, custom: Option<BTreeMap<String, String>>) {
        if let Some(original) = original {
            self.hashes = hashes(&original);
            self.original = original;
        }
        if let Some(custom) = custom {
            self.original.custom_data = Some(custom);
        }
    }

    /// Adds a file with its topics.
    pub fn add<'a>(
        &mut self,
        name: &Path,
        topics: impl Iterator<Item = &'a Topic>,
        counts: &Counts,
    ) {
        for Topic { channel, schema } in topics {
            let count = counts.messages.get(&channel.id).copied().unwrap_or(0);
            self.topic(channel, schema).message_count += count;
        }
        self.files.push(File {
            name: name.display().to_string(),
            times: counts.times,
            messages: counts.total(),
        });
    }

    fn topic(&mut self, channel: &Channel, schema: &Schema) -> &mut TopicWithCount {
        let key = (channel.topic.clone(), schema.name.clone());
        let profiles = profiles(channel);
        let index = *self.indexes.entry(key).or_insert_with_key(|key| {
            let given = channel.metadata.get(channel_key::TYPE_HASH);
            let given = given.filter(|hash| !hash.is_empty());
            let hash = given.or_else(|| self.hashes.get(key));
            self.topics.push(TopicWithCount {
                topic_metadata: TopicMetadata {
                    name: channel.topic.clone(),
                    r#type: schema.name.clone(),
                    serialization_format: channel.encoding.clone(),
                    offered_qos_profiles: Value::Sequence(Vec::new()),
                    type_description_hash: hash.cloned().unwrap_or_default(),
                },
                message_count: 0,
            });
            self.topics.len() - 1
        });
        let topic = &mut self.topics[index];
        if let Value::Sequence(all) = &mut topic.topic_metadata.offered_qos_profiles {
            all.extend(
                profiles
                    .into_iter()
                    .filter(|profile| !all.contains(profile))
                    .collect::<Vec<_>>(),
            );
        }
        topic
    }

    /// The latched topics that it holds, without messages that are repeated.
    pub fn latched(&self, repeated: &BTreeMap<String, u64>) -> BTreeMap<String, LatchedTopic> {
        let latched = self.topics.iter().filter_map(|topic| {
            let metadata = &topic.topic_metadata;
            let profiles = serde_yaml_ng::to_string(&metadata.offered_qos_profiles).ok()?;
            let qos = Qos::from_yaml(&profiles).ok()?;
            let repeated = repeated.get(&metadata.name).copied().unwrap_or(0);
            is_latched(&metadata.name, &metadata.r#type, qos.durability).then(|| {
                let messages = topic.message_count.saturating_sub(repeated);
                let depth = qos.assumed_depth().into();
                (metadata.name.clone(), LatchedTopic { messages, depth })
            })
        });
        latched.collect()
    }

    fn metadata(&self) -> Metadata {
        let original = &self.original;
        let mut custom = original.custom_data.clone().unwrap_or_default();
        custom.insert(RECOVERED.to_owned(), "true".to_owned());
        if let Some(missing) = self.missing.filter(|missing| *missing > 0) {
            let before = custom.get(MISSING).and_then(|count| count.parse().ok());
            let all = missing.saturating_add(before.unwrap_or(0));
            custom.insert(MISSING.to_owned(), all.to_string());
        }
        let mut metadata = Metadata::of(&self.files, self.topics.clone(), custom);
        // Messages are copied as they are.
        if original.compression_mode.eq_ignore_ascii_case("message") {
            metadata
                .compression_format
                .clone_from(&original.compression_format);
            metadata
                .compression_mode
                .clone_from(&original.compression_mode);
        }
        if !original.ros_distro.is_empty() {
            metadata.ros_distro.clone_from(&original.ros_distro);
        }
        metadata
    }

    /// The record that goes into each file.
    pub fn record(&self) -> Result<MetadataRecord, WriteError> {
        let (name, key) = RECORD;
        Ok(MetadataRecord {
            name: name.to_owned(),
            metadata: BTreeMap::from([(key.to_owned(), self.metadata().into_yaml()?)]),
        })
    }

    /// Writes `metadata.yaml`.
    pub fn write(&self, directory: &Path) -> Result<(), RecoverError> {
        let path = directory.join(METADATA_FILE);
        self.metadata()
            .write(&path)
            .map_err(RecoverError::write(&path))
    }

    /// Fills in what the recovered bag holds.
    pub fn tell(&self, recovery: &mut Recovery) {
        for topic in &self.topics {
            let name = topic.topic_metadata.name.clone();
            *recovery.messages.entry(name).or_default() += topic.message_count;
        }
        let times = self.files.iter().filter_map(|file| file.times);
        recovery.times =
            times.reduce(|(first, last), (start, end)| (first.min(start), last.max(end)));
    }
}

fn hashes(original: &Original) -> BTreeMap<(String, String), String> {
    let topics = original.topics_with_message_count.iter().rev();
    let hashes = topics.map(|topic| {
        let known = topic.topic_metadata.clone();
        ((known.name, known.r#type), known.type_description_hash)
    });
    hashes.collect()
}

/// The quality of service that a channel's publisher offered. Up to version 8 policies were numbers.
fn profiles(channel: &Channel) -> Vec<Value> {
    let text = channel
        .metadata
        .get(channel_key::QOS)
        .map_or("", String::as_str);
    let given: Option<Vec<Value>> = yaml::read(text).ok();
    let given = given.unwrap_or_default();
    let named = |profile: &Value| profile.get("history").is_some_and(Value::is_string);
    if given.iter().all(named) {
        return given;
    }
    let ours = Qos::from_yaml(text).unwrap_or_default().profile();
    serde_yaml_ng::to_value(ours).into_iter().collect()
}
