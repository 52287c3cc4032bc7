//! `lgvi convert`: what independent readers find in the tables is what they find in the bag.

use std::fs;
use std::path::Path;

use lgvi_bag::Topic;
use lgvi_tests::{Finished, Record, Recording, World, binary, root};
use serde_json::Value;

fn convert(world: &World, bag: &Path, output: &Path, more: &[&str]) -> Finished {
    let (bag, output) = (bag.to_str().unwrap(), output.to_str().unwrap());
    let arguments = ["convert", bag, "--output", output, "--json"];
    world.lgvi(arguments.iter().chain(more)).finish()
}

/// Compares the tables of both formats with the bag; returns the number of values.
fn agrees(world: &World, bag: &Path, name: &str) -> u64 {
    let compared = ["csv", "parquet"].map(|format| {
        let output = world.path(&format!("{name}_{format}"));
        let report = world.path(&format!("{name}_{format}.json"));
        let made = convert(world, bag, &output, &["--format", format]).expect(0);
        fs::write(&report, &made.stdout).unwrap();
        let arguments = [bag.to_str().unwrap(), report.to_str().unwrap()];
        let checked = world
            .python("check_tables.py", &arguments)
            .finish()
            .expect(0);
        checked.stdout.trim().parse::<u64>().unwrap()
    });
    assert_eq!(compared[0], compared[1]);
    compared[0]
}

#[test]
fn tables_of_the_reference_bags_agree_with_foreign_readers() {
    let world = World::new();
    let mut bags = 0;
    for entry in fs::read_dir(root().join("bags")).unwrap() {
        let bag = entry.unwrap().path();
        if bag.join("metadata.yaml").exists() {
            let name = bag.file_name().unwrap().to_str().unwrap().to_owned();
            assert!(agrees(&world, &bag, &name) > 1_000, "{name}");
            bags += 1;
        }
    }
    assert!(bags >= 2, "{bags}");
}

#[test]
fn tables_of_a_foreign_bag_of_odd_types_agree_with_foreign_readers() {
    let world = World::new();
    let bag = world.path("odd");
    let arguments = [bag.to_str().unwrap()];
    world.python("odd_bag.py", &arguments).finish().expect(0);
    assert!(agrees(&world, &bag, "odd_tables") > 1_000);
}

#[test]
fn a_topic_that_cannot_be_read_is_left_out_by_name() {
    let world = World::new();
    let mut bag = Recording::read(&root().join("bags/orbital_capture"));
    let state = "/lgvi_propagator/state";
    let topic = bag.topics.iter_mut().find(|topic| topic.name == state);
    topic.unwrap().definition = "module lgvi_msgs {".into();
    let path = world.path("bag");
    bag.write(&path);
    let made = convert(&world, &path, &world.path("tables"), &["--format", "csv"]).expect(1);
    let report: Value = serde_json::from_str(&made.stdout).unwrap();
    assert_eq!(report["left_out"][0]["topic"], state);
    assert_eq!(report["left_out"].as_array().unwrap().len(), 1);
    assert_eq!(
        report["files"].as_array().unwrap().len(),
        bag.topics.len() - 1
    );
}

#[test]
fn tables_are_never_written_over_anything() {
    let world = World::new();
    let bag = root().join("bags/orbital_capture");
    let precious = world.path("tables").join("precious");
    fs::create_dir(world.path("tables")).unwrap();
    fs::write(&precious, "data").unwrap();
    let refused = convert(&world, &bag, &world.path("tables"), &["--format", "csv"]).expect(2);
    refused.says(&[
        world.path("tables").to_str().unwrap(),
        "not an empty directory",
    ]);
    assert_eq!(fs::read_dir(world.path("tables")).unwrap().count(), 1);
    let topic = ["--format", "csv", "--topic", "/missing"];
    let refused = convert(&world, &bag, &world.path("new"), &topic).expect(2);
    refused.says(&["no topic /missing", "/lgvi_propagator/state"]);
    assert!(!world.path("new").exists());
}

#[test]
fn more_topics_than_files_may_be_open_have_a_table_each() {
    let world = World::new();
    let mut flight = Recording::read(&root().join("bags/orbital_capture"));
    let scene = "/lgvi_propagator/scene";
    let topic = flight.topics.iter().find(|topic| topic.name == scene);
    let topic = topic.unwrap().clone();
    let record = flight.on(scene).next().unwrap().clone();
    let names: Vec<_> = (0..450).map(|index| format!("/t{index:03}")).collect();
    let topics = names.iter().map(|name| Topic {
        name: name.clone(),
        ..topic.clone()
    });
    flight.topics = topics.collect();
    let records = names.iter().map(|name| Record {
        topic: name.clone(),
        ..record.clone()
    });
    flight.records = records.collect();
    let bag = world.path("bag");
    flight.write(&bag);
    for format in ["csv", "parquet"] {
        let mut command = world.command(Path::new("/bin/sh"));
        let limited = "ulimit -n 256 && exec \"$@\"";
        command
            .args(["-c", limited, "sh"])
            .arg(binary("lgvi"))
            .arg("convert")
            .arg(&bag)
            .args(["--json", "--format", format]);
        let made: Value = world.start("lgvi", command).finish().expect(0).json();
        let files = made["files"].as_array().unwrap();
        let topics: Vec<_> = files.iter().map(|file| &file["topic"]).collect();
        assert_eq!(topics, names.iter().collect::<Vec<_>>());
        assert!(files.iter().all(|file| file["rows"] == 1));
        let output = world.path(&format!("bag_{format}"));
        assert_eq!(fs::read_dir(&output).unwrap().count(), names.len());
    }
    let table = |name: &str| fs::read(world.path("bag_csv").join(name)).unwrap();
    assert!(table("t449.csv").len() > 1000);
    assert_eq!(table("t000.csv"), table("t449.csv"));
}

#[test]
fn tables_lie_beside_a_bag_that_is_named_by_dots() {
    let world = World::new();
    Recording::read(&root().join("bags/pendulum")).write(&world.path("bag"));
    fs::create_dir(world.path("bag/inner")).unwrap();
    for (from, bag) in [("bag", "."), ("bag/inner", "..")] {
        let mut command = world.command(&binary("lgvi"));
        command.current_dir(world.path(from));
        command.args(["convert", bag, "--format", "csv", "--json"]);
        let made: Value = world.start("lgvi", command).finish().expect(0).json();
        let output = world.path("bag_csv");
        assert_eq!(made["output"], output.to_str().unwrap());
        assert!(output.join("tf.csv").exists());
        fs::remove_dir_all(output).unwrap();
    }
}

#[test]
fn an_output_without_a_name_is_refused() {
    let world = World::new();
    let output = world.path("a/b/..");
    let bag = root().join("bags/pendulum");
    let refused = convert(&world, &bag, &output, &["--format", "csv"]).expect(2);
    let said: Value = refused.json();
    let output = output.to_str().unwrap();
    assert_eq!(
        said["failure"]["message"],
        format!("{output}: ends without the name of a directory to make")
    );
}
