//! What a check calls whole, another reader reads to its end, to the same messages: of the reference bags, changed at random.

use std::{fs, path::PathBuf};

use lgvi_bag::BagReader;
use mcap::{McapResult, MessageStream};

use crate::common::random;

/// Mutants of each bag.
const MUTANTS: u64 = 100;

/// Bytes that are changed at once, at most.
const LONGEST: u64 = 6000;

/// Numbers that nobody picked.
struct Chance(u64);

impl Chance {
    fn below(&mut self, limit: usize) -> usize {
        self.0 += 1;
        (random(self.0) % limit.max(1) as u64) as usize
    }
}

fn reference_bags() -> Vec<PathBuf> {
    let bags = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../../bags")).unwrap();
    let mut files: Vec<_> = bags
        .filter_map(|bag| fs::read_dir(bag.unwrap().path()).ok())
        .flatten()
        .map(|file| file.unwrap().path())
        .filter(|file| {
            file.extension()
                .is_some_and(|extension| extension == "mcap")
        })
        .collect();
    files.sort();
    files
}

fn mutant(bytes: &[u8], chance: &mut Chance) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let start = chance.below(bytes.len());
    let length = 1 + chance.below(LONGEST as usize) % (bytes.len() - start);
    let range = start..start + length;
    match chance.below(6) {
        0 => bytes[range].fill(0),
        1 => bytes[start] ^= 1 << chance.below(8),
        2 => bytes[range]
            .iter_mut()
            .for_each(|byte| *byte = chance.below(256) as u8),
        3 => bytes.truncate(start),
        4 => drop(bytes.drain(range)),
        _ => {
            let copy = bytes[range].to_vec();
            bytes.splice(start..start, copy);
        }
    }
    bytes
}

/// A message with its topic and definition.
#[derive(PartialEq)]
struct Read {
    topic: String,
    definition: Vec<u8>,
    times: [u64; 2],
    sequence: u32,
    data: Vec<u8>,
}

/// All messages as the `mcap` crate reads them from start to end.
fn stream(bytes: &[u8]) -> McapResult<Vec<Read>> {
    MessageStream::new(bytes)?
        .map(|message| {
            message.map(|message| {
                let schema = message.channel.schema.as_ref();
                Read {
                    topic: message.channel.topic.clone(),
                    definition: schema.map_or_else(Vec::new, |schema| schema.data.to_vec()),
                    times: [message.log_time, message.publish_time],
                    sequence: message.sequence,
                    data: message.data.into_owned(),
                }
            })
        })
        .collect()
}

#[test]
fn what_is_called_whole_reads_the_same_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.mcap");
    let mut chance = Chance(0);
    let (mut whole, mut found) = (0, 0);
    for file in reference_bags() {
        let bytes = fs::read(&file).unwrap();
        let messages = stream(&bytes).unwrap();
        let faults = BagReader::open(&file).unwrap().check();
        assert!(faults.is_empty(), "{}: {faults:?}", file.display());
        for index in 0..MUTANTS {
            let mutant = mutant(&bytes, &mut chance);
            fs::write(&path, &mutant).unwrap();
            match BagReader::open(&path) {
                Ok(bag) if bag.check().is_empty() => {
                    whole += 1;
                    let place = format!("mutant {index} of {}", file.display());
                    let read = stream(&mutant);
                    let read = read.unwrap_or_else(|error| panic!("{place}: {error}"));
                    assert!(read == messages, "{place}: other messages");
                }
                _ => found += 1,
            }
        }
    }
    // What is called whole differs where nothing is told: in a checksum that has become 0, which stands for none.
    assert!(whole < found / 50, "{whole} whole, {found} with faults");
}
