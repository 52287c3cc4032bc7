//! A writer whose disk is full or whose files are taken away says so, and leaves a bag.

use std::{
    collections::BTreeMap,
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::common::{McapFile, latched, metadata, payload, read_all, topic};
use lgvi_bag::{BagOptions, BagWriter, Compression, Qos, Rest, WriteError};

/// Where the child of [`child_writes_until_it_fails`] makes its bag, and how.
const CHILD: &str = "LGVI_BAG_TEST_CHILD";

/// Bytes of a message on the disk at least.
const MESSAGE: u64 = 140;

/// Messages that the child tries to write.
const MESSAGES: u32 = 10_000;

/// Writes until an error and prints it, with how many messages were taken; a test of its own only to be started by others,
/// with a limit on the size of files.
#[test]
fn child_writes_until_it_fails() {
    let Ok(directory) = env::var(CHILD) else {
        return;
    };
    let mut taken = 0;
    let error = write(Path::new(&directory), &mut taken).unwrap_err();
    println!("taken {taken}\nerror {error}\nrest {:?}", rest(&error));
}

fn write(directory: &Path, taken: &mut u32) -> Result<(), WriteError> {
    let options = BagOptions {
        compression: Compression::None,
        ..BagOptions::default()
    };
    let mut writer = BagWriter::create(directory, options)?;
    writer.set_custom(BTreeMap::from([("software".to_owned(), "lgvi".to_owned())]));
    let id = writer.add_topic(&topic("/a", Qos::default()))?;
    for sequence in 0..MESSAGES {
        writer.write(id, u64::from(sequence), 1, sequence, &payload(sequence))?;
        *taken += 1;
        if sequence % 100 == 99 {
            writer.flush()?;
        }
    }
    writer.finish(BTreeMap::new()).map(drop)
}

fn rest(error: &WriteError) -> Option<&Rest> {
    match error {
        WriteError::Failed { rest, .. } => Some(rest),
        _ => None,
    }
}

/// A bag with so many messages of `/a`, without others.
fn closed(messages: u64, lost: u64) -> Rest {
    let messages = BTreeMap::from([("/a".to_owned(), messages)]);
    Rest::Closed { messages, lost }
}

/// What the child prints whose files may have so many blocks of 512 bytes.
fn child(directory: &Path, blocks: u64) -> BTreeMap<String, String> {
    let output = Command::new("sh")
        // Files that get too long are an error of the write, not a signal.
        .args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\""])
        .arg(blocks.to_string())
        .arg(env::current_exe().unwrap())
        .args([
            "--exact",
            "failing::child_writes_until_it_fails",
            "--nocapture",
        ])
        .env(CHILD, directory)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{text}");
    let lines = text.lines().filter_map(|line| line.split_once(' '));
    lines
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .collect()
}

#[test]
fn full_disk() {
    // From no room for an empty file to room for many chunks, in steps that end anywhere in a chunk and its end.
    for blocks in [0, 1, 2, 8, 60, 61, 62, 63, 64, 90, 200, 333] {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("run");
        let said = child(&directory, blocks);
        let error = &said["error"];
        let file = directory.join("run_0.mcap");
        assert!(error.contains("File too large"), "{error}");
        if blocks < 8 {
            assert!(error.starts_with(file.to_str().unwrap()), "{error}");
            assert!(!directory.exists());
            continue;
        }
        let taken: u64 = said["taken"].parse().unwrap();
        let found = McapFile::read(&file);
        let read = found.messages.len() as u64;
        assert!(
            error.contains(&format!("without the last {} messages", taken - read)),
            "{error}, {taken} {read}"
        );
        assert!(fs::metadata(&file).unwrap().len() <= blocks * 512);
        // Chunks of 100 messages, of which no more are given up than the end needs.
        let most = blocks * 512 / MESSAGE;
        assert!(
            read + 300 >= most.min(u64::from(MESSAGES)),
            "{blocks}: {read} of {most}"
        );
        assert!(found.messages.iter().enumerate().all(|(k, message)| {
            message.sequence == k as u32 && message.data == payload(k as u32)
        }));
        assert_eq!(read_all(&directory).unwrap(), found.messages);
        let metadata = metadata(&directory);
        assert_eq!(found.rosbag2(), metadata);
        assert_eq!(metadata["message_count"], read);
        assert_eq!(metadata["custom_data"]["software"], "lgvi");
        let reason = metadata["custom_data"]["error"].as_str().unwrap();
        assert!(error.starts_with(reason), "{reason}");
        let unwritten = &metadata["custom_data"]["unwritten"];
        assert_eq!(unwritten, &(taken - read).to_string());
        if taken > read {
            assert_eq!(&metadata["custom_data"]["unwritten:/a"], unwritten);
        }
    }
}

/// A bag of two files, of which the second is being written.
fn split_bag(directory: &Path) -> BagWriter {
    let mut writer = BagWriter::create(directory, BagOptions::default()).unwrap();
    let id = writer.add_topic(&latched("/a", 1)).unwrap();
    for sequence in 0..10 {
        writer
            .write(id, 1, 1, sequence, &payload(sequence))
            .unwrap();
        if sequence == 5 {
            writer.split().unwrap();
        }
    }
    writer
}

