//! `lgvi ensemble`: runs that are killed, ended and shared come to the bytes of one that was not.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use lgvi_tests::{Process, Signal, World, edited, eventually, scene};
use serde_json::Value;

/// Samples of the test's ensembles, four parts.
const SAMPLES: &str = "3300";

/// A capture in so many steps that a run of one lane can be caught on the way.
const SHORTER: [(&str, &str); 2] = [
    ("steps = 1000", "steps = 2000"),
    ("samples = 10000", "samples = 3300"),
];

fn start(world: &World, scene: &Path, output: &Path, more: &[&str]) -> Process {
    let (scene, output) = (scene.to_str().unwrap(), output.to_str().unwrap());
    let arguments = ["ensemble", "run", scene, "--output", output];
    world.lgvi(arguments.iter().chain(more))
}

fn merge(world: &World, shards: &[&Path], output: &Path, more: &[&str]) -> Process {
    let shards = shards.iter().map(|shard| shard.to_str().unwrap());
    let arguments = ["ensemble", "merge", "--output", output.to_str().unwrap()];
    world.lgvi(
        arguments
            .into_iter()
            .chain(shards)
            .chain(more.iter().copied()),
    )
}

/// Names and bytes of all files in a directory.
fn contents(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(directory).unwrap().map(Result::unwrap);
    let read = |entry: fs::DirEntry| {
        let name = entry.file_name().into_string().unwrap();
        (name, fs::read(entry.path()).unwrap())
    };
    entries.map(read).collect()
}

/// Whether a directory has a whole part, and how many.
fn parts(directory: &Path) -> usize {
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    entries
        .filter(|entry| entry.file_name().to_str().unwrap().ends_with(".parquet"))
        .count()
}

#[test]
fn a_killed_run_and_merged_shards_are_the_run_that_was_not_cut() {
    let world = World::new();
    let scene = edited(&world, "dispersed_capture", &SHORTER);
    let whole = world.path("whole");
    start(&world, &scene, &whole, &["--threads", "2", "--lanes", "8"])
        .finish()
        .expect(0);
    let expected = contents(&whole);
    assert_eq!(
        expected.len(),
        4 + 3,
        "parts, summary and picture: {:?}",
        expected.keys()
    );

    let killed = world.path("killed");
    let running = start(&world, &scene, &killed, &["--threads", "1", "--lanes", "1"]);
    eventually("a first part", || (parts(&killed) > 0).then_some(()));
    running.signal(Signal::SIGKILL);
    running.finish();
    let left = parts(&killed);
    assert!(left < 4, "it was killed on the way");
    let resumed = start(&world, &scene, &killed, &["--threads", "2"])
        .finish()
        .expect(0);
    assert!(
        resumed.stdout.contains("samples were there already"),
        "{}",
        resumed.stdout
    );
    assert!(contents(&killed) == expected);

    let ended = world.path("ended");
    let running = start(&world, &scene, &ended, &["--threads", "1", "--lanes", "1"]);
    eventually("a first part", || (parts(&ended) > 0).then_some(()));
    let end = running.stop().expect(1);
    end.says(&[
        "ended after",
        &format!("of {SAMPLES} samples"),
        "the same command goes on",
    ]);
    start(&world, &scene, &ended, &[]).finish().expect(0);
    assert!(contents(&ended) == expected);

    let shards = ["0..1500", "1500..1600", "1600..3300"].map(|range| {
        let shard = world.path(&format!("shard{}", range.replace("..", "_")));
        start(&world, &scene, &shard, &["--range", range])
            .finish()
            .expect(0);
        shard
    });
    let merged = world.path("merged");
    let [a, b, c] = &shards;
    merge(&world, &[c, a, b], &merged, &[]).finish().expect(0);
    assert!(contents(&merged) == expected);

    let refused = merge(&world, &[a, c], &world.path("gap"), &[])
        .finish()
        .expect(2);
    refused.says(&["samples 1500..1600 are missing"]);
    let gaps = merge(
        &world,
        &[a, c],
        &world.path("gaps"),
        &["--allow-gaps", "--json"],
    );
    let report: Value = serde_json::from_str(&gaps.finish().expect(0).stdout).unwrap();
    assert_eq!(
        (&report["present"], &report["samples"]),
        (&3200.into(), &3300.into())
    );
    let twice = merge(&world, &[a, a], &world.path("twice"), &[])
        .finish()
        .expect(2);
    twice.says(&["overlap"]);
}

