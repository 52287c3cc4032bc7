use std::{
    collections::{BTreeMap, BTreeSet},
    mem,
    path::{Path, PathBuf},
};

use super::{
    Chunks, Messages,
    file::{McapFile, Repeated, topic},
    listing::Listing,
};
use crate::{
    BagError, LeftOutTopic, METADATA_FILE, Topic,
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
#[derive(Default)]
pub struct BagReader {
    directory: PathBuf,
    pub(super) files: Vec<OpenFile>,
    pub(super) topics: Vec<Topic>,
    /// Indexes of them by name and type.
    indexes: BTreeMap<(String, String), usize>,
    /// Number of messages of each topic, and how many of them are repeated.
    counts: Vec<u64>,
    repeats: Vec<u64>,
    left_out: Vec<LeftOutTopic>,
    custom: BTreeMap<String, String>,
    /// Files that are not there, of a bag without metadata that lists them.
    missing: Vec<PathBuf>,
    /// What is odd about the bag.
    odd: Vec<BagError>,
}

/// A file of a bag.
pub(super) struct OpenFile {
    pub mcap: McapFile,
    /// The index of each channel's topic.
    pub channels: BTreeMap<u16, usize>,
    /// How many of the first messages of each span are repeated from an earlier file, by offset.
    pub repeated: BTreeMap<u64, usize>,
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
    /// Number of its messages, without those of topics left out.
    pub messages: u64,
    /// How many of them are repeated from an earlier file.
    pub repeated: u64,
    /// Why not all of it can be read.
    pub fault: Option<&'a BagError>,
}

impl BagReader {
    /// Opens a bag's directory, or a single MCAP file.
    ///
    /// The files of a directory without `metadata.yaml` are read in the order of the numbers in their names.
    ///
    /// # Errors
    /// See [`BagError`]. Damage within messages is found when they are read.
    pub fn open(path: &Path) -> Result<Self, BagError> {
        let (mut reader, faults) = Self::open_damaged(path)?;
        let files = reader.files.iter_mut();
        let of_files = files.filter_map(|file| file.mcap.fault.take());
        match of_files.chain(faults).next() {
            Some(fault) => Err(fault),
            None => Ok(reader),
        }
    }

    /// Opens what is readable of a bag of which files are damaged, cut off or missing; what is wrong with the bag besides the
    /// [faults](BagFile::fault) of these files.
    ///
    /// # Errors
    /// It is no bag, or none of its files has a readable beginning.
    pub fn open_damaged(path: &Path) -> Result<(Self, Vec<BagError>), BagError> {
        let mut listing = Listing::read(path, true)?;
        let metadata = listing.metadata.take().transpose()?;
        let mut faults = mem::take(&mut listing.faults);
        let mut reader = Self::default();
        if metadata.is_none() {
            reader.missing = listing.gaps();
            listing.files.append(&mut listing.others);
        }
        for other in &listing.others {
            let reason = "is not listed in metadata.yaml, and not read";
            let odd = BagError::invalid(&listing.directory.join(other), reason);
            reader.odd.push(odd);
        }
        for file in &listing.files {
            match McapFile::open(&listing.directory.join(file)) {
                Ok(file) => faults.extend(reader.add(file).err()),
                Err(error) => faults.push(error),
            }
        }
        if reader.files.is_empty() && !faults.is_empty() {
            return Err(faults.swap_remove(0));
        }
        reader.left_out.sort();
        reader.left_out.dedup();
        if let Some(metadata) = metadata {
            let file = listing.directory.join(METADATA_FILE);
            faults.extend(reader.check_counts(&file, &metadata).err());
            // Other recorders than rosbag2 give the hash in one of the two places only.
            let hashes = metadata.type_hashes();
            let topics = reader.topics.iter_mut();
            for topic in topics.filter(|topic| topic.type_hash.is_empty()) {
                let hash = hashes.get(&(&*topic.name, &*topic.type_name));
                topic.type_hash = hash.copied().unwrap_or_default().to_owned();
            }
            reader.custom = metadata.into_custom();
        }
        reader.directory = listing.directory;
        Ok((reader, faults))
    }

    /// Adds the next file; an error if it does not tell correctly what it repeats.
    fn add(&mut self, mcap: McapFile) -> Result<(), BagError> {
        let (mut repeated, mut fault) = (Repeated::default(), Ok(()));
        if !self.files.is_empty() {
            let found = mcap.repeated_messages();
            fault = found.map(|found| repeated = found);
        }
        let mut channels = BTreeMap::new();
        for (id, channel) in &mcap.contents.channels {
            match topic(&mcap.source.path, channel, &mcap.contents.schemas) {
                Err(topic) => self.left_out.push(topic),
                Ok((topic, odd)) => {
                    self.odd.extend(odd);
                    let index = self.add_topic(topic);
                    let of = |counts: &BTreeMap<u16, u64>| counts.get(id).copied().unwrap_or(0);
                    let count = of(&mcap.contents.counts);
                    self.counts[index] = self.counts[index].saturating_add(count);
                    self.repeats[index] += of(&repeated.by_channel);
                    channels.insert(*id, index);
                }
            }
        }
        self.files.push(OpenFile {
            mcap,
            channels,
            repeated: repeated.by_span,
        });
        fault
    }

    /// The index of a topic, which is added to those of the files before or combined with one of them.
    fn add_topic(&mut self, topic: Topic) -> usize {
        let key = (topic.name.clone(), topic.type_name.clone());
        let index = *self.indexes.entry(key).or_insert(self.topics.len());
        match self.topics.get_mut(index) {
            None => {
                self.topics.push(topic);
                self.counts.push(0);
                self.repeats.push(0);
            }
            Some(known) => {
                known.qos = known.qos.strongest(topic.qos);
                if known.type_hash.is_empty() {
                    known.type_hash = topic.type_hash;
                }
            }
        }
        index
    }

    /// Holds what the metadata tells against the files: messages were lost, or belong to another bag, if they disagree.
    fn check_counts(&self, file: &Path, metadata: &Metadata) -> Result<(), BagError> {
        let (told, found) = (metadata.message_counts(), self.by_name(&self.counts));
        // Topics that are left out may be counted or not.
        let left_out: BTreeSet<_> = self.left_out.iter().map(|topic| &*topic.name).collect();
        let mut counts = Vec::new();
        for name in told.keys().chain(found.keys()) {
            if !left_out.contains(name) {
                let [told, found] = [&told, &found].map(|counts| counts.get(name).copied());
                let of = format!(" of {name}");
                counts.push((of, told.unwrap_or(0), found.unwrap_or(0)));
            }
        }
        if left_out.is_empty() {
            let found = sum(self.counts.iter().copied());
            counts.push((String::new(), metadata.message_count, found));
        }
        match counts.into_iter().find(|(_, told, found)| told != found) {
            None => Ok(()),
            Some((of, told, found)) => {
                let hold = format!("{told}, but the bag's files hold {found}");
                Err(BagError::invalid(
                    file,
                    format!("message_count{of} is {hold}"),
                ))
            }
        }
    }

    fn by_name(&self, counts: &[u64]) -> BTreeMap<&str, u64> {
        let mut sums = BTreeMap::new();
        for (topic, count) in self.topics.iter().zip(counts) {
            let sum: &mut u64 = sums.entry(&*topic.name).or_default();
            *sum = sum.saturating_add(*count);
        }
        sums
    }

    /// Number of messages of each topic, in the order of [`topics`](Self::topics); messages repeated at the head of a
    /// further file do not count.
    pub fn topic_counts(&self) -> Vec<u64> {
        let counts = self.counts.iter().zip(&self.repeats);
        counts
            .map(|(count, repeated)| count.saturating_sub(*repeated))
            .collect()
    }

    /// The same by the names of topics, of which one may be of several types.
    pub fn message_counts(&self) -> BTreeMap<&str, u64> {
        self.by_name(&self.topic_counts())
    }

    /// Number of messages of each topic that are repeated at the head of a further file.
    pub fn repeats(&self) -> BTreeMap<&str, u64> {
        let mut repeats = self.by_name(&self.repeats);
        repeats.retain(|_, count| *count > 0);
        repeats
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
    pub fn warnings(&self) -> &[BagError] {
        &self.odd
    }

    /// What the recorder added to the bag's metadata.
    pub fn custom(&self) -> &BTreeMap<String, String> {
        &self.custom
    }

    /// Reads every file as a whole; the first fault of each. Every record must be readable, every checksum must match,
    /// definitions of one id must be equal, and all indexes, offsets and statistics must agree with the records. Opening a
    /// bag reads only the ends of its files.
    pub fn check(&self) -> Vec<BagError> {
        let files = self.files.iter().map(|file| &file.mcap);
        let whole = files.filter(|mcap| mcap.fault.is_none());
        whole.filter_map(|mcap| mcap.check().err()).collect()
    }

    /// The bag's files in their order.
    pub fn files(&self) -> impl Iterator<Item = BagFile<'_>> {
        self.files.iter().map(|file| {
            let mcap = &file.mcap;
            let counts = mcap.contents.counts.iter();
            let known = counts.filter(|(channel, _)| file.channels.contains_key(channel));
            BagFile {
                path: &mcap.source.path,
                size: mcap.source.size,
                chunks: &mcap.contents.chunks,
                times: mcap.contents.times,
                messages: sum(known.map(|(_, count)| *count)),
                repeated: file.repeated.values().sum::<usize>() as u64,
                fault: mcap.fault.as_ref(),
            }
        })
    }

    /// Files that are not there, of a bag without `metadata.yaml`: the numbers in the names of the others have a gap there.
    pub fn missing(&self) -> Vec<BagError> {
        let reason = "is not there, though the bag has files with a number before and after it";
        let missing = self.missing.iter().map(|file| self.directory.join(file));
        missing
            .map(|file| BagError::invalid(&file, reason))
            .collect()
    }

    /// First and last log time (ns), if the bag has messages.
    pub fn times(&self) -> Option<(u64, u64)> {
        around(
            self.files
                .iter()
                .filter_map(|file| file.mcap.contents.times),
        )
    }

    /// All messages in the order of their log times, without those repeated at the head of a further file; those of one
    /// log time in the order of the files.
    pub fn messages(&self) -> Messages<'_> {
        self.messages_of(0, |_| true)
    }

    /// The messages whose log time (ns) is not before `start` of the topics that are wanted, as [`messages`](Self::messages)
    /// gives them; chunks that have none of them are not read. `wanted` is asked once about each topic, in the order of
    /// [`topics`](Self::topics).
    pub fn messages_of(&self, start: u64, wanted: impl FnMut(&Topic) -> bool) -> Messages<'_> {
        Messages::new(self, start, self.topics.iter().map(wanted).collect())
    }
}
