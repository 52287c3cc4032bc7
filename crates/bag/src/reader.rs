use std::{
    collections::{BTreeMap, VecDeque},
    fs,
    path::{Path, PathBuf},
};

use crate::{
    BagError, METADATA_FILE, Topic,
    mcap_file::{McapFile, Span},
    metadata::Metadata,
    records,
};

/// A bag that is complete: of one or several MCAP files.
pub struct BagReader {
    files: Vec<McapFile>,
    topics: Vec<Topic>,
    /// For each file, the index in `topics` of each channel.
    channels: Vec<BTreeMap<u16, usize>>,
    custom: BTreeMap<String, String>,
}

/// A message of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message<'a> {
    /// The topic it was published on.
    pub topic: &'a Topic,
    /// When it was recorded (ns).
    pub log_time: u64,
    /// When it was published (ns).
    pub publish_time: u64,
    /// The publisher's count.
    pub sequence: u32,
    /// CDR with its encapsulation header.
    pub data: Vec<u8>,
}

impl BagReader {
    /// Opens a bag's directory, or a single MCAP file.
    ///
    /// A directory without `metadata.yaml` is read if it holds a single MCAP file.
    ///
    /// # Errors
    /// See [`BagError`]. Damage within messages is found when they are read.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let io_error = |source| BagError::Io {
            path: path.to_owned(),
            source,
        };
        if !fs::metadata(path).map_err(io_error)?.is_dir() {
            return Self::from_files(&[path.to_owned()]);
        }
        let metadata_file = path.join(METADATA_FILE);
        if !metadata_file.exists() {
            return Self::from_files(&[single_mcap_file(path)?]);
        }
        let metadata = Metadata::read(&metadata_file)?;
        let files: Vec<_> = metadata
            .relative_file_paths
            .iter()
            .map(|file| path.join(file))
            .collect();
        let mut reader = Self::from_files(&files)?;
        reader.check_counts(&metadata, &metadata_file)?;
        // Other recorders than rosbag2 give the hash in one of the two places only.
        for topic in reader
            .topics
            .iter_mut()
            .filter(|topic| topic.type_hash.is_empty())
        {
            topic.type_hash = metadata.type_hash(topic).to_owned();
        }
        reader.custom = metadata.into_custom();
        Ok(reader)
    }

    fn from_files(paths: &[PathBuf]) -> Result<Self, BagError> {
        let files = paths
            .iter()
            .map(|path| McapFile::open(path))
            .collect::<Result<Vec<_>, _>>()?;
        let mut topics: Vec<Topic> = Vec::new();
        let mut index_of = |topic: &Topic| {
            let known = topics
                .iter()
                .position(|known| known.name == topic.name && known.type_name == topic.type_name);
            known.unwrap_or_else(|| {
                topics.push(topic.clone());
                topics.len() - 1
            })
        };
        let channels = files
            .iter()
            .map(|file| {
                file.topics
                    .iter()
                    .map(|(&channel, topic)| (channel, index_of(topic)))
                    .collect()
            })
            .collect();
        Ok(Self {
            files,
            topics,
            channels,
            custom: BTreeMap::new(),
        })
    }

    fn check_counts(&self, metadata: &Metadata, metadata_file: &Path) -> Result<(), BagError> {
        let Some(mut found) = self.message_counts() else {
            return Ok(());
        };
        let check = |topic: &str, expected, found| {
            if expected == found {
                return Ok(());
            }
            Err(BagError::Count {
                file: metadata_file.to_owned(),
                topic: topic.to_owned(),
                expected,
                found,
            })
        };
        for (topic, expected) in metadata.message_counts() {
            check(topic, expected, found.remove(topic).unwrap_or(0))?;
        }
        found
            .into_iter()
            .try_for_each(|(topic, found)| check(topic, 0, found))
    }

    /// All topics.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// What the recorder added to the bag's metadata.
    pub fn custom(&self) -> &BTreeMap<String, String> {
        &self.custom
    }

    /// Number of messages of each topic, if all files tell.
    pub fn message_counts(&self) -> Option<BTreeMap<&str, u64>> {
        let mut counts: BTreeMap<_, _> =
            self.topics.iter().map(|topic| (&*topic.name, 0)).collect();
        for file in &self.files {
            for (channel, count) in file.message_counts()? {
                if let Some(topic) = file.topics.get(channel) {
                    *counts.entry(&*topic.name).or_default() += count;
                }
            }
        }
        Some(counts)
    }

    /// First and last log time (ns), if the files tell and the bag has messages.
    pub fn times(&self) -> Option<(u64, u64)> {
        self.files
            .iter()
            .filter_map(McapFile::times)
            .reduce(|(first, last), (start, end)| (first.min(start), last.max(end)))
    }

    /// All messages in the order of their log times; those of one log time in the order of the files.
    ///
    /// Memory is bounded by the chunks that overlap in time, one as a rule; a file without chunk index is read whole.
    pub fn messages(&self) -> Messages<'_> {
        let mut spans: Vec<_> = self
            .files
            .iter()
            .enumerate()
            .flat_map(|(file, mcap)| mcap.spans.iter().map(move |&span| (file, span)))
            .collect();
        spans.sort_by_key(|&(file, span)| Position::start_of(file, span));
        Messages {
            bag: self,
            spans: spans.into(),
            pending: BTreeMap::new(),
        }
    }
}

