use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use mcap::records::MessageHeader;

use super::{
    BagOptions, BagSummary,
    closing::{LastWords, described},
    latched::Latched,
    mcap_writer::McapWriter,
};
use crate::{
    CUSTOM_DATA, Topic, WriteError,
    metadata::File,
    new_directory::make_empty,
    read::MAX_RECORD_LENGTH,
    record::MESSAGE_HEADER,
    times::{Times, widen},
};

/// Bytes of latched messages that are kept to be repeated, all topics together; half of
/// [`BagOptions::max_bytes`] if that is less.
const LATCHED: u64 = 64 << 20;

/// Bytes of memory that the index of a file may take, about 200 for each of its chunks.
pub(crate) const INDEX: usize = 64 << 20;

/// Longest message: its record is the longest that is read.
const MAX_MESSAGE: usize = MAX_RECORD_LENGTH - MESSAGE_HEADER;

/// A topic of a [`BagWriter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TopicId(pub(crate) usize);

/// Writes a bag, of one MCAP file or, with limits or [`split`](Self::split), of several.
///
/// Chunks are held in memory until they are complete: a process killed at any time leaves a file that is readable up to
/// the last complete chunk, at least up to the last [`flush`](Self::flush). Dropping the writer completes the file but
/// writes no `metadata.yaml`. Nothing is forced to the disk (`fsync`).
///
/// # Latched messages
/// Of each topic that [is latched](Topic::is_latched) the last messages of each publisher, as many as its depth, stand
/// again at the head of each further file, logged at the time of the file's first message. A metadata record named
/// `lgvi_repeated` before them says how many each topic has. Of all topics together 64 MiB are kept at most, or half of
/// [`BagOptions::max_bytes`] if that is less, and 1000 messages of each. What finds no room is not repeated.
///
/// # Errors while writing
/// When a file cannot be written on, everything up to the last complete chunk is closed as a bag, with `metadata.yaml`;
/// the disk space for that is reserved before. [`WriteError::Failed`] tells how that went. Such a bag
/// has the keys `error`, `unwritten` and `unwritten:<topic>`, the number of messages that are missing, in its custom data;
/// who has more of them adds those by [`on_failure`](Self::on_failure). The writer then takes no more messages. Other
/// errors concern one topic or message, and leave it as it was ([`is_ended`](Self::is_ended)).
///
/// # Memory
/// One chunk of 1 MiB or the longest message, its compressed form and 16 bytes for each message in it; for each chunk
/// written about 200 bytes, until the file is closed: at 64 MiB the next file is begun by itself. Nothing else grows with
/// the number of messages.
pub struct BagWriter {
    pub(crate) directory: PathBuf,
    pub(crate) name: String,
    pub(crate) options: BagOptions,
    /// Whether space for the ends of files is reserved.
    pub(crate) reserves: bool,
    pub(crate) custom: BTreeMap<String, String>,
    /// The custom data that stand in the file that is being written.
    pub(crate) flushed: BTreeMap<String, String>,
    pub(crate) topics: Vec<RecordedTopic>,
    /// Bytes of their descriptions at most.
    pub(crate) described: u64,
    /// Index in `topics` by name.
    indexes: BTreeMap<String, usize>,
    pub(crate) latched: Latched,
    /// The files that are complete, and their bytes.
    pub(crate) closed: Vec<File>,
    pub(crate) bytes: u64,
    /// The file that is being written; none after an error.
    pub(crate) file: Option<McapWriter>,
    /// Its name.
    pub(crate) file_name: String,
    /// Log time of the first message of that file, apart from those repeated.
    pub(crate) begin: Option<u64>,
    /// How many messages of each topic are repeated in that file.
    pub(crate) repeated: Vec<u64>,
    /// First and last log time of the messages taken.
    pub(crate) times: Times,
    pub(crate) last_words: Option<LastWords>,
}

