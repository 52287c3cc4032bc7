//! What `recover` keeps of bags of other recorders, and of several publishers.

use std::{collections::BTreeMap, fs, path::Path};

use crate::common::{chunks, latched, payload, read_all, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, Qos, recover};
use mcap::{WriteOptions, records::MessageHeader};

/// Writes 100 messages in several chunks.
fn write_file(path: &Path, options: WriteOptions) {
    let file = fs::File::create(path).unwrap();
    let mut writer = options.profile("ros2").create(file).unwrap();
    let topic = topic("/a", Qos::default());
    let schema = writer
        .add_schema(&topic.type_name, "ros2msg", topic.definition.as_bytes())
        .unwrap();
    let channel = writer
        .add_channel(schema, "/a", "cdr", &BTreeMap::new())
        .unwrap();
    for sequence in 0..100 {
        let header = MessageHeader {
            channel_id: channel,
            sequence,
            log_time: sequence.into(),
            publish_time: 1,
        };
        writer
            .write_to_known_channel(&header, &payload(sequence))
            .unwrap();
    }
    writer.finish().unwrap();
}

/// Only the first chunk has the definitions, and is damaged: the summary has them, too.
#[test]
fn definitions_are_found_in_a_summary_without_statistics() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run_0.mcap");
    let options = WriteOptions::new()
        .chunk_size(Some(1000))
        .emit_statistics(false);
    write_file(&file, options);
    let mut bytes = fs::read(&file).unwrap();
    let first = chunks(&bytes)[0].clone();
    bytes[first.end - 1] ^= 1;
    fs::write(&file, bytes).unwrap();

    let output = folder.path().join("new");
    let recovery = recover(&file, &output).unwrap();
    let kept = read_all(&output).unwrap();
    assert!(kept.len() > 50 && kept.len() < 100, "{}", kept.len());
    assert_eq!(recovery.missing, None);
    let last = &kept[kept.len() - 1];
    assert_eq!((last.sequence, &last.data), (99, &payload(99)));
}

#[test]
fn statistics_of_a_file_without_chunks_tell_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run_0.mcap");
    write_file(&file, WriteOptions::new().use_chunks(false));
    let mut bytes = fs::read(&file).unwrap();
    let middle = bytes.len() / 2;
    // Lengths of some records among them.
    bytes[middle..middle + 300].fill(0xff);
    fs::write(&file, bytes).unwrap();

    let recovery = recover(&file, &folder.path().join("new")).unwrap();
    let kept = recovery.messages["/a"];
    assert!(kept > 10 && kept < 90, "{kept}");
    assert_eq!(recovery.missing, Some(100 - kept));
}

/// Each publisher of a latched topic has its last message at the head of every file, as in the damaged bag.
#[test]
fn latched_messages_of_several_publishers_stand_in_all_files() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("run");
    let mut writer = BagWriter::create(&bag, BagOptions::default()).unwrap();
    let maps = writer.add_topic(&latched("/maps", 1)).unwrap();
    let often = writer.add_topic(&topic("/often", Qos::default())).unwrap();
    for publisher in 0..15 {
        let data = payload(publisher);
        // The first of the two is superseded.
        for (sequence, time) in [(0, 10), (1, 20)] {
            let time = time + u64::from(publisher);
            writer
                .write_of(publisher.into(), maps, time, time, sequence, &data)
                .unwrap();
        }
    }
    for file in 1..4_u32 {
        writer.split().unwrap();
        let time = u64::from(1000 * file);
        let data = payload(100 + file);
        writer.write(often, time, time, file, &data).unwrap();
    }
    let summary = writer.finish(BTreeMap::new()).unwrap();
    assert_eq!(summary.repeated, 3 * 15);

    let output = folder.path().join("new");
    let recovery = recover(&bag, &output).unwrap();
    assert_eq!(recovery.repeated, summary.repeated);
    for number in 0..4 {
        let name = format!("run_{number}.mcap");
        let [old, new] = [&bag, &output].map(|bag| read_all(&bag.join(&name)).unwrap());
        assert_eq!(old, new, "{name}");
    }
}

#[test]
fn type_hashes_that_only_the_metadata_tell_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("run");
    let mut writer = BagWriter::create(&bag, BagOptions::default()).unwrap();
    let mut without = topic("/a", Qos::default());
    let hash = std::mem::take(&mut without.type_hash);
    let id = writer.add_topic(&without).unwrap();
    writer.write(id, 1, 1, 0, &payload(0)).unwrap();
    writer.finish(BTreeMap::new()).unwrap();
    let metadata = bag.join("metadata.yaml");
    let text = fs::read_to_string(&metadata).unwrap();
    let told = text.replace(
        "type_description_hash: ''",
        &format!("type_description_hash: {hash}"),
    );
    assert_ne!(told, text);
    fs::write(&metadata, told).unwrap();

    let output = folder.path().join("new");
    recover(&bag, &output).unwrap();
    let file = BagReader::open(&output.join("run_0.mcap")).unwrap();
    assert_eq!(file.topics()[0].type_hash, hash);
}

/// A reader would pass over messages of two chunks in one place.
#[test]
fn an_index_that_lists_a_chunk_twice_is_damage() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run_0.mcap");
    let options = WriteOptions::new()
        .chunk_size(Some(1000))
        .compression(None)
        .emit_message_indexes(false)
        .calculate_summary_section_crc(false);
    write_file(&file, options);
    let mut bytes = fs::read(&file).unwrap();
    let places: Vec<_> = chunks(&bytes).iter().map(|place| place.start).collect();
    // The second chunk's index points to the first.
    let [first, second] = [places[0], places[1]].map(|place| (place as u64).to_le_bytes());
    let at = bytes
        .windows(8)
        .rposition(|window| window == second)
        .unwrap();
    bytes[at..at + 8].copy_from_slice(&first);
    fs::write(&file, bytes).unwrap();
    let error = BagReader::open(&file).err().map(|error| error.to_string());
    assert!(
        error
            .as_ref()
            .is_some_and(|error| error.contains("chunk index")),
        "{error:?}"
    );
}
