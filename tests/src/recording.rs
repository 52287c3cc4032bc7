//! The messages of a bag, in memory.

use std::collections::BTreeMap;
use std::path::Path;

use lgvi_bag::{BagOptions, BagReader, BagWriter, Topic};
use lgvi_msgs::{RosMessage, cdr};

/// All of a bag, in the order of its log times.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Its topics.
    pub topics: Vec<Topic>,
    /// Its messages.
    pub records: Vec<Record>,
}

/// One message of a bag.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Name of its topic.
    pub topic: String,
    /// When it was recorded (ns).
    pub log_time: u64,
    /// When it was published (ns).
    pub publish_time: u64,
    /// The publisher's count.
    pub sequence: u32,
    /// CDR with its encapsulation header.
    pub data: Vec<u8>,
}

impl Recording {
    /// Reads a bag that must be complete and undamaged.
    #[track_caller]
    pub fn read(bag: &Path) -> Self {
        let reader = BagReader::open(bag).unwrap_or_else(|error| panic!("{error}"));
        let messages = reader.messages().map(|message| {
            let message = message.unwrap_or_else(|error| panic!("{error}"));
            Record {
                topic: message.topic.name.clone(),
                log_time: message.log_time,
                publish_time: message.publish_time,
                sequence: message.sequence,
                data: message.data,
            }
        });
        Self {
            records: messages.collect(),
            topics: reader.topics().to_vec(),
        }
    }

    /// Writes a bag.
    pub fn write(&self, bag: &Path) {
        self.write_as(bag, BagOptions::default());
    }

    /// Writes a bag with options.
    pub fn write_as(&self, bag: &Path, options: BagOptions) {
        let mut writer = BagWriter::create(bag, options).expect("a new bag");
        for topic in &self.topics {
            writer.add_topic(topic).expect("a topic");
        }
        for record in &self.records {
            let topic = self.topics.iter().find(|topic| topic.name == record.topic);
            let id = writer
                .add_topic(topic.expect("the record's topic"))
                .expect("a topic");
            let Record {
                log_time,
                publish_time,
                sequence,
                data,
                ..
            } = record;
            writer
                .write(id, *log_time, *publish_time, *sequence, data)
                .expect("a message");
        }
        writer.finish(BTreeMap::new()).expect("a complete bag");
    }

    /// Number of messages by topic.
    pub fn counts(&self) -> BTreeMap<&str, u64> {
        let mut counts = BTreeMap::new();
        for record in &self.records {
            *counts.entry(record.topic.as_str()).or_default() += 1;
        }
        counts
    }

    /// Log times and payloads by topic, in their order.
    pub fn contents(&self) -> BTreeMap<&str, Vec<(u64, &[u8])>> {
        let mut contents = BTreeMap::<_, Vec<_>>::new();
        for record in &self.records {
            contents
                .entry(record.topic.as_str())
                .or_default()
                .push((record.log_time, &*record.data));
        }
        contents
    }

    /// The messages of a topic.
    pub fn on(&self, topic: &str) -> impl Iterator<Item = &Record> {
        self.records
            .iter()
            .filter(move |record| record.topic == topic)
    }

    /// The messages of a topic, decoded.
    pub fn messages<M: RosMessage>(&self, topic: &str) -> Vec<M> {
        self.on(topic)
            .map(|record| cdr::decode(&record.data).expect("a message"))
            .collect()
    }

    /// Changes one message of a topic, counted from 0.
    pub fn edit<M: RosMessage>(&mut self, topic: &str, index: usize, change: impl FnOnce(&mut M)) {
        let mut records = self
            .records
            .iter_mut()
            .filter(|record| record.topic == topic);
        let record = records.nth(index).expect("the message");
        let mut message = cdr::decode(&record.data).expect("a message");
        change(&mut message);
        record.data = cdr::encode(&message).expect("CDR");
    }

    /// The same with the topics of these names only.
    pub fn only(mut self, topics: &[&str]) -> Self {
        self.topics
            .retain(|topic| topics.contains(&topic.name.as_str()));
        self.records
            .retain(|record| topics.contains(&record.topic.as_str()));
        self
    }

    /// The same without one topic.
    pub fn without(mut self, topic: &str) -> Self {
        self.topics.retain(|other| other.name != topic);
        self.records.retain(|record| record.topic != topic);
        self
    }
}
