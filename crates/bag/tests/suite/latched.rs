//! What is repeated of latched topics, by depth, publisher and length.

use std::{collections::BTreeMap, num::NonZeroU64};

use crate::common::{McapFile, latched};
use lgvi_bag::{BagOptions, BagWriter, Compression};

/// Publisher, sequence number and length of a message of a topic.
type Sent = (usize, u128, u32, usize);

/// The sequence numbers of the messages that the second file repeats, by topic of these depths.
fn repeated(depths: &[u32], max_bytes: Option<u64>, sent: &[Sent]) -> Vec<Vec<u32>> {
    let folder = tempfile::tempdir().unwrap();
    let options = BagOptions {
        compression: Compression::None,
        max_bytes: max_bytes.and_then(NonZeroU64::new),
        max_duration: None,
    };
    let mut writer = BagWriter::create(&folder.path().join("run"), options).unwrap();
    let name = |topic: usize| format!("/topic_{topic}");
    let topics = depths.iter().enumerate();
    let topics: Vec<_> = topics
        .map(|(index, depth)| writer.add_topic(&latched(&name(index), *depth)).unwrap())
        .collect();
    for &(topic, publisher, sequence, length) in sent {
        let data = vec![0; length];
        writer
            .write_of(publisher, topics[topic], 1, 1, sequence, &data)
            .unwrap();
    }
    writer.split().unwrap();
    writer.write(topics[0], 2, 2, u32::MAX, &[]).unwrap();
    let summary = writer.finish(BTreeMap::new()).unwrap();
    let file = McapFile::read(summary.files.last().unwrap());
    let counts = file.repeated();
    let of_topic = |topic: usize| {
        let messages = file.messages.iter();
        let messages = messages.filter(|message| message.topic == name(topic));
        let count = counts.get(&name(topic)).copied().unwrap_or(0);
        messages.map(|it| it.sequence).take(count).collect()
    };
    (0..depths.len()).map(of_topic).collect()
}

#[test]
fn depth_is_respected_and_at_least_one() {
    let sent = (0..5).flat_map(|sequence| (0..3).map(move |topic| (topic, 0, sequence, 10)));
    let sent: Vec<_> = sent.collect();
    let expected = [vec![4], vec![4], vec![2, 3, 4]];
    assert_eq!(repeated(&[0, 1, 3], None, &sent), expected);
}

#[test]
fn each_publisher_has_its_depth() {
    let mut sent = [(1, 0), (2, 1), (1, 2), (3, 3), (1, 4), (1, 5)]
        .map(|(publisher, sequence)| (0, publisher, sequence, 10))
        .to_vec();
    assert_eq!(repeated(&[2], None, &sent), [vec![1, 3, 4, 5]]);
    sent.extend((10..2000).map(|publisher| (0, publisher, 7, 10)));
    assert_eq!(repeated(&[2], None, &sent)[0].len(), 1000);
}

/// All topics together have half of what a file may have; here all messages find room in the first file.
#[test]
fn bytes_are_bounded() {
    let mut sent = vec![(0, 0, 0, 4_000)];
    sent.extend((1..4).map(|sequence| (1, 0, sequence, 3_000)));
    let repeated = |sent: &[Sent]| repeated(&[10, 10], Some(20_000), sent);
    assert_eq!(repeated(&sent), [vec![0], vec![2, 3]]);
    // An old message is not repeated in place of a new one that is too long.
    sent.push((1, 0, 4, 6_100));
    assert_eq!(repeated(&sent), [vec![0], vec![]]);
    sent.push((1, 0, 5, 6_000));
    assert_eq!(repeated(&sent), [vec![0], vec![5]]);
}
