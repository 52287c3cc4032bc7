use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, BufWriter},
    path::{Path, PathBuf},
};

use mcap::{
    McapError, WriteOptions, Writer,
    records::{MessageHeader, Metadata as MetadataRecord},
    write::NoSeek,
};

use crate::{
    PROFILE, SCHEMA_ENCODING, SERIALIZATION_FORMAT, Topic, WriteError, channel_key,
    metadata::Metadata,
};

/// How a bag is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BagOptions {
    /// Compression of the MCAP chunks.
    pub compression: Compression,
}

/// Compression of MCAP chunks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// None: the fastest.
    None,
    /// zstd at its fastest level. The default: it halves the rate that can be written, to about 0.75 million messages
    /// of 300 B a second, still far above what a run produces.
    #[default]
    Zstd,
}

/// A topic of a [`BagWriter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TopicId(usize);

/// What a finished bag holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagSummary {
    /// Number of messages of each topic.
    pub messages: BTreeMap<String, u64>,
    /// Size of the MCAP file.
    pub bytes: u64,
    /// First and last log time (ns); none in a bag without messages.
    pub times: Option<(u64, u64)>,
}

/// Writes a bag of one MCAP file.
///
/// Chunks are held in memory until they are complete: a process killed at any time leaves a file that is readable up to
/// the last complete chunk, at least up to the last [`flush`](Self::flush). Dropping the writer completes the file but
/// writes no `metadata.yaml`.
pub struct BagWriter {
    directory: PathBuf,
    file_name: String,
    mcap: Writer<NoSeek<BufWriter<File>>>,
    topics: Vec<RecordedTopic>,
    times: Option<(u64, u64)>,
}

struct RecordedTopic {
    topic: Topic,
    channel: u16,
    messages: u64,
}

