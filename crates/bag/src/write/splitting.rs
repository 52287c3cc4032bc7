//! Where one file of a bag ends and the next begins.

use std::{collections::BTreeMap, io, time::Duration};

use mcap::records::MessageHeader;

use super::{
    BagWriter,
    closing::Fault,
    mcap_writer::{CHUNK, McapWriter},
    writer::INDEX,
};
use crate::{REPEATED, TopicId, WriteError};

impl BagWriter {
    /// Completes the file that is being written and goes on in the next one. A file that has no message of its own yet
    /// is not split.
    ///
    /// # Errors
    /// Writing fails, or the file is no longer where it was made.
    pub fn split(&mut self) -> Result<(), WriteError> {
        let next = format!("{}_{}.mcap", self.name, self.closed.len() + 1);
        self.split_as(next)
    }

    /// The same with a name for the next file, which repeats these messages of latched topics and no others.
    pub(crate) fn split_into(
        &mut self,
        file_name: String,
        repeated: Vec<(TopicId, MessageHeader, Vec<u8>)>,
    ) -> Result<(), WriteError> {
        self.split_as(file_name)?;
        let repeated = repeated.into_iter().map(|(topic, mut header, data)| {
            header.channel_id = self.topics[topic.0].channel;
            (topic.0, header, data)
        });
        self.latched.replace(repeated.collect());
        Ok(())
    }

    fn split_as(&mut self, file_name: String) -> Result<(), WriteError> {
        self.finish_chunk()?;
        if self.begin.is_none() {
            return Ok(());
        }
        let opened = self.close(false).and_then(|()| {
            self.begin = None;
            self.file_name = file_name;
            self.open_file()
        });
        opened.map_err(|fault| self.fail(fault))
    }

    /// Whether a message of this log time belongs into the next file.
    pub(crate) fn is_full(&mut self, log_time: u64) -> Result<bool, WriteError> {
        let (options, begin) = (self.options, self.begin);
        let file = self.file()?;
        Ok(begin.is_some_and(|begin| {
            let elapsed = Duration::from_nanos(log_time.saturating_sub(begin));
            options.max_duration.is_some_and(|most| elapsed > most)
                || options
                    .max_bytes
                    .is_some_and(|most| file.size() >= most.get())
                || file.index_memory >= INDEX
        }))
    }

    /// Begins the file that is being written, at the log time of its first message: adds the topics and repeats latched
    /// messages.
    pub(crate) fn begin(&mut self, log_time: u64) -> Result<(), WriteError> {
        self.begin = Some(log_time);
        if self.closed.is_empty() {
            return Ok(());
        }
        let repeated = self.repeat(log_time);
        repeated.map_err(|source| self.fail_on_file(source))
    }

    fn repeat(&mut self, log_time: u64) -> io::Result<()> {
        let Some(file) = &mut self.file else {
            return Ok(());
        };
        let mut counts = BTreeMap::new();
        for topic in 0..self.topics.len() {
            let count = self.latched.messages(topic).count() as u64;
            self.repeated[topic] = count;
            if count > 0 {
                counts.insert(self.topics[topic].topic.name.clone(), count.to_string());
            }
        }
        if !counts.is_empty() {
            file.write_metadata(REPEATED, counts)?;
        }
        for recorded in &self.topics {
            let topic = &recorded.topic;
            let qos = topic.qos.to_yaml().map_err(io::Error::other)?;
            file.add_topic(recorded.channel, topic, &qos)?;
        }
        for topic in 0..self.topics.len() {
            for (kept, data) in self.latched.messages(topic) {
                let mut header = *kept;
                header.log_time = log_time;
                file.write(&header, data)?;
            }
        }
        Ok(())
    }

    /// Makes the next file, without its topics.
    pub(crate) fn open_file(&mut self) -> Result<(), Fault> {
        let path = self.path();
        let (compression, max_bytes) = (self.options.compression, self.options.max_bytes);
        let chunk = max_bytes.map_or(CHUNK, |most| CHUNK.min(most.get() / 8).max(1 << 10));
        let (description, reserves) = (self.description(), self.reserves);
        let file = McapWriter::create(path.clone(), compression, chunk, description, reserves);
        self.file = Some(file.map_err(|source| (path, source))?);
        self.repeated.fill(0);
        self.flushed.clear();
        Ok(())
    }
}