/// What the spread of the start and of the engines makes of the arrival is what it should be.
#[test]
fn a_dispersed_capture_misses_by_what_its_start_and_engines_are_off() {
    let world = World::new();
    let output = world.path("run");
    let flown = start(
        &world,
        &scene("dispersed_capture"),
        &output,
        &["--samples", "500", "--json"],
    );
    let report: Value = serde_json::from_str(&flown.finish().expect(0).stdout).unwrap();
    assert_eq!(report["complete"], 500);
    assert!(report["failures"].as_object().unwrap().is_empty());
    let of = |column: &str, what: &str| report["columns"][column][what].as_f64().unwrap();
    let deviation = of("spacecraft.deviation.position.x", "standard_deviation");
    assert!((deviation / 1e-3 - 1.0).abs() < 5.0 / (2.0_f64 * 499.0).sqrt());
    // A percent of thrust over a flight that thrusts all the way is seen in the arrival, and no more than that.
    let miss = of("miss.position", "mean");
    assert!((1e-3..0.3).contains(&miss), "{miss}");
    let picture = fs::read_to_string(output.join("summary.svg")).unwrap();
    assert!(picture.contains("miss.position"));
    let text = fs::read_to_string(output.join("summary.txt")).unwrap();
    assert!(
        text.contains("500 of 500 samples, 500 flew to the end"),
        "{text}"
    );
}

#[test]
fn what_cannot_be_flown_is_refused_by_name_and_value() {
    let world = World::new();
    let output = world.path("run");
    let plain = scene("two_dumbbells");
    let refused = start(&world, &plain, &output, &[]).finish().expect(2);
    refused.says(&["no `ensemble` table"]);
    let scene = edited(&world, "dispersed_capture", &SHORTER);
    for (arguments, parts) in [
        (["--samples", "0"], ["0 samples", "expected 1 to"]),
        (["--range", "3000..4000"], ["3000..4000", "0..3300"]),
        (["--range", "5..5"], ["--range", "not empty"]),
        (["--range", "a..b"], ["--range", "two whole numbers"]),
        (["--lanes", "3"], ["--lanes", "1, 8"]),
        (["--threads", "5000"], ["5000 threads", "1024"]),
    ] {
        let refused = start(&world, &scene, &output, &arguments)
            .finish()
            .expect(2);
        refused.says(&parts);
    }
    start(&world, &scene, &output, &["--range", "0..64"])
        .finish()
        .expect(0);
    let other = start(
        &world,
        &scene,
        &output,
        &["--range", "0..64", "--seed", "2"],
    );
    other.finish().expect(2).says(&["seed is 1, expected 2"]);
    let nothing = merge(
        &world,
        &[&world.path("nowhere")],
        &world.path("merged"),
        &[],
    );
    nothing
        .finish()
        .expect(2)
        .says(&["no parts of an ensemble"]);
}

/// Parts of so dear samples take minutes to be finished.
#[test]
fn a_second_signal_ends_at_once() {
    let world = World::new();
    let ensemble =
        "samples = 64\nseed = 1\n\n[[ensemble.bodies]]\nbody = \"dumbbell1\"\nmass = 0.01\n";
    let scene = edited(
        &world,
        "two_dumbbells",
        &[("steps = 15000", "steps = 50000000")],
    );
    let text = fs::read_to_string(&scene).unwrap();
    fs::write(&scene, format!("{text}\n[ensemble]\n{ensemble}")).unwrap();
    let output = world.path("run");
    let running = start(&world, &scene, &output, &["--threads", "1"]);
    eventually("a directory", || output.is_dir().then_some(()));
    running.signal(Signal::SIGINT);
    running.await_stderr("another signal ends at once");
    running.signal(Signal::SIGTERM);
    running.finish().expect(1);
    assert_eq!(parts(&output), 0);
}

#[test]
fn sensors_and_wheels_that_nobody_uses_are_told_of() {
    let world = World::new();
    let dispersed = "[ensemble]\nsamples = 2\nseed = 1\n\n[[ensemble.bodies]]\nbody = \"satellite\"\nattitude = 0.1\n\n[publish]";
    let changes = [
        ("duration = 120.0", "duration = 1.2"),
        ("steps = 6000", "steps = 60"),
        ("[publish]", dispersed),
    ];
    let scene = edited(&world, "wheel_slew", &changes);
    let flown = start(&world, &scene, &world.path("run"), &[])
        .finish()
        .expect(0);
    for remark in [
        "sensors were not read: nobody listens, and no sample depends on them",
        "reaction wheels coasted: there is no controller",
    ] {
        assert!(flown.stdout.contains(remark), "{}", flown.stdout);
    }
}
