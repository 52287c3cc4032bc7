//! How many messages `recover` says are lost.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use crate::common::{chunks, payload, read_all, topic};
use lgvi_bag::{BagOptions, BagReader, BagWriter, Qos, RecoverError, Recovery, recover};
use tempfile::TempDir;

/// Each chunk that is left out is named, with the log times of its messages, and nothing else.
#[test]
fn lost_chunks_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
    let mut writer = BagWriter::create(&bag, BagOptions::default()).unwrap();
    let often = writer.add_topic(&topic("/often", Qos::default())).unwrap();
    let other = writer.add_topic(&topic("/other", Qos::default())).unwrap();
    for chunk in 0..6 {
        for number in 0..[1, 2, 9, 1, 5, 5][chunk] {
            let time = 1000 * (chunk as u64 + 1) + number;
            for id in [often, other] {
                writer.write(id, time, time, 0, &payload(1)).unwrap();
            }
        }
        writer.flush().unwrap();
    }
    writer.finish(BTreeMap::new()).unwrap();
    let file = bag.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    let chunks = chunks(&bytes);
    let damaged = |positions: &[usize]| {
        let mut damaged = bytes.clone();
        for &position in positions {
            damaged[position] ^= 0x44;
        }
        fs::write(&file, damaged).unwrap();
        let recovery = recover(&bag, &output).unwrap();
        fs::remove_dir_all(&output).unwrap();
        let places = recovery.files[0].left_out.iter();
        places.map(|place| place.times).collect::<Vec<_>>()
    };
    let data = |chunk: usize| chunks[chunk].end - 20;
    assert_eq!(damaged(&[data(0)]), [Some((1000, 1000))]);
    let lost = [Some((2000, 2001)), Some((5000, 5004))];
    assert_eq!(damaged(&[data(1), data(4)]), lost);
    // Two that follow each other, and the operation code of an index of the one after them.
    let lost = [Some((2000, 2001)), Some((3000, 3008)), None];
    assert_eq!(damaged(&[data(1), data(2), chunks[3].end]), lost);
}

struct Bag(TempDir);

impl Bag {
    /// Three files, each with a message of a latched topic in a chunk, and two chunks of five other messages.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("run");
        let mut writer = BagWriter::create(&directory, BagOptions::default()).unwrap();
        let often = writer.add_topic(&topic("/often", Qos::default())).unwrap();
        let scene = writer
            .add_topic(&crate::common::latched("/scene", 1))
            .unwrap();
        for chunk in 0..9_u64 {
            let time = 1000 * chunk;
            if chunk % 3 == 0 {
                if chunk > 0 {
                    writer.split().unwrap();
                }
                let data = payload(1000 + chunk as u32);
                writer.write(scene, time, time, 0, &data).unwrap();
            } else {
                for number in 0..5 {
                    let time = time + number;
                    writer.write(often, time, time, 0, &payload(1)).unwrap();
                }
            }
            writer.flush().unwrap();
        }
        let custom =
            [("lost", "7"), ("software", "lgvi")].map(|(key, value)| (key.into(), value.into()));
        writer.finish(BTreeMap::from(custom)).unwrap();
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join("run").join(name)
    }

    fn output(&self) -> PathBuf {
        self.0.path().join("new")
    }

    fn truncate(&self, name: &str, length: impl FnOnce(&[u8]) -> usize) {
        let bytes = fs::read(self.path(name)).unwrap();
        fs::write(self.path(name), &bytes[..length(&bytes)]).unwrap();
    }

    fn recover(&self) -> Recovery {
        let recovery = recover(&self.0.path().join("run"), &self.output()).unwrap();
        let messages = read_all(&self.output()).unwrap().len() as u64;
        assert_eq!(recovery.messages.values().sum::<u64>(), messages);
        recovery
    }

    fn custom(&self) -> Vec<(String, String)> {
        let reader = BagReader::open(&self.output()).unwrap();
        reader.custom().clone().into_iter().collect()
    }
}

/// Of each file, and of the bag.
fn missing(recovery: &Recovery) -> (Vec<Option<u64>>, Option<u64>, bool) {
    let files = recovery.files.iter().map(|file| file.missing);
    (files.collect(), recovery.missing, recovery.is_whole())
}