fn single_mcap_file(directory: &Path) -> Result<PathBuf, BagError> {
    let io_error = |source| BagError::Io {
        path: directory.to_owned(),
        source,
    };
    let mut files = Vec::new();
    for entry in fs::read_dir(directory).map_err(io_error)? {
        let path = entry.map_err(io_error)?.path();
        if path
            .extension()
            .is_some_and(|extension| extension == "mcap")
        {
            files.push(path);
        }
    }
    match <[PathBuf; 1]>::try_from(files) {
        Ok([file]) => Ok(file),
        Err(files) => Err(BagError::NoBag {
            path: directory.to_owned(),
            found: files.len(),
        }),
    }
}

/// Iterator over the messages of a bag; ends after the first error.
pub struct Messages<'a> {
    bag: &'a BagReader,
    /// Not yet read, by file and in order.
    spans: VecDeque<(usize, Span)>,
    /// Read, not yet given out.
    pending: BTreeMap<Position, records::Message>,
}

/// Place of a message in the order of reading.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Position {
    log_time: u64,
    file: usize,
    offset: u64,
    index: usize,
}

impl Position {
    fn start_of(file: usize, span: Span) -> Self {
        Self {
            log_time: span.start_time,
            file,
            offset: span.offset,
            index: 0,
        }
    }
}

impl Messages<'_> {
    /// Reads spans until no unread one can hold a message before the first pending one.
    fn fill(&mut self) -> Result<(), BagError> {
        while let Some(&(file, span)) = self.spans.front() {
            let next = self.pending.first_key_value();
            if next.is_some_and(|(&next, _)| next < Position::start_of(file, span)) {
                break;
            }
            self.spans.pop_front();
            let messages = self.bag.files[file].read(span)?.into_iter().enumerate();
            self.pending.extend(messages.map(|(index, message)| {
                let position = Position {
                    log_time: message.log_time,
                    file,
                    offset: span.offset,
                    index,
                };
                (position, message)
            }));
        }
        Ok(())
    }
}

impl<'a> Iterator for Messages<'a> {
    type Item = Result<Message<'a>, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Err(error) = self.fill() {
            self.spans.clear();
            self.pending.clear();
            return Some(Err(error));
        }
        let (position, message) = self.pending.pop_first()?;
        let topic = self.bag.channels[position.file][&message.channel];
        Some(Ok(Message {
            topic: &self.bag.topics[topic],
            log_time: message.log_time,
            publish_time: message.publish_time,
            sequence: message.sequence,
            data: message.data,
        }))
    }
}
