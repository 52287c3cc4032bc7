//! Tables of messages of any definition.

use std::{collections::BTreeMap, path::Path};

use lgvi_bag::{BagOptions, BagReader, BagWriter, Compression, Qos, Topic, WriteError};
use lgvi_tables::{Format, Options, convert};

use super::scratch;

const ZSTD_FRAME: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];

/// The first byte chooses the format by its lowest bit, and by the others how long arrays are spread; up to a NUL follows
/// the definition of a message, and then payloads, each behind its length in two bytes.
pub fn tables(data: &[u8]) {
    let Some((&choice, data)) = data.split_first() else {
        return;
    };
    let end = data
        .iter()
        .position(|byte| *byte == 0)
        .unwrap_or(data.len());
    let Ok(definition) = str::from_utf8(&data[..end]) else {
        return;
    };
    let mut payloads = Vec::new();
    let mut left = data.get(end + 1..).unwrap_or_default();
    while let Some((length, rest)) = left.split_first_chunk::<2>() {
        let length = usize::from(u16::from_le_bytes(*length)).min(rest.len());
        let (payload, rest) = rest.split_at(length);
        payloads.push(payload);
        left = rest;
    }
    let format = match choice & 1 {
        0 => Format::Csv,
        _ => Format::Parquet,
    };
    let options = Options {
        format,
        topics: Vec::new(),
        max_elements: usize::from(choice >> 1),
    };
    converted(definition, &payloads, &options);
}

fn converted(definition: &str, payloads: &[&[u8]], options: &Options) {
    let directory = scratch();
    let path = directory.path().join("bag");
    let bag = match bag(&path, definition, payloads).map(|()| BagReader::open(&path)) {
        Ok(Ok(bag)) => bag,
        Ok(Err(error)) => panic!("a bag of ours that is refused: {error}"),
        Err(error) => panic!("no bag was made: {error}"),
    };
    let compressed = payloads
        .iter()
        .any(|payload| payload.starts_with(ZSTD_FRAME));
    let conversion = match convert(&bag, &directory.path().join("tables"), options) {
        Ok(conversion) => conversion,
        // A message that is compressed by itself, and cannot be unpacked.
        Err(_) if compressed => return,
        Err(error) => panic!("{error}"),
    };
    assert_eq!(conversion.files.len() + conversion.left_out.len(), 1);
    for table in &conversion.files {
        assert_eq!(table.rows, payloads.len() as u64);
        assert!(table.file.is_file());
    }
}

fn bag(path: &Path, definition: &str, payloads: &[&[u8]]) -> Result<(), WriteError> {
    let options = BagOptions {
        compression: Compression::None,
        ..BagOptions::default()
    };
    let mut bag = BagWriter::create(path, options)?;
    let topic = bag.add_topic(&Topic {
        name: "/a".to_owned(),
        type_name: "a_msgs/msg/A".to_owned(),
        type_hash: String::new(),
        definition: definition.to_owned(),
        definition_encoding: lgvi_bag::ROS2MSG.to_owned(),
        qos: Qos::default(),
    })?;
    for (sequence, payload) in (0_u32..).zip(payloads) {
        let time = u64::from(sequence);
        bag.write(topic, time, time, sequence, payload)?;
    }
    bag.finish(BTreeMap::new())?;
    Ok(())
}
