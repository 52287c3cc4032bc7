//! Writing bags: messages a second of processor time beside the crate mcap alone, and bytes a message takes.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use lgvi_bag::{BagOptions, BagWriter, Compression, Qos, ROS2MSG, Topic};
use lgvi_msgs::msg::{BodyState, SystemState};
use lgvi_msgs::{RosMessage, cdr};
use mcap::WriteOptions;
use mcap::records::MessageHeader;

use crate::clock::Moment;
use crate::error::BenchError;
use crate::spread::Spread;
use crate::tables::Table;

/// Messages of one measurement.
const MESSAGES: u32 = 50_000;

/// Different ones among them.
const DIFFERENT: u32 = 5_000;

/// Bodies of the states that are written: about 300 B and 1 kB.
const BODIES: [usize; 2] = [2, 7];

const COMPRESSIONS: [(&str, Compression); 3] = [
    ("none", Compression::None),
    ("lz4", Compression::Lz4),
    ("zstd", Compression::Zstd),
];

/// Measures, keeps the table `bag`.
pub(crate) fn run(repeats: u32, directory: &Path) -> Result<(), BenchError> {
    let folder = tempfile::tempdir().map_err(failed)?;
    let mut table = Table::new([
        "message (B)",
        "compression",
        "lgvi (1/s)",
        "mcap (1/s)",
        "ratio of rates",
        "lgvi (B each)",
        "mcap (B each)",
    ]);
    for bodies in BODIES {
        let messages = (0..DIFFERENT).map(|step| state(bodies, step));
        let messages = messages.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        for (name, compression) in COMPRESSIONS {
            let mut seconds = [Vec::new(), Vec::new()];
            let mut bytes = [0; 2];
            // In turns, so that what else the machine does falls on both.
            for repeat in 0..repeats {
                let bag = folder.path().join(format!("{name}_{bodies}_{repeat}"));
                let alone = bag.with_extension("mcap");
                let measured = [
                    ours(&bag, compression, &messages)?,
                    bare(&alone, compression, &messages)?,
                ];
                for (which, (time, size)) in measured.into_iter().enumerate() {
                    seconds[which].push(time);
                    bytes[which] = size;
                }
                std::fs::remove_dir_all(&bag).map_err(failed)?;
                std::fs::remove_file(&alone).map_err(failed)?;
            }
            let rate = |times: &Vec<f64>| {
                let spread = Spread::of(times.iter().copied());
                let rate = spread.map(|spread| f64::from(MESSAGES) / spread.median);
                rate.map_or_else(String::new, |rate| format!("{rate:.0}"))
            };
            let ratio = Spread::of_ratios(&seconds[1], &seconds[0]);
            let each = bytes.map(|bytes| format!("{:.1}", bytes as f64 / f64::from(MESSAGES)));
            let [own, alone] = each;
            table.row([
                messages[0].len().to_string(),
                name.to_owned(),
                rate(&seconds[0]),
                rate(&seconds[1]),
                ratio.map_or_else(String::new, |ratio| ratio.to_string()),
                own,
                alone,
            ]);
        }
    }
    table.keep(directory, "bag")
}

/// Processor time (s) and size of a bag.
fn ours(
    path: &Path,
    compression: Compression,
    messages: &[Vec<u8>],
) -> Result<(f64, u64), BenchError> {
    let begun = Moment::now();
    let options = BagOptions {
        compression,
        ..BagOptions::default()
    };
    let mut writer = BagWriter::create(path, options).map_err(failed)?;
    let topic = Topic {
        name: "/state".to_owned(),
        type_name: SystemState::TYPE_NAME.to_owned(),
        type_hash: SystemState::TYPE_HASH.to_owned(),
        definition: SystemState::DEFINITION.to_owned(),
        definition_encoding: ROS2MSG.to_owned(),
        qos: Qos::default(),
    };
    let topic = writer.add_topic(&topic).map_err(failed)?;
    for (sequence, message) in (0..MESSAGES).zip(messages.iter().cycle()) {
        let time = u64::from(sequence) * 100_000;
        writer
            .write(topic, time, time, sequence, message)
            .map_err(failed)?;
    }
    let summary = writer.finish(BTreeMap::new()).map_err(failed)?;
    Ok((begun.elapsed(), summary.bytes))
}

/// The same of a file that the crate mcap writes, with chunks of the same size.
fn bare(
    path: &Path,
    compression: Compression,
    messages: &[Vec<u8>],
) -> Result<(f64, u64), BenchError> {
    let begun = Moment::now();
    let compression = match compression {
        Compression::None => None,
        Compression::Lz4 => Some(mcap::Compression::Lz4),
        Compression::Zstd => Some(mcap::Compression::Zstd),
    };
    let file = BufWriter::new(File::create_new(path).map_err(failed)?);
    let mut writer = WriteOptions::new()
        .profile("ros2")
        .compression(compression)
        .compression_level(1)
        .compression_threads(0)
        .create(file)
        .map_err(failed)?;
    let definition = SystemState::DEFINITION.as_bytes();
    let schema = writer.add_schema(SystemState::TYPE_NAME, ROS2MSG, definition);
    let channel_id = schema
        .and_then(|schema| writer.add_channel(schema, "/state", "cdr", &BTreeMap::new()))
        .map_err(failed)?;
    for (sequence, message) in (0..MESSAGES).zip(messages.iter().cycle()) {
        let time = u64::from(sequence) * 100_000;
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time: time,
            publish_time: time,
        };
        writer
            .write_to_known_channel(&header, message)
            .map_err(failed)?;
    }
    writer.finish().map_err(failed)?;
    let size = std::fs::metadata(path).map_err(failed)?.len();
    Ok((begun.elapsed(), size))
}

/// A state of a smooth flight: its numbers change slowly, their last bits do not repeat.
fn state(bodies: usize, step: u32) -> Result<Vec<u8>, cdr::CdrError> {
    let time = f64::from(step) * 1e-4;
    let body = |index: usize| {
        let mut phase = index as f64;
        let mut next = || {
            phase += 0.7;
            (phase + time).sin()
        };
        BodyState {
            name: format!("body{index}"),
            position: [next(), next(), next()],
            linear_momentum: [next(), next(), next()],
            attitude: std::array::from_fn(|_| next()),
            angular_momentum: [next(), next(), next()],
        }
    };
    cdr::encode(&SystemState {
        sequence: u64::from(step),
        step: u64::from(step),
        time,
        bodies: (0..bodies).map(body).collect(),
        ..SystemState::default()
    })
}

fn failed(error: impl std::fmt::Display) -> BenchError {
    BenchError::Bag(error.to_string())
}