/// The chunks are gone without a trace: only counts tell.
fn cut_behind_chunk(chunk: usize) -> impl Fn(&[u8]) -> usize {
    move |bytes| chunks(bytes)[chunk].end
}

#[test]
fn a_whole_bag_misses_nothing() {
    let bag = Bag::new();
    let expected = (vec![Some(0); 3], Some(0), true);
    assert_eq!(missing(&bag.recover()), expected);
    let custom = [("lost", "7"), ("recovered", "true"), ("software", "lgvi")];
    assert_eq!(
        bag.custom(),
        custom.map(|(key, value)| (key.to_owned(), value.to_owned()))
    );
}

#[test]
fn messages_missing_at_the_end_are_counted() {
    let bag = Bag::new();
    bag.truncate("run_2.mcap", cut_behind_chunk(1));
    let recovery = bag.recover();
    assert_eq!(recovery.files[2].left_out_places, 0);
    let expected = (vec![Some(0), Some(0), Some(5)], Some(5), false);
    assert_eq!(missing(&recovery), expected);
    let missing = ("missing".to_owned(), "5".to_owned());
    assert!(bag.custom().contains(&missing));
}

/// Without `metadata.yaml` the last file may have ended there; the one in the middle may not.
#[test]
fn a_file_without_its_end_is_no_loss_if_it_is_the_last() {
    let bag = Bag::new();
    fs::remove_file(bag.path("metadata.yaml")).unwrap();
    bag.truncate("run_2.mcap", cut_behind_chunk(1));
    let recovery = bag.recover();
    let expected = (vec![Some(0), Some(0), None], Some(0), true);
    assert_eq!(missing(&recovery), expected);
    fs::remove_dir_all(bag.output()).unwrap();
    for length in [true, false] {
        bag.truncate(
            "run_1.mcap",
            |bytes| if length { chunks(bytes)[1].end } else { 0 },
        );
        let recovery = bag.recover();
        let expected = (vec![Some(0), None, None], Some(0), false);
        assert_eq!(missing(&recovery), expected);
        fs::remove_dir_all(bag.output()).unwrap();
    }
}

#[test]
fn files_that_are_gone_are_counted() {
    for gone in [0, 1] {
        let bag = Bag::new();
        match gone {
            0 => bag.truncate("run_1.mcap", |_| 0),
            _ => fs::remove_file(bag.path("run_1.mcap")).unwrap(),
        }
        // Eleven messages, and one that is repeated from the file before.
        let expected = (vec![Some(0), Some(12), Some(0)], Some(12), false);
        assert_eq!(missing(&bag.recover()), expected);
    }
}

#[test]
fn last_files_that_are_gone_are_counted() {
    let bag = Bag::new();
    fs::remove_file(bag.path("run_2.mcap")).unwrap();
    let expected = (vec![Some(0), Some(0), Some(12)], Some(12), false);
    assert_eq!(missing(&bag.recover()), expected);
    let bag = Bag::new();
    fs::remove_file(bag.path("run_1.mcap")).unwrap();
    fs::remove_file(bag.path("run_2.mcap")).unwrap();
    let expected = (vec![Some(0), Some(12), Some(12)], Some(24), false);
    assert_eq!(missing(&bag.recover()), expected);
}

/// Without `metadata.yaml` the numbers in the names of the other files tell of it.
#[test]
fn files_between_others_are_missed() {
    let bag = Bag::new();
    fs::remove_file(bag.path("metadata.yaml")).unwrap();
    assert!(BagReader::open(&bag.path("")).unwrap().missing().is_empty());
    fs::remove_file(bag.path("run_1.mcap")).unwrap();
    let faults = |bag: &Bag| -> Vec<_> {
        let reader = BagReader::open_damaged(&bag.path("")).unwrap().0;
        reader.missing().iter().map(ToString::to_string).collect()
    };
    let found = faults(&bag);
    assert_eq!(found.len(), 1);
    assert!(found[0].contains("run_1.mcap: is not there"), "{found:?}");
    let recovery = bag.recover();
    let expected = (vec![Some(0), None, Some(0)], Some(0), false);
    assert_eq!(missing(&recovery), expected);
    assert_eq!(recovery.files[1].bytes, None);
    fs::remove_dir_all(bag.output()).unwrap();
    // Files of other names are not of that bag.
    let bag = Bag::new();
    for name in ["metadata.yaml", "run_0.mcap", "run_1.mcap"] {
        fs::remove_file(bag.path(name)).unwrap();
    }
    fs::rename(bag.path("run_2.mcap"), bag.path("filtered.mcap")).unwrap();
    assert!(faults(&bag).is_empty());
    assert!(bag.recover().is_whole());
}