impl BagWriter {
    /// Creates the bag's directory and in it the file `<directory's name>_0.mcap`.
    ///
    /// # Errors
    /// The directory exists and is not empty, has no usable name, or cannot be written.
    pub fn create(directory: &Path, options: BagOptions) -> Result<Self, WriteError> {
        let name = directory
            .file_name()
            .and_then(|name| name.to_str())
            .ok_or_else(|| WriteError::NoName {
                path: directory.to_owned(),
            })?;
        let file_name = format!("{name}_0.mcap");
        make_empty_directory(directory)?;

        let path = directory.join(&file_name);
        let file = File::create_new(&path).map_err(|source| WriteError::Io {
            path: path.clone(),
            source,
        })?;
        let compression = match options.compression {
            Compression::None => None,
            Compression::Zstd => Some(mcap::Compression::Zstd),
        };
        let mcap = WriteOptions::new()
            .profile(PROFILE)
            .library(concat!("lgvi ", env!("CARGO_PKG_VERSION")))
            .compression(compression)
            .compression_level(1)
            .compression_threads(0)
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::new(file)))
            .map_err(|source| WriteError::Mcap { path, source })?;
        Ok(Self {
            directory: directory.to_owned(),
            file_name,
            mcap,
            topics: Vec::new(),
            times: None,
        })
    }

    /// The bag's MCAP file.
    pub fn path(&self) -> PathBuf {
        self.directory.join(&self.file_name)
    }

    /// Adds a topic, or finds it if it was added before.
    ///
    /// # Errors
    /// A topic of this name but another type is in the bag, or writing fails.
    pub fn add_topic(&mut self, topic: &Topic) -> Result<TopicId, WriteError> {
        if let Some(index) = self
            .topics
            .iter()
            .position(|recorded| recorded.topic.name == topic.name)
        {
            let existing = &self.topics[index].topic;
            if (&existing.type_name, &existing.type_hash) == (&topic.type_name, &topic.type_hash) {
                return Ok(TopicId(index));
            }
            let type_and_hash =
                |topic: &Topic| format!("{} ({})", topic.type_name, topic.type_hash);
            return Err(WriteError::ConflictingType {
                topic: topic.name.clone(),
                existing: type_and_hash(existing),
                requested: type_and_hash(topic),
            });
        }
        let metadata = BTreeMap::from([
            (channel_key::QOS.to_owned(), topic.qos.to_yaml()?),
            (channel_key::TYPE_HASH.to_owned(), topic.type_hash.clone()),
        ]);
        let channel = self
            .mcap
            .add_schema(
                &topic.type_name,
                SCHEMA_ENCODING,
                topic.definition.as_bytes(),
            )
            .and_then(|schema| {
                self.mcap
                    .add_channel(schema, &topic.name, SERIALIZATION_FORMAT, &metadata)
            })
            .map_err(|source| self.error(source))?;
        self.topics.push(RecordedTopic {
            topic: topic.clone(),
            channel,
            messages: 0,
        });
        Ok(TopicId(self.topics.len() - 1))
    }

    /// Writes a message, CDR with its encapsulation header. Times are nanoseconds since the UNIX epoch.
    ///
    /// # Errors
    /// The topic is of another bag, or writing fails.
    pub fn write(
        &mut self,
        topic: TopicId,
        log_time: u64,
        publish_time: u64,
        sequence: u32,
        cdr: &[u8],
    ) -> Result<(), WriteError> {
        let count = self.topics.len();
        let Some(recorded) = self.topics.get_mut(topic.0) else {
            return Err(WriteError::UnknownTopic {
                index: topic.0,
                count,
            });
        };
        let header = MessageHeader {
            channel_id: recorded.channel,
            sequence,
            log_time,
            publish_time,
        };
        match self.mcap.write_to_known_channel(&header, cdr) {
            Ok(()) => recorded.messages += 1,
            Err(source) => return Err(self.error(source)),
        }
        let (first, last) = self.times.unwrap_or((log_time, log_time));
        self.times = Some((first.min(log_time), last.max(log_time)));
        Ok(())
    }

    /// Hands everything written so far to the operating system, as a complete chunk.
    ///
    /// # Errors
    /// Writing fails.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.mcap.flush().map_err(|source| self.error(source))
    }

    /// Completes the file and writes `metadata.yaml` with the given custom data.
    ///
    /// # Errors
    /// Writing fails.
    pub fn finish(mut self, custom: BTreeMap<String, String>) -> Result<BagSummary, WriteError> {
        let topics: Vec<_> = self
            .topics
            .drain(..)
            .map(|recorded| (recorded.topic, recorded.messages))
            .collect();
        let metadata = Metadata::new(&self.file_name, &topics, self.times, custom)?;
        let record = MetadataRecord {
            name: "rosbag2".to_owned(),
            metadata: BTreeMap::from([("serialized_metadata".to_owned(), metadata.to_yaml()?)]),
        };
        self.mcap
            .write_metadata(&record)
            .and_then(|()| self.mcap.finish())
            .map_err(|source| self.error(source))?;
        metadata.write(&self.directory)?;

        let path = self.path();
        let bytes = match fs::metadata(&path) {
            Ok(metadata) => metadata.len(),
            Err(source) => return Err(WriteError::Io { path, source }),
        };
        let messages = topics
            .into_iter()
            .map(|(topic, messages)| (topic.name, messages))
            .collect();
        Ok(BagSummary {
            messages,
            bytes,
            times: self.times,
        })
    }

    fn error(&self, source: McapError) -> WriteError {
        WriteError::Mcap {
            path: self.path(),
            source,
        }
    }
}

fn make_empty_directory(path: &Path) -> Result<(), WriteError> {
    let io_error = |source| WriteError::Io {
        path: path.to_owned(),
        source,
    };
    match fs::read_dir(path) {
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(_) => Err(WriteError::Exists {
                path: path.to_owned(),
            }),
        },
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            fs::create_dir_all(path).map_err(io_error)
        }
        Err(error) if error.kind() == io::ErrorKind::NotADirectory => Err(WriteError::Exists {
            path: path.to_owned(),
        }),
        Err(error) => Err(io_error(error)),
    }
}
