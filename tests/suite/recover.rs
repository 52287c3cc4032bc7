//! `lgvi recover`: bags of flights that were killed, exit codes, and what it says.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use lgvi_bag::{BagOptions, BagReader, BagWriter};
use lgvi_tests::{Finished, Recording, Signal, World, reference_bag};
use serde_json::Value;

/// Length of what an MCAP file starts with, and kinds of its records.
const MAGIC: usize = 8;
const FOOTER: u8 = 0x02;
const CHUNK: u8 = 0x06;

/// A copy of a bag of the repository, of the same name.
fn copied(world: &World, name: &str) -> PathBuf {
    let bag = world.path(name);
    fs::create_dir(&bag).unwrap();
    for entry in fs::read_dir(reference_bag(name)).unwrap().flatten() {
        fs::copy(entry.path(), bag.join(entry.file_name())).unwrap();
    }
    bag
}

fn recover(world: &World, bag: &Path, arguments: &[&str]) -> Finished {
    let mut line = vec!["recover".as_ref(), bag.as_os_str()];
    line.extend(arguments.iter().map(AsRef::<std::ffi::OsStr>::as_ref));
    world.lgvi(line).finish()
}

/// The bag of a flight in a file, or in two; the first chunk ends with the scene.
fn chunked(world: &World, name: &str, files: u32) -> (PathBuf, Recording) {
    let original = Recording::read(&reference_bag("pendulum"));
    let bag = world.path(name);
    let mut writer = BagWriter::create(&bag, BagOptions::default()).unwrap();
    for (index, record) in original.records.iter().enumerate() {
        let mut topics = original.topics.iter();
        let topic = topics.find(|topic| topic.name == record.topic);
        let id = writer.add_topic(topic.unwrap()).unwrap();
        let (log_time, publish_time) = (record.log_time, record.publish_time);
        let written = writer.write(id, log_time, publish_time, record.sequence, &record.data);
        written.unwrap();
        if record.topic.ends_with("/scene") || index % 100 == 99 {
            writer.flush().unwrap();
        }
        if files == 2 && index == original.records.len() / 2 {
            writer.split().unwrap();
        }
    }
    writer.finish(BTreeMap::new()).unwrap();
    (bag, original)
}

/// Where the chunks of an MCAP file start.
fn chunks(bytes: &[u8]) -> Vec<usize> {
    let mut chunks = Vec::new();
    let mut start = MAGIC;
    while bytes[start] != FOOTER {
        let length = bytes[start + 1..start + 9].try_into().unwrap();
        if bytes[start] == CHUNK {
            chunks.push(start);
        }
        start += 9 + u64::from_le_bytes(length) as usize;
    }
    chunks
}

/// Damages the data of a file's first chunk.
fn damage(file: &Path) -> Vec<u8> {
    let mut bytes = fs::read(file).unwrap();
    let chunk = chunks(&bytes)[0];
    bytes[chunk + 80] ^= 1;
    fs::write(file, &bytes).unwrap();
    bytes
}

fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).unwrap().flatten();
    let mut names: Vec<_> = entries
        .map(|entry| entry.file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn the_program_recovers_the_bag_of_a_killed_flight() {
    let world = World::new();
    let scene = lgvi_tests::scene("free_body");
    let flight = world.start_flight(&scene, "flight", &["--real-time-factor", "10"]);
    let bag = world.path("flight");
    // Topics and their definitions alone are less.
    lgvi_tests::eventually("a bag of some size", || {
        let file = fs::metadata(bag.join("flight_0.mcap")).ok()?;
        (file.len() > 50_000).then_some(())
    });
    let recorder = world.find_process("node recorder").unwrap();
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(recorder), Signal::SIGKILL).unwrap();
    let finished = flight.finish().expect(1);
    let hint = format!("lgvi recover {}", bag.display());
    let summary: lgvi_tests::Summary = finished.json();
    let failure = summary.failure.unwrap();
    assert!(
        failure.message.starts_with("recorder: ") && failure.message.contains(&hint),
        "{failure:?}"
    );
    assert!(
        summary.bag.is_none() && summary.lost.is_none(),
        "{:?}",
        summary.lost
    );
    let refused = world
        .lgvi(["verify".as_ref(), bag.as_os_str()])
        .finish()
        .expect(2);
    assert!(
        refused.stderr.contains("flight_0.mcap"),
        "{}",
        refused.stderr
    );

    let recovered = world
        .lgvi(["recover".as_ref(), bag.as_os_str(), "--json".as_ref()])
        .finish();
    assert!(
        matches!(recovered.code, Some(0 | 1)),
        "{}",
        recovered.stderr
    );
    let recovery: BTreeMap<String, Value> = recovered.json();
    let output = world.path("flight_recovered");
    assert_eq!(recovery["bag"], output.to_str().unwrap());
    let states = recovery["messages"]["/lgvi_propagator/state"]
        .as_u64()
        .unwrap();
    assert!(states > 0);
    world.verify_agrees(&output, states);

    world
        .lgvi(["recover".as_ref(), bag.as_os_str(), "--in-place".as_ref()])
        .finish();
    world.verify_agrees(&bag, states);
}

#[test]
fn a_whole_bag_comes_out_whole() {
    let world = World::new();
    let bag = copied(&world, "pendulum");
    let said = recover(&world, &bag, &[]).expect(0).stdout;
    let output = world.path("pendulum_recovered");
    assert!(said.contains(output.to_str().unwrap()), "{said}");
    let recovery: BTreeMap<String, Value> = recover(&world, &bag, &["--in-place", "--json"])
        .expect(0)
        .json();
    assert_eq!(recovery["bag"], bag.to_str().unwrap());
    assert_eq!(recovery["files"][0]["left_out_places"], 0);
    assert_eq!(names(&bag), names(&reference_bag("pendulum")));
    for bag in [output, bag] {
        let recorded = Recording::read(&bag);
        let original = Recording::read(&reference_bag("pendulum"));
        assert_eq!(recorded.contents(), original.contents());
        world.verify(&bag, 0);
    }
}