pub(crate) struct RecordedTopic {
    pub topic: Topic,
    pub channel: u16,
    /// Messages taken.
    pub taken: u64,
    /// Messages in closed files.
    pub messages: u64,
    /// How many of them are repeated.
    pub repeated: u64,
}

impl BagWriter {
    /// Creates the bag's directory and in it the file `<directory's name>_0.mcap`.
    ///
    /// # Errors
    /// The directory exists and is not empty, has no usable name, or cannot be written.
    pub fn create(directory: &Path, options: BagOptions) -> Result<Self, WriteError> {
        let name = directory.file_name().and_then(|name| name.to_str());
        let name = name.ok_or_else(|| WriteError::NoName(directory.to_owned()))?;
        let made = make_empty(directory)?;
        let opened = Self::open(directory, name, format!("{name}_0.mcap"), options, true);
        if made && opened.is_err() {
            let _ = fs::remove_dir(directory);
        }
        opened
    }

    /// Begins a bag in a directory that is there, with a file of this name; further ones are numbered after `name`. A bag that
    /// reserves no space may be left without its end on a full disk.
    pub(crate) fn open(
        directory: &Path,
        name: &str,
        file_name: String,
        options: BagOptions,
        reserves: bool,
    ) -> Result<Self, WriteError> {
        let latched = options
            .max_bytes
            .map_or(LATCHED, |most| LATCHED.min(most.get() / 2));
        let mut writer = Self {
            directory: directory.to_owned(),
            name: name.to_owned(),
            options,
            reserves,
            custom: BTreeMap::new(),
            flushed: BTreeMap::new(),
            topics: Vec::new(),
            described: 0,
            indexes: BTreeMap::new(),
            latched: Latched::new(usize::try_from(latched).unwrap_or(usize::MAX)),
            closed: Vec::new(),
            bytes: 0,
            file: None,
            file_name,
            begin: None,
            repeated: Vec::new(),
            times: None,
            last_words: None,
        };
        let opened = writer.open_file();
        opened.map_err(|(path, source)| WriteError::Io(path, source))?;
        Ok(writer)
    }

    /// The MCAP file that is being written.
    pub fn path(&self) -> PathBuf {
        self.directory.join(&self.file_name)
    }

    /// Custom data for `metadata.yaml`, should the bag have to be closed after an error, of each file that is closed from
    /// now on, and of what a [`flush`](Self::flush) makes safe.
    pub fn set_custom(&mut self, custom: BTreeMap<String, String>) {
        self.custom = custom;
        self.make_room();
    }

    /// Adds a topic, or finds it if it was added before.
    ///
    /// # Errors
    /// A topic of this name but another type is in the bag, the bag has 65535 topics, or writing fails.
    pub fn add_topic(&mut self, topic: &Topic) -> Result<TopicId, WriteError> {
        if let Some(&index) = self.indexes.get(&topic.name) {
            let known = &self.topics[index].topic;
            if (&known.type_name, &known.type_hash) == (&topic.type_name, &topic.type_hash) {
                return Ok(TopicId(index));
            }
            let of = |topic: &Topic| format!("{} ({})", topic.type_name, topic.type_hash);
            let (name, known, new) = (&topic.name, of(known), of(topic));
            let reason = format!("topic {name} has type {known}, cannot also have {new}");
            return Err(WriteError::Refused(reason));
        }
        let refused = |reason| WriteError::Refused(format!("topic {}: {reason}", topic.name));
        let qos = topic.qos.to_yaml();
        let qos = qos.map_err(|error| refused(error.to_string()))?;
        let channel = u16::try_from(self.topics.len() + 1)
            .map_err(|_| refused("a bag has at most 65535 topics".to_owned()))?;
        self.file()?;
        self.described += described(topic);
        self.make_room();
        if let Err(source) = self.file()?.add_topic(channel, topic, &qos) {
            return Err(self.fail_on_file(source));
        }
        self.latched.add_topic(topic);
        self.repeated.push(0);
        self.topics.push(RecordedTopic {
            topic: topic.clone(),
            channel,
            taken: 0,
            messages: 0,
            repeated: 0,
        });
        let index = self.topics.len() - 1;
        self.indexes.insert(topic.name.clone(), index);
        Ok(TopicId(index))
    }