/// The file's own statistics count as well, and so do the totals of a bag that is described without its files.
#[test]
fn any_count_that_is_left_will_do() {
    let bag = Bag::new();
    let bytes = fs::read(bag.path("run_2.mcap")).unwrap();
    let mut damaged = bytes.clone();
    let place = chunks(&bytes)[1].end - 20;
    damaged[place] ^= 1;
    fs::write(bag.path("run_2.mcap"), damaged).unwrap();
    fs::remove_file(bag.path("metadata.yaml")).unwrap();
    let recovery = bag.recover();
    assert_eq!(recovery.missing, Some(5));
    assert_eq!(recovery.files[2].missing, Some(5));

    let bag = Bag::new();
    bag.truncate("run_2.mcap", cut_behind_chunk(1));
    let yaml = fs::read_to_string(bag.path("metadata.yaml")).unwrap();
    let (before, after) = yaml.split_once("  files:\n").unwrap();
    let (_, after) = after.split_once("  custom_data").unwrap();
    fs::write(
        bag.path("metadata.yaml"),
        format!("{before}  custom_data{after}"),
    )
    .unwrap();
    let recovery = bag.recover();
    let expected = (vec![Some(0), Some(0), None], Some(5), false);
    assert_eq!(missing(&recovery), expected);
}

#[test]
fn what_is_missing_adds_up() {
    let bag = Bag::new();
    bag.truncate("run_2.mcap", cut_behind_chunk(1));
    bag.recover();
    fs::remove_dir_all(bag.path("")).unwrap();
    fs::rename(bag.output(), bag.path("")).unwrap();
    let recovery = bag.recover();
    assert_eq!((recovery.missing, recovery.is_whole()), (Some(0), true));
    fs::remove_dir_all(bag.output()).unwrap();
    fs::write(bag.path("run_1.mcap"), b"").unwrap();
    bag.recover();
    let missing = ("missing".to_owned(), "17".to_owned());
    assert!(bag.custom().contains(&missing), "{:?}", bag.custom());
}

/// A bag without messages becomes one, if it had none.
#[test]
fn bags_of_no_messages() {
    let folder = tempfile::tempdir().unwrap();
    let [bag, output] = ["run", "new"].map(|name| folder.path().join(name));
    let mut writer = BagWriter::create(&bag, BagOptions::default()).unwrap();
    let topic = topic("/often", Qos::default());
    writer.add_topic(&topic).unwrap();
    writer.finish(BTreeMap::new()).unwrap();
    let recover_it =
        || recover(&bag, &output).map(|recovery| (recovery.missing, recovery.is_whole()));
    let remove = |path: &Path| fs::remove_dir_all(path).unwrap();
    assert_eq!(recover_it().unwrap(), (Some(0), true));
    assert_eq!(BagReader::open(&output).unwrap().topics(), [topic]);
    remove(&output);
    // As the first moments of a recorder that is killed.
    let file = bag.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    let metadata = bag.join("metadata.yaml");
    let yaml = fs::read(&metadata).unwrap();
    fs::remove_file(&metadata).unwrap();
    let header = 8 + 9 + u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
    fs::write(&file, &bytes[..header]).unwrap();
    assert_eq!(recover_it().unwrap(), (None, true));
    remove(&output);
    // No byte is left of the file: only metadata.yaml can say that there were no messages.
    fs::write(&file, b"").unwrap();
    let error = recover_it().unwrap_err();
    assert!(
        matches!(error, RecoverError::Nothing { bytes: 0, .. }),
        "{error}"
    );
    fs::write(&metadata, &yaml).unwrap();
    assert_eq!(recover_it().unwrap(), (Some(0), true));
    remove(&output);
    let counted = String::from_utf8(yaml)
        .unwrap()
        .replace("message_count: 0", "message_count: 3");
    fs::write(&metadata, counted).unwrap();
    let error = recover_it().unwrap_err();
    assert!(
        error.to_string().contains("3 messages are missing"),
        "{error}"
    );
}
