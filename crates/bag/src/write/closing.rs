//! The end of a bag's files and of the bag, also where a disk is full or files have gone.

use std::{
    collections::BTreeMap,
    io::{self, ErrorKind},
    iter,
    path::PathBuf,
};

use super::{BagSummary, BagWriter, mcap_writer::McapWriter, writer::RecordedTopic};
use crate::{
    METADATA_FILE, Rest, Topic, WriteError,
    metadata::{File, LISTED, Metadata, RECORD},
};

/// Keys of the custom data of a bag that an error has ended: the error, and how many messages are not in the bag, in all
/// and with `:<topic>` of each topic.
const ERROR: &str = "error";
const UNWRITTEN: &str = "unwritten";

/// What is called when the bag has to be closed after an error.
pub(crate) type LastWords =
    Box<dyn FnMut(&mut BTreeMap<String, u64>) -> BTreeMap<String, String> + Send>;

/// What went wrong where.
pub(crate) type Fault = (PathBuf, io::Error);

impl BagWriter {
    /// Has `last_words` called when the bag is to be closed after an error, at least once, and again each time that room was
    /// made by giving up chunks. It gets the messages taken that are not in the bag, by topic, adds those that it knows of
    /// and that were not handed over, and gives the custom data, in place of what [`set_custom`](Self::set_custom) has set.
    pub fn on_failure(
        &mut self,
        last_words: impl FnMut(&mut BTreeMap<String, u64>) -> BTreeMap<String, String> + Send + 'static,
    ) {
        self.last_words = Some(Box::new(last_words));
    }

    /// Whether an error has ended the bag: it takes no more messages.
    pub fn is_ended(&self) -> bool {
        self.file.is_none()
    }

    /// Completes the file that is being written, whose chunks must be written, and then the bag if it is to end: writes
    /// `metadata.yaml`.
    pub(crate) fn close(&mut self, is_last: bool) -> Result<(), Fault> {
        let bytes = self.end_file()?;
        if is_last {
            let path = self.directory.join(METADATA_FILE);
            let written = self.metadata().and_then(|metadata| metadata.write(&path));
            written.map_err(|source| (path, source))?;
        }
        if let Some(file) = self.file.take() {
            let description = self.describe(&file);
            self.closed.push(description);
            self.bytes += bytes;
            let counts = &file.written().counts;
            for ((topic, count), repeated) in self.topics.iter_mut().zip(counts).zip(&self.repeated)
            {
                topic.messages += count;
                topic.repeated += count.min(repeated);
            }
        }
        Ok(())
    }

    /// Closes what can be closed after an error.
    pub(crate) fn fail(&mut self, fault: Fault) -> WriteError {
        let rest = self.salvage(&fault);
        self.file = None;
        let (path, source) = fault;
        WriteError::Failed { path, source, rest }
    }

    /// The same after an error of the file that is being written.
    pub(crate) fn fail_on_file(&mut self, source: io::Error) -> WriteError {
        let path = self.path();
        self.fail((path, source))
    }

    fn salvage(&mut self, fault: &Fault) -> Rest {
        self.take_stock(fault);
        if let Some(file) = &mut self.file {
            // Its room is reserved. A file that was moved is completed where it is.
            let _ = file.finish_chunk();
            let gone = |error: io::Error| {
                matches!(error.kind(), ErrorKind::NotADirectory | ErrorKind::NotFound)
            };
            if file.check_place().is_err_and(gone) {
                let _ = self.end_file();
                self.file = None;
                if self.closed.is_empty() || !self.directory.is_dir() {
                    return Rest::Gone;
                }
            }
        }
        let lost = self.take_stock(fault);
        if self.close(true).is_ok() {
            let messages = self.summary().messages;
            return Rest::Closed { messages, lost };
        }
        if let Some(file) = &mut self.file {
            file.abandon();
        }
        let bag = self.directory.clone();
        Rest::Unclosed { bag, lost }
    }