#[test]
fn what_is_left_out_is_told() {
    let world = World::new();
    let (bag, _) = chunked(&world, "run", 1);
    let file = bag.join("run_0.mcap");
    let damaged = damage(&file);

    let output = world.path("elsewhere");
    let arguments = ["--output", output.to_str().unwrap()];
    let said = recover(&world, &bag, &arguments).expect(1).stdout;
    let expected = [file.to_str().unwrap(), "left out", "log times", "missing: "];
    for fragment in expected {
        assert!(said.contains(fragment), "{fragment:?} is not in {said}");
    }
    assert_eq!(fs::read(&file).unwrap(), damaged, "the bag has changed");
    let again = recover(&world, &bag, &arguments).expect(2);
    again.says(&[output.to_str().unwrap()]);

    let recovery: BTreeMap<String, Value> = recover(&world, &bag, &["--in-place", "--json"])
        .expect(1)
        .json();
    let place = &recovery["files"][0]["left_out"][0];
    assert!(place["bytes"].as_u64().unwrap() > 0, "{place}");
    assert!(recovery["missing"].as_u64().unwrap() > 0);
    let kept = bag.join("run_0.mcap.damaged");
    assert_eq!(fs::read(kept).unwrap(), damaged);
    // Now there is nothing to leave out any more.
    recover(&world, &output, &[]).expect(0);
}

/// The scene is latched: each file of a split bag has it.
#[test]
fn a_flight_whose_scene_is_damaged_is_verified_from_the_next_file() {
    let world = World::new();
    let (bag, original) = chunked(&world, "split", 2);
    let states = original.counts()["/lgvi_propagator/state"];
    world.verify_agrees(&bag, states);

    damage(&bag.join("split_0.mcap"));
    world
        .lgvi(["verify".as_ref(), bag.as_os_str()])
        .finish()
        .expect(2);
    recover(&world, &bag, &["--in-place"]).expect(1);
    let verdict = world.verify(&bag, 0);
    assert!(verdict.difference.is_none() && verdict.states > states / 2);
}

/// The bag says how many messages it had: that they are gone with the end of the file is no matter of course.
#[test]
fn a_bag_that_lacks_what_it_had_is_not_whole() {
    let world = World::new();
    let (bag, original) = chunked(&world, "run", 1);
    let file = bag.join("run_0.mcap");
    let bytes = fs::read(&file).unwrap();
    // Nothing looks cut off.
    let last = chunks(&bytes).pop().unwrap();
    fs::write(&file, &bytes[..last]).unwrap();
    let recovery: BTreeMap<String, Value> = recover(&world, &bag, &["--json"]).expect(1).json();
    let missing = recovery["missing"].as_u64().unwrap();
    let messages = recovery["messages"].as_object().unwrap().values();
    let recovered: u64 = messages.map(|count| count.as_u64().unwrap()).sum();
    assert!(recovered > 0 && missing > 0, "{recovered}, {missing}");
    assert_eq!(recovered + missing, original.records.len() as u64);
    assert_eq!(recovery["files"][0]["left_out_places"], 0);
    let reader = BagReader::open(&world.path("run_recovered")).unwrap();
    assert_eq!(reader.custom()["missing"], missing.to_string());

    let kept = names(&bag);
    for length in [0, 100] {
        fs::write(&file, &bytes[..length]).unwrap();
        for more in [&["--output", "none"][..], &["--in-place"]] {
            recover(&world, &bag, more).expect(2).says(&[
                bag.to_str().unwrap(),
                "nothing is readable",
                &format!("{} messages are missing", recovered + missing),
            ]);
        }
    }
    assert_eq!(names(&bag), kept);
    fs::remove_file(&file).unwrap();
    recover(&world, &bag, &[])
        .expect(2)
        .says(&["no .mcap file"]);
    fs::remove_file(bag.join("metadata.yaml")).unwrap();
    recover(&world, &bag, &[])
        .expect(2)
        .says(&["no .mcap file"]);
}

#[test]
fn what_is_no_bag_is_refused() {
    let world = World::new();
    let bag = copied(&world, "pendulum");
    let missing = world.path("missing");
    recover(&world, &missing, &[])
        .expect(2)
        .says(&[missing.to_str().unwrap()]);
    recover(&world, &bag.join("pendulum_0.mcap"), &["--in-place"])
        .expect(2)
        .says(&["pendulum_0.mcap", "--in-place"]);
    recover(&world, &bag, &["--in-place", "--output", "x"]).expect(2);
    recover(&world, &bag.join("metadata.yaml"), &[])
        .expect(2)
        .says(&["metadata.yaml"]);
}

#[test]
fn a_bag_that_is_being_recorded_is_refused() {
    let world = World::new();
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let recorder = world.node("recorder", &[&output]);
    recorder.await_ready();
    for arguments in [&[][..], &["--in-place"]] {
        recover(&world, &bag, arguments)
            .expect(2)
            .says(&["bag_0.mcap", "is being written"]);
    }
    assert_eq!(names(&bag), ["bag_0.mcap"]);
    recorder.signal(Signal::SIGKILL);
    recorder.finish();
    recover(&world, &bag, &[]).expect(0);
}