    /// Writes a message, CDR with its encapsulation header. Times are nanoseconds since the UNIX epoch.
    ///
    /// # Errors
    /// The topic is of another bag, the message is longer than any that is read, or writing fails. Only the last ends the
    /// bag.
    pub fn write(
        &mut self,
        topic: TopicId,
        log_time: u64,
        publish_time: u64,
        sequence: u32,
        cdr: &[u8],
    ) -> Result<(), WriteError> {
        self.write_of(0, topic, log_time, publish_time, sequence, cdr)
    }

    /// The same for a message of one of several publishers, told by any number: of a latched topic, the last messages of each
    /// are repeated.
    ///
    /// # Errors
    /// As for [`write`](Self::write).
    pub fn write_of(
        &mut self,
        publisher: u128,
        topic: TopicId,
        log_time: u64,
        publish_time: u64,
        sequence: u32,
        cdr: &[u8],
    ) -> Result<(), WriteError> {
        let Some(recorded) = self.topics.get(topic.0) else {
            let (index, count) = (topic.0, self.topics.len());
            let reason = format!("topic id {index} is not of this bag, which has {count} topics");
            return Err(WriteError::Refused(reason));
        };
        if cdr.len() > MAX_MESSAGE {
            let expected = format!("{} bytes, expected at most {MAX_MESSAGE}", cdr.len());
            let reason = format!("a message of {} has {expected}", recorded.topic.name);
            return Err(WriteError::Refused(reason));
        }
        let channel_id = recorded.channel;
        if self.is_full(log_time)? {
            self.split()?;
        }
        if self.begin.is_none() {
            self.begin(log_time)?;
        }
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time,
            publish_time,
        };
        if let Err(source) = self.file()?.write(&header, cdr) {
            return Err(self.fail_on_file(source));
        }
        self.topics[topic.0].taken += 1;
        widen(&mut self.times, log_time);
        self.latched.push(topic.0, publisher, &header, cdr);
        Ok(())
    }

    /// Hands everything written so far to the operating system, as a complete chunk, and the custom data where they have
    /// changed, as a metadata record named `lgvi_custom_data`.
    ///
    /// # Errors
    /// Writing fails, or the file is no longer where it was made.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.finish_chunk()?;
        if self.custom == self.flushed {
            return Ok(());
        }
        let custom = self.custom.clone();
        if let Err(source) = self.file()?.write_metadata(CUSTOM_DATA, custom.clone()) {
            return Err(self.fail_on_file(source));
        }
        self.flushed = custom;
        Ok(())
    }

    /// Hands over the messages.
    pub(crate) fn finish_chunk(&mut self) -> Result<(), WriteError> {
        let file = self.file()?;
        let finished = file.check_place().and_then(|()| file.finish_chunk());
        finished.map_err(|source| self.fail_on_file(source))
    }

    /// Completes the file and writes `metadata.yaml` with the given custom data.
    ///
    /// # Errors
    /// Writing fails, or the file is no longer where it was made.
    pub fn finish(mut self, custom: BTreeMap<String, String>) -> Result<BagSummary, WriteError> {
        self.custom = custom;
        if let (None, Some((_, last))) = (self.begin, self.times) {
            self.begin(last)?;
        }
        self.finish_chunk()?;
        let closed = self.close(true);
        closed.map_err(|fault| self.fail(fault))?;
        Ok(self.summary())
    }

    /// The file that is being written.
    pub(crate) fn file(&mut self) -> Result<&mut McapWriter, WriteError> {
        let file = self.file.as_mut();
        file.ok_or_else(|| WriteError::Ended(self.directory.clone()))
    }
}

impl Drop for BagWriter {
    fn drop(&mut self) {
        if let Some(file) = &mut self.file {
            let _ = file.finish_chunk();
            let _ = self.close(false);
        }
    }
}