    /// Writes the end of the file and gives the file's size.
    fn end_file(&mut self) -> Result<u64, Fault> {
        let text = self.metadata().and_then(|metadata| {
            let text = metadata.into_yaml();
            text.map_err(io::Error::other)
        });
        let Some(file) = &mut self.file else {
            return Ok(0);
        };
        let (name, key) = RECORD;
        let ended = text.and_then(|text| {
            let texts = BTreeMap::from([(key.to_owned(), text)]);
            file.close(name, texts)
        });
        ended.map_err(|source| (file.path.clone(), source))
    }

    /// The topics with the numbers of their messages in the chunks written of the present file.
    fn counts(&self) -> impl Iterator<Item = (&RecordedTopic, u64)> {
        let counts = self.file.iter().flat_map(|file| &file.written().counts);
        self.topics
            .iter()
            .zip(counts.copied().chain(iter::repeat(0)))
    }

    /// The bag with the file that is being written, as far as its chunks are written.
    fn metadata(&self) -> io::Result<Metadata> {
        let open = self.file.iter().map(|file| self.describe(file));
        let files = self.closed.iter().cloned().chain(open).collect();
        let topics = self.counts();
        let topics = topics.map(|(topic, count)| (&topic.topic, topic.messages + count));
        Metadata::new(files, topics, self.custom.clone()).map_err(io::Error::other)
    }

    fn describe(&self, file: &McapWriter) -> File {
        let written = file.written();
        let messages = written.counts.iter().sum();
        File::new(self.file_name.clone(), written.times, messages)
    }

    /// Bytes that the description of the bag takes at most.
    pub(crate) fn description(&self) -> u64 {
        let custom = self.custom.iter();
        let custom: usize = custom
            .map(|(key, value)| 16 + key.len() + value.len())
            .sum();
        let files = (self.closed.len() + 1).min(LISTED + 1) * (256 + 2 * self.name.len());
        let error = 512 + 2 * self.directory.as_os_str().len();
        self.described + (custom + files + error) as u64
    }

    /// Makes room for it in the file that is being written.
    pub(crate) fn make_room(&mut self) {
        let description = self.description();
        if let Some(file) = &mut self.file {
            file.description = description;
        }
    }

    /// Has the custom data say what is missing, and gives how many messages that are.
    fn take_stock(&mut self, fault: &Fault) -> u64 {
        // Messages taken that are neither in a closed file nor in a written chunk of the present one.
        let topics = self.counts().zip(&self.repeated);
        let unwritten = topics.map(|((topic, count), repeated)| {
            let written = topic.messages - topic.repeated + count.saturating_sub(*repeated);
            let unwritten = topic.taken.saturating_sub(written);
            (topic.topic.name.clone(), unwritten)
        });
        let mut unwritten: BTreeMap<_, _> = unwritten.filter(|(_, count)| *count > 0).collect();
        if let Some(last_words) = &mut self.last_words {
            self.custom = last_words(&mut unwritten);
        }
        unwritten.retain(|_, count| *count > 0);
        let of_topics = format!("{UNWRITTEN}:");
        self.custom.retain(|key, _| !key.starts_with(&of_topics));
        let counts = unwritten.iter();
        let counts = counts.map(|(topic, count)| (of_topics.clone() + topic, count.to_string()));
        self.custom.extend(counts);
        let lost = unwritten.values().sum::<u64>();
        self.custom.insert(UNWRITTEN.to_owned(), lost.to_string());
        let (path, error) = fault;
        let error = format!("{}: {error}", path.display());
        self.custom.insert(ERROR.to_owned(), error);
        lost
    }

    /// What a bag holds of which all files are closed.
    pub(crate) fn summary(&self) -> BagSummary {
        let messages = self.topics.iter().map(|topic| {
            let name = topic.topic.name.clone();
            (name, topic.messages - topic.repeated)
        });
        let files = self
            .closed
            .iter()
            .map(|file| self.directory.join(&file.path));
        BagSummary {
            messages: messages.collect(),
            repeated: self.topics.iter().map(|topic| topic.repeated).sum(),
            files: files.collect(),
            bytes: self.bytes,
            times: self.times,
        }
    }
}

/// Bytes that the entry of a topic in a description takes at most, and the custom data about its messages.
pub(crate) fn described(topic: &Topic) -> u64 {
    1024 + (4 * topic.name.len() + topic.type_name.len() + topic.type_hash.len()) as u64
}