#[test]
fn deleted_file() {
    type Call = fn(BagWriter) -> Result<(), WriteError>;
    let calls: [Call; 3] = [
        |mut writer| writer.flush(),
        |mut writer| writer.split(),
        |writer| writer.finish(BTreeMap::new()).map(drop),
    ];
    for call in calls {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("run");
        let writer = split_bag(&directory);
        let path = writer.path();
        fs::remove_file(&path).unwrap();
        let error = call(writer).unwrap_err();
        assert_eq!(rest(&error), Some(&closed(6, 4)));
        assert!(
            error.to_string().starts_with(path.to_str().unwrap()),
            "{error}"
        );
        // The first file is a bag by itself.
        assert_eq!(read_all(&directory).unwrap().len(), 6);
        assert!(!path.exists());
    }
}

/// Messages that were not handed over yet are missing too, by topic; the last word on the bag is theirs who had them.
#[test]
fn what_others_still_have_is_missing_too() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = split_bag(&directory);
    writer.set_custom(BTreeMap::from([("old".to_owned(), "1".to_owned())]));
    writer.on_failure(|unwritten| {
        assert_eq!(*unwritten, BTreeMap::from([("/a".to_owned(), 4)]));
        *unwritten.entry("/a".to_owned()).or_default() += 5;
        unwritten.insert("/b".to_owned(), 7);
        unwritten.insert("/c".to_owned(), 0);
        let lost = unwritten.values().sum::<u64>().to_string();
        BTreeMap::from([("lost".to_owned(), lost)])
    });
    fs::remove_file(writer.path()).unwrap();
    assert!(!writer.is_ended());
    let error = writer.flush().unwrap_err();
    assert!(writer.is_ended());
    assert_eq!(rest(&error), Some(&closed(6, 16)));
    assert!(
        error.to_string().ends_with("without the last 16 messages"),
        "{error}"
    );
    let mut custom: BTreeMap<String, String> =
        serde_yaml_ng::from_value(metadata(&directory)["custom_data"].clone()).unwrap();
    assert!(custom.remove("error").unwrap().contains("run_1.mcap"));
    let expected = [
        ("lost", "16"),
        ("unwritten", "16"),
        ("unwritten:/a", "9"),
        ("unwritten:/b", "7"),
    ];
    let expected = expected.map(|(key, value)| (key.to_owned(), value.to_owned()));
    assert_eq!(custom, BTreeMap::from(expected));
}

#[test]
fn deleted_directory() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = split_bag(&directory);
    fs::remove_dir_all(&directory).unwrap();
    let error = writer.flush().unwrap_err();
    assert_eq!(rest(&error), Some(&Rest::Gone));
    assert!(error.to_string().contains("No such file"), "{error}");
    assert!(!directory.exists());
    assert!(matches!(writer.flush(), Err(WriteError::Ended(_))));
    let id = writer.add_topic(&latched("/a", 1)).unwrap();
    assert!(matches!(
        writer.write(id, 1, 1, 1, &[]),
        Err(WriteError::Ended(_))
    ));
    assert!(matches!(
        writer.finish(BTreeMap::new()),
        Err(WriteError::Ended(_))
    ));
}

/// A file that has moved away is complete up to there; another in its place is left alone.
#[test]
fn replaced_file() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = split_bag(&directory);
    writer.flush().unwrap();
    let (path, moved) = (writer.path(), folder.path().join("moved.mcap"));
    fs::rename(&path, &moved).unwrap();
    fs::write(&path, "mine").unwrap();
    let error = writer.flush().unwrap_err();
    assert_eq!(rest(&error), Some(&closed(6, 4)));
    assert_eq!(fs::read(&path).unwrap(), b"mine");
    assert_eq!(McapFile::read(&moved).own().len(), 4);
}

/// The next file cannot be made: the bag ends with the one before.
#[test]
fn no_next_file() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let mut writer = split_bag(&directory);
    let next = directory.join("run_2.mcap");
    fs::write(&next, "").unwrap();
    let error = writer.split().unwrap_err();
    assert_eq!(rest(&error), Some(&closed(10, 0)));
    assert!(
        error.to_string().starts_with(next.to_str().unwrap()),
        "{error}"
    );
    let metadata = metadata(&directory);
    assert_eq!(
        metadata["relative_file_paths"].as_sequence().unwrap().len(),
        2
    );
    assert_eq!(metadata["message_count"], 11);
}

/// Nothing in the way of the file, but no `metadata.yaml`.
#[test]
fn no_metadata() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("run");
    let writer = split_bag(&directory);
    fs::create_dir(directory.join("metadata.yaml")).unwrap();
    let error = writer.finish(BTreeMap::new()).unwrap_err();
    assert_eq!(
        rest(&error),
        Some(&Rest::Unclosed {
            bag: directory.clone(),
            lost: 0
        })
    );
    assert!(error.to_string().contains("metadata.yaml: "), "{error}");
    assert!(!directory.join("metadata.yaml.tmp").exists());
}

#[test]
fn nowhere_to_write() {
    // Root may write everywhere but here.
    let error = BagWriter::create(&PathBuf::from("/proc/bag"), BagOptions::default()).map(drop);
    let error = error.unwrap_err().to_string();
    assert!(error.starts_with("/proc/bag: "), "{error}");
}
