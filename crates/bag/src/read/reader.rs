use std::{
    collections::{BTreeMap, BTreeSet, btree_map::Entry},
    path::{Path, PathBuf},
};

use super::{
    Chunks, Messages,
    file::McapFile,
    listing::{Listing, gaps},
};
use crate::{
    BagError, LeftOutTopic, Topic,
    metadata::Metadata,
    times::{around, sum},
};

/// A bag of one or several MCAP files, of any recorder that follows rosbag2.
///
/// Chunks may be compressed with lz4 or zstd, files or messages as a whole with zstd (rosbag2's compression modes `FILE`
/// and `MESSAGE`). A file that tells of its messages at its end, as rosbag2's do, is opened by reading that only; another
/// one is read through once. A file that is compressed as a whole is unpacked into a temporary file.
///
/// # Assumptions and limitations
/// Memory is that of the chunks that overlap in time, one of 768 KiB as a rule: no chunk over 256 MiB is read, and none
/// beyond 512 MiB of overlapping ones; no message is over 64 MiB. Attachments and others' metadata records are skipped, and
/// so are topics of other messages than CDR or without a schema: [`left_out`](Self::left_out).
pub struct BagReader {
    pub(crate) files: Vec<McapFile>,
    pub(crate) topics: Vec<Topic>,
    left_out: Vec<LeftOutTopic>,
    /// For each file, the index in `topics` of each channel.
    pub(crate) channels: Vec<BTreeMap<u16, usize>>,
    /// For each file, how many of the first messages of each span are repeated from an earlier file, by offset.
    pub(crate) repeated: Vec<BTreeMap<u64, usize>>,
    custom: BTreeMap<String, String>,
    /// Where the files lie, of a bag without metadata that lists them.
    pub(crate) unlisted: Option<PathBuf>,
    /// What is odd about the bag's directory.
    odd: Vec<BagError>,
}

/// What is known of one file of a bag.
#[derive(Debug)]
pub struct BagFile<'a> {
    /// Where it lies.
    pub path: &'a Path,
    /// Its size (bytes), of the unpacked one if it is compressed as a whole.
    pub size: u64,
    /// Its chunks by their compression, which is empty for none.
    pub chunks: &'a BTreeMap<String, Chunks>,
    /// First and last log time (ns) of its messages.
    pub times: Option<(u64, u64)>,
    /// Number of its messages, without those of topics left out, if it tells.
    pub messages: Option<u64>,
    /// How many of them are repeated from an earlier file.
    pub repeated: u64,
    /// Why not all of it can be read.
    pub fault: Option<&'a BagError>,
}

