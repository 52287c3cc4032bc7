//! Messages of latched topics stand in every file of a split bag: where one is lost, `recover` finds it in the next.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use crate::common::{McapFile, Read, latched, payload, read_all, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, Qos, Recovery, recover};
use tempfile::TempDir;

const SCENE: &str = "/scene";
const PLANS: &str = "/plans";

/// Messages of one file: two plans, each in a chunk with others. The scene is the first message of all.
fn write_bag(directory: &Path, files: u32) -> Vec<Read> {
    let mut writer = BagWriter::create(directory, BagOptions::default()).unwrap();
    let scene = writer.add_topic(&latched(SCENE, 1)).unwrap();
    let plans = writer.add_topic(&latched(PLANS, 2)).unwrap();
    let often = writer.add_topic(&topic("/often", Qos::default())).unwrap();
    writer.write(scene, 1000, 900, 0, &payload(0)).unwrap();
    writer.flush().unwrap();
    for plan in 0..2 * files {
        let time = 2000 + 100 * u64::from(plan);
        for number in 0..4 {
            let sequence = 4 * plan + number;
            let data = payload(100 + sequence);
            let time = time + u64::from(number);
            writer.write(often, time, time, sequence, &data).unwrap();
        }
        let data = payload(10 + plan);
        writer.write(plans, time + 50, time, plan, &data).unwrap();
        writer.flush().unwrap();
        if plan % 2 == 1 && plan + 1 < 2 * files {
            writer.split().unwrap();
        }
    }
    writer.finish(BTreeMap::new()).unwrap();
    read_all(directory).unwrap()
}

struct Bag {
    folder: TempDir,
    original: Vec<Read>,
}

impl Bag {
    fn new(files: u32) -> Self {
        let folder =
            tempfile::tempdir_in("/dev/shm").unwrap_or_else(|_| tempfile::tempdir().unwrap());
        let original = write_bag(&folder.path().join("run"), files);
        Self { folder, original }
    }

    fn output(&self) -> PathBuf {
        self.folder.path().join("new")
    }

    fn file(&self, number: usize) -> PathBuf {
        let name = format!("run/run_{number}.mcap");
        self.folder.path().join(name)
    }

    /// Hurts the data of a chunk.
    fn hurt(&self, file: usize, chunk: usize) {
        let path = self.file(file);
        let mut bytes = fs::read(&path).unwrap();
        let chunks = bytes.windows(4).enumerate();
        let mut chunks = chunks.filter(|(_, four)| four == b"zstd");
        let (at, _) = chunks.nth(chunk).unwrap();
        bytes[at + 40] ^= 1;
        fs::write(&path, &bytes).unwrap();
    }

    fn recover(&self) -> (Recovery, Vec<Read>) {
        let recovery = recover(&self.folder.path().join("run"), &self.output()).unwrap();
        let messages = read_all(&self.output()).unwrap();
        let counts = recovery.messages.values().sum::<u64>();
        assert_eq!(counts, messages.len() as u64);
        (recovery, messages)
    }

    fn repeated(&self, file: usize) -> BTreeMap<String, usize> {
        McapFile::read(&self.output().join(format!("run_{file}.mcap"))).repeated()
    }
}

fn sequences(messages: &[Read], topic: &str) -> Vec<u32> {
    let of_topic = messages.iter().filter(|message| message.topic == topic);
    of_topic.map(|message| message.sequence).collect()
}

#[test]
fn a_lost_scene_is_found_in_the_next_file() {
    let bag = Bag::new(3);
    bag.hurt(0, 0);
    let (recovery, messages) = bag.recover();
    assert_eq!(sequences(&messages, SCENE), [0]);
    assert_eq!(sequences(&messages, PLANS), [0, 1, 2, 3, 4, 5]);
    assert_eq!(messages.len(), bag.original.len());
    let scene = messages
        .iter()
        .find(|message| message.topic == SCENE)
        .unwrap();
    assert_eq!(scene.data, bag.original[0].data);
    assert_eq!(
        scene.log_time, 2200,
        "as the second file has it, at its beginning"
    );
    // From there on it is marked again.
    assert_eq!(bag.repeated(1), BTreeMap::from([(PLANS.to_owned(), 2)]));
    let all = BTreeMap::from([(SCENE.to_owned(), 1), (PLANS.to_owned(), 2)]);
    assert_eq!(bag.repeated(2), all);
    assert_eq!(recovery.repeated, 5);
    let reader = BagReader::open(&bag.output()).unwrap();
    assert_eq!(reader.message_counts()[SCENE], 1);
}

/// Marked messages are the first ones of a topic, so that their number says which they are.
#[test]
fn marked_messages_come_before_those_that_were_lost() {
    let bag = Bag::new(3);
    // With the first plan.
    bag.hurt(0, 1);
    let (_, messages) = bag.recover();
    let plans = sequences(&messages, PLANS);
    assert_eq!(plans, [1, 0, 2, 3, 4, 5]);
    let second = McapFile::read(&bag.output().join("run_1.mcap"));
    assert_eq!(second.repeated()[PLANS], 1);
    assert_eq!(sequences(&second.messages, PLANS), [1, 0, 2, 3]);
    assert_eq!(bag.repeated(2)[PLANS], 2);
}

#[test]
fn what_a_file_that_is_gone_had_latched_is_found_in_the_next() {
    for gone in ["empty", "removed"] {
        let bag = Bag::new(3);
        match gone {
            "empty" => fs::write(bag.file(0), b"").unwrap(),
            _ => fs::remove_file(bag.file(0)).unwrap(),
        }
        let (_, messages) = bag.recover();
        assert_eq!(sequences(&messages, SCENE), [0], "{gone}");
        assert_eq!(sequences(&messages, PLANS), [0, 1, 2, 3, 4, 5], "{gone}");
        assert!(bag.repeated(1).is_empty() && bag.repeated(2)[PLANS] == 2);
    }
}

/// Whatever byte changes: the latched messages of the files before the last are all there, in that file or the next, and
/// none twice, unless the record that marks them is hurt.
#[test]
fn latched_messages_survive_any_changed_byte() {
    let bag = Bag::new(3);
    let latched = |messages: &[Read]| -> BTreeSet<_> {
        let latched = messages.iter().filter(|message| message.topic != "/often");
        let found = latched.map(|message| (message.topic.clone(), message.data.clone()));
        found.collect()
    };
    let expected = latched(&bag.original[..bag.original.len() - 10]);
    assert_eq!(expected.len(), 1 + 4);
    let (mut found_again, mut twice) = (0, 0);
    for file in 0..3 {
        let path = bag.file(file);
        let bytes = fs::read(&path).unwrap();
        let record = bytes.windows(13).position(|it| it == b"lgvi_repeated");
        for position in (file..bytes.len()).step_by(29) {
            let mut damaged = bytes.clone();
            damaged[position] ^= 0x11;
            fs::write(&path, &damaged).unwrap();
            let (_, messages) = bag.recover();
            let case = format!("file {file}, byte {position}");
            assert!(latched(&messages).is_superset(&expected), "{case}");
            let sequences: Vec<_> = sequences(&messages, PLANS);
            found_again += usize::from(!sequences.is_sorted());
            let distinct: BTreeSet<_> = sequences.iter().collect();
            if distinct.len() < sequences.len() {
                let record = record.unwrap();
                assert!((record - 13..record + 80).contains(&position), "{case}");
                twice += 1;
            }
            fs::remove_dir_all(bag.output()).unwrap();
        }
        fs::write(&path, &bytes).unwrap();
    }
    assert!(found_again > 3, "{found_again}");
    assert!(twice < 6, "{twice}");
}
