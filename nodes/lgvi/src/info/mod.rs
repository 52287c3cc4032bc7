//! What is in a bag, of any recorder.

mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use lgvi_bag::{BagReader, Chunks, LeftOutTopic, Topic};
use lgvi_middleware::node::NodeError;
use serde::Serialize;

use crate::output::say;
use crate::values;

/// The command line of `lgvi info`.
#[derive(Args)]
pub(crate) struct Options {
    /// Directory of the bag, or one MCAP file, from any recorder.
    #[arg(value_parser = values::path())]
    bag: PathBuf,
    /// Read the whole bag and verify every checksum.
    #[arg(long)]
    check: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Everything known about a bag.
#[derive(Debug, Serialize)]
struct Info {
    bag: String,
    /// Whether all files are whole and hold what the metadata says.
    complete: bool,
    /// Whether the whole bag was read for that, or only the summaries of its files.
    checked: bool,
    /// Faults.
    faults: Vec<String>,
    /// Harmless oddities.
    warnings: Vec<String>,
    /// First and last log time (ns since the UNIX epoch).
    start: Option<u64>,
    end: Option<u64>,
    /// From the first to the last log time (s).
    duration: f64,
    /// Messages, without those repeated at the head of a further file.
    messages: u64,
    repeated: u64,
    /// Size of all files (bytes).
    bytes: u64,
    files: Vec<File>,
    /// Chunks by their compression.
    chunks: BTreeMap<String, ChunkSizes>,
    topics: Vec<TopicInfo>,
    /// Topics whose messages cannot be read, and do not count.
    left_out: Vec<LeftOut>,
    /// Entries that the recorder added to the bag's metadata.
    custom: BTreeMap<String, String>,
}

#[derive(Debug, Serialize)]
struct File {
    path: String,
    bytes: u64,
    /// Messages, including repeated ones.
    messages: u64,
    repeated: u64,
    start: Option<u64>,
    end: Option<u64>,
    /// The reason why a part cannot be read.
    fault: Option<String>,
}

#[derive(Debug, Default, Serialize)]
struct ChunkSizes {
    count: u64,
    /// Bytes in the files.
    packed: u64,
    /// Bytes of the records.
    unpacked: u64,
}

#[derive(Debug, Serialize)]
struct TopicInfo {
    name: String,
    #[serde(rename = "type")]
    type_name: String,
    type_hash: String,
    definition_encoding: String,
    messages: u64,
    repeated: u64,
    /// Messages a second, over the bag's duration.
    rate: Option<f64>,
    /// Messages lost, as the recorder reports them.
    lost: Option<String>,
    reliability: &'static str,
    durability: &'static str,
    history: &'static str,
    depth: u32,
}

#[derive(Debug, Serialize)]
struct LeftOut {
    name: String,
    #[serde(rename = "type")]
    type_name: String,
    reason: String,
}

/// Prints the contents of a bag; exit code 0 if it is complete, 1 if only a part can be read.
pub(crate) fn info(options: &Options) -> Result<ExitCode, NodeError> {
    let (bag, mut faults) = open(&options.bag)?;
    faults.extend(bag.missing().iter().map(ToString::to_string));
    if options.check {
        let found = bag.check();
        faults.extend(found.iter().map(ToString::to_string));
    }
    let info = Info::of(options, &bag, faults);
    if options.json {
        say(&serde_json::to_string(&info).map_err(NodeError::runtime)?)?;
    } else {
        say(&info)?;
    }
    Ok(ExitCode::from(u8::from(!info.complete)))
}

/// The bag and its faults.
fn open(path: &Path) -> Result<(BagReader, Vec<String>), NodeError> {
    let (bag, others) = BagReader::open_damaged(path).map_err(NodeError::input)?;
    let damaged = bag.files().filter_map(|file| file.fault);
    let faults = damaged.chain(&others).map(ToString::to_string).collect();
    Ok((bag, faults))
}

impl Info {
    fn of(options: &Options, bag: &BagReader, faults: Vec<String>) -> Self {
        let counts = bag.topic_counts();
        let repeats = bag.repeats();
        let times = bag.times();
        let duration = times.map_or(0.0, |(start, end)| end.saturating_sub(start) as f64 / 1e9);
        let topics = bag
            .topics()
            .iter()
            .zip(&counts)
            .map(|(topic, &messages)| TopicInfo {
                repeated: repeats.get(&*topic.name).copied().unwrap_or(0),
                lost: bag.custom().get(&format!("lost:{}", topic.name)).cloned(),
                rate: (duration > 0.0).then(|| messages as f64 / duration),
                ..TopicInfo::of(topic, messages)
            });
        let files: Vec<_> = bag
            .files()
            .map(|file| File {
                path: file.path.display().to_string(),
                bytes: file.size,
                messages: file.messages,
                repeated: file.repeated,
                start: file.times.map(|(start, _)| start),
                end: file.times.map(|(_, end)| end),
                fault: file.fault.map(ToString::to_string),
            })
            .collect();
        let mut chunks = BTreeMap::<_, ChunkSizes>::new();
        for (compression, found) in bag.files().flat_map(|file| file.chunks) {
            let Chunks {
                count,
                packed,
                unpacked,
            } = *found;
            let name = if compression.is_empty() {
                "none"
            } else {
                compression
            };
            let sizes = chunks.entry(name.to_owned()).or_default();
            sizes.count = sizes.count.saturating_add(count);
            sizes.packed = sizes.packed.saturating_add(packed);
            sizes.unpacked = sizes.unpacked.saturating_add(unpacked);
        }
        Self {
            bag: options.bag.display().to_string(),
            complete: faults.is_empty(),
            checked: options.check,
            faults,
            warnings: bag.warnings().iter().map(ToString::to_string).collect(),
            start: times.map(|(start, _)| start),
            end: times.map(|(_, end)| end),
            duration,
            messages: sum(counts.iter()),
            repeated: sum(repeats.values()),
            bytes: sum(files.iter().map(|file| &file.bytes)),
            topics: topics.collect(),
            left_out: bag.left_out().iter().map(LeftOut::of).collect(),
            files,
            chunks,
            custom: bag.custom().clone(),
        }
    }
}

/// The sum of damaged counts is wrong, but no reason to stop.
fn sum<'a>(counts: impl Iterator<Item = &'a u64>) -> u64 {
    counts.fold(0, |sum, count| sum.saturating_add(*count))
}

impl LeftOut {
    fn of(topic: &LeftOutTopic) -> Self {
        let LeftOutTopic {
            name,
            type_name,
            reason,
        } = topic.clone();
        Self {
            name,
            type_name,
            reason,
        }
    }
}

impl TopicInfo {
    fn of(topic: &Topic, messages: u64) -> Self {
        Self {
            name: topic.name.clone(),
            type_name: topic.type_name.clone(),
            type_hash: topic.type_hash.clone(),
            definition_encoding: topic.definition_encoding.clone(),
            messages,
            repeated: 0,
            rate: None,
            lost: None,
            reliability: topic.qos.reliability(),
            durability: topic.qos.durability(),
            history: topic.qos.history.name(),
            depth: topic.qos.depth,
        }
    }
}