impl BagReader {
    /// Opens a bag's directory, or a single MCAP file.
    ///
    /// The files of a directory without `metadata.yaml` are read in the natural order of their names.
    ///
    /// # Errors
    /// See [`BagError`]. Damage within messages is found when they are read.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let mut listing = Listing::read(path)?;
        let (mut reader, faults) = Self::assemble(&mut listing, McapFile::open)?;
        if let Some(fault) = faults.into_iter().next() {
            return Err(fault);
        }
        if let Some((file, metadata)) = &listing.metadata {
            reader.check_counts(metadata, file)?;
        }
        reader.describe(listing);
        Ok(reader)
    }

    /// Opens what is readable of a bag of which files are damaged, cut off or missing; what is wrong with them, in the
    /// order of the files.
    ///
    /// # Errors
    /// It is no bag, or none of its files has a readable beginning.
    pub fn open_damaged(path: &Path) -> Result<(Self, Vec<BagError>), BagError> {
        let mut listing = Listing::read(path)?;
        let open =
            |file: &Path| McapFile::open(file).or_else(|fault| McapFile::open_damaged(file, fault));
        let (mut reader, faults) = Self::assemble(&mut listing, open)?;
        reader.describe(listing);
        Ok((reader, faults))
    }

    /// Opens the files of a bag, of which there must be one; the faults of the others.
    fn assemble(
        listing: &mut Listing,
        open: impl Fn(&Path) -> Result<McapFile, BagError>,
    ) -> Result<(Self, Vec<BagError>), BagError> {
        let mut faults = std::mem::take(&mut listing.faults);
        let mut opened = Vec::new();
        for file in &listing.files {
            match open(file) {
                Ok(file) => opened.push(file),
                Err(error) => faults.push(error),
            }
        }
        if opened.is_empty() && !faults.is_empty() {
            return Err(faults.swap_remove(0));
        }
        let mut reader = Self::new(opened);
        for file in reader.files.iter().skip(1) {
            let repeated = file.repeated_messages();
            let repeated = repeated.map_err(|error| faults.push(error));
            reader.repeated.push(repeated.unwrap_or_default());
        }
        Ok((reader, faults))
    }

    fn new(files: Vec<McapFile>) -> Self {
        let mut topics: Vec<Topic> = Vec::new();
        let mut indexes = BTreeMap::new();
        let mut index_of = |topic: &Topic| {
            let key = (topic.name.clone(), topic.type_name.clone());
            match indexes.entry(key) {
                Entry::Occupied(index) => {
                    let index = *index.get();
                    let known: &mut Topic = &mut topics[index];
                    known.qos = known.qos.strongest(topic.qos);
                    if known.type_hash.is_empty() {
                        known.type_hash.clone_from(&topic.type_hash);
                    }
                    index
                }
                Entry::Vacant(index) => {
                    topics.push(topic.clone());
                    *index.insert(topics.len() - 1)
                }
            }
        };
        let channels = files.iter().map(|file| {
            let channels = file.topics.iter();
            channels
                .map(|(&channel, topic)| (channel, index_of(topic)))
                .collect()
        });
        let left_out: BTreeSet<_> = files.iter().flat_map(|file| &file.left_out).collect();
        let left_out = left_out.into_iter().cloned().collect();
        Self {
            left_out,
            channels: channels.collect(),
            files,
            topics,
            repeated: vec![BTreeMap::new()],
            custom: BTreeMap::new(),
            unlisted: None,
            odd: Vec::new(),
        }
    }

    /// Takes over what only the directory and the metadata tell.
    fn describe(&mut self, listing: Listing) {
        self.unlisted = listing.unlisted;
        self.odd = listing.odd;
        let Some((_, metadata)) = listing.metadata else {
            return;
        };
        // Other recorders than rosbag2 give the hash in one of the two places only.
        let hashes = metadata.type_hashes();
        for topic in &mut self.topics {
            if topic.type_hash.is_empty() {
                let hash = hashes.get(&(&*topic.name, &*topic.type_name));
                topic.type_hash = hash.copied().unwrap_or("").to_owned();
            }
        }
        self.custom = metadata.into_custom();
    }

    fn check_counts(&self, metadata: &Metadata, metadata_file: &Path) -> Result<(), BagError> {
        let Some(found) = self.counts_of_topics() else {
            return Ok(());
        };
        let mut found = self.by_name(&found);
        let check = |topic: Option<&str>, expected, found| {
            if expected == found {
                return Ok(());
            }
            Err(BagError::Count {
                file: metadata_file.to_owned(),
                topic: topic.map(str::to_owned),
                expected,
                found,
            })
        };
        let left_out = self.left_out.iter().map(|topic| &*topic.name);
        let left_out: BTreeSet<_> = left_out.collect();
        found.retain(|topic, _| !left_out.contains(topic));
        for (topic, expected) in metadata.message_counts() {
            if left_out.contains(topic) {
                continue;
            }
            check(Some(topic), expected, found.remove(topic).unwrap_or(0))?;
        }
        found
            .into_iter()
            .try_for_each(|(topic, found)| check(Some(topic), 0, found))?;
        let found = self.files.iter().flat_map(|file| &file.contents.counts);
        let found = found.flat_map(BTreeMap::values);
        let found = sum(found.copied());
        // Topics that are left out may be counted or not.
        if left_out.is_empty() {
            check(None, metadata.message_count, found)?;
        }
        Ok(())
    }

    /// All topics. One that has been published with several qualities of service has the strongest of each policy.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Topics whose messages cannot be given out, and why; in the order of their names.
    pub fn left_out(&self) -> &[LeftOutTopic] {
        &self.left_out
    }

    /// What is odd about the bag and does not keep it from being read.
    pub fn warnings(&self) -> impl Iterator<Item = &BagError> {
        self.odd
            .iter()
            .chain(self.files.iter().flat_map(|file| &file.odd))
    }

    /// What the recorder added to the bag's metadata.
    pub fn custom(&self) -> &BTreeMap<String, String> {
        &self.custom
    }

    /// Reads every file as a whole; the faults, in the order of the files: all damaged chunks of a file, or else its first
    /// fault. Every record must be readable, every checksum must match, definitions of one id must be equal, and all
    /// indexes, offsets and statistics must agree with the records. Opening a bag reads only the ends of its files.
    pub fn check(&self) -> Vec<BagError> {
        let files = self.files.iter();
        files
            .filter(|file| file.fault.is_none())
            .flat_map(McapFile::check)
            .collect()
    }

    /// The bag's files in their order.
    pub fn files(&self) -> impl Iterator<Item = BagFile<'_>> {
        self.files.iter().enumerate().map(|(index, file)| BagFile {
            path: file.path(),
            size: file.size(),
            chunks: &file.contents.chunks,
            times: file.contents.times,
            messages: file.contents.counts.as_ref().map(|counts| {
                let known = counts.iter();
                let known = known.filter(|(channel, _)| file.topics.contains_key(channel));
                sum(known.map(|(_, count)| *count))
            }),
            repeated: self.repeated_of(index).map(|(_, count)| count).sum(),
            fault: file.fault.as_ref(),
        })
    }

    /// Files that are not there, of a bag without `metadata.yaml`: the numbers in the names of the others have a gap there.
    pub fn missing(&self) -> Vec<BagError> {
        let Some(directory) = &self.unlisted else {
            return Vec::new();
        };
        let names = self.files.iter().filter_map(|file| file.path().file_name());
        let names: Vec<PathBuf> = names.map(PathBuf::from).collect();
        let missing = gaps(&names).into_iter().map(|name| directory.join(name));
        let missing = missing.filter(|file| !file.exists());
        missing.map(|file| BagError::Missing { file }).collect()
    }

    /// First and last log time (ns), if the bag has messages.
    pub fn times(&self) -> Option<(u64, u64)> {
        around(self.files.iter().filter_map(|file| file.contents.times))
    }

    /// All messages in the order of their log times, without those repeated at the head of a further file; those of one
    /// log time in the order of the files.
    pub fn messages(&self) -> Messages<'_> {
        self.messages_from(0)
    }

    /// The messages whose log time (ns) is not before `start`, as [`messages`](Self::messages) gives them; chunks before
    /// it are not read.
    pub fn messages_from(&self, start: u64) -> Messages<'_> {
        self.messages_of(start, |_| true)
    }

    /// The messages from `start` (ns) on of the topics that are wanted, as [`messages`](Self::messages) gives them; chunks
    /// that have none of them are not read. `wanted` is asked once about each topic, in the order of
    /// [`topics`](Self::topics).
    pub fn messages_of(&self, start: u64, wanted: impl FnMut(&Topic) -> bool) -> Messages<'_> {
        Messages::new(self, start, self.topics.iter().map(wanted).collect())
    }
}
