//! Disks that are full, read-only or taken away while a flight is recorded.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use lgvi_middleware::shm::Delivery;
use lgvi_tests::{
    Disk, PATIENCE, Process, Recording, Sender, Signal, Summary, World, edited, eventually, root,
    state_numbers, with_disks,
};

const STATE: &str = "/lgvi_propagator/state";

/// How soon the flight must end when its bag cannot be written; some more on a loaded machine.
const SOON: Duration = Duration::from_secs(20);

/// A flight that lasts as long as its bag can be written, and waits for its recorder.
fn endless(world: &World) -> PathBuf {
    let changes = [
        ("duration = 100.0", "duration = 1e6"),
        ("steps = 10000", "steps = 100000000"),
    ];
    edited(world, "free_body", &changes)
}

fn fly(world: &World, bag: &Path) -> Process {
    let scene = endless(world);
    let mut command = world.command(&lgvi_tests::binary("lgvi"));
    command
        .arg("run")
        .arg(scene)
        .arg("--output")
        .arg(bag)
        .args(["--no-plot", "--json"]);
    world.start("lgvi", command)
}

/// Waits until a bag under way has some chunks.
#[track_caller]
fn await_chunks(bag: &Path) {
    let name = bag.file_name().unwrap().to_str().unwrap();
    let file = bag.join(format!("{name}_0.mcap"));
    eventually("chunks in the bag", || {
        let length = fs::metadata(&file).ok()?.len();
        (length > 50_000).then_some(())
    });
}

/// The flight ends soon, and says of its recorder what is expected.
#[track_caller]
fn fails(flight: Process, code: i32, fragments: &[&str]) -> Summary {
    let start = Instant::now();
    let finished = flight.finish().expect(code);
    assert!(start.elapsed() < SOON, "{:?}", start.elapsed());
    let summary: Summary = finished.json();
    let failure = summary.failure.as_ref().unwrap();
    assert!(failure.message.starts_with("recorder: "), "{failure:?}");
    for fragment in fragments {
        assert!(
            failure.message.contains(fragment),
            "{fragment:?} is not in {failure:?}"
        );
    }
    assert_eq!(summary.lost.is_none(), summary.bag.is_none(), "{summary:?}");
    summary
}

/// A flight whose bag was closed after an error tells what is in it and what is not, and so does the bag.
#[track_caller]
fn is_accounted_for(summary: &Summary, bag: &Path) {
    assert_eq!(summary.bag.as_deref(), Some(bag));
    let recording = Recording::read(bag);
    let there = recording.counts();
    let count = |topic: &String| there.get(&**topic).copied().unwrap_or(0);
    for (topic, recorded) in &summary.recorded {
        assert_eq!(*recorded, count(topic), "{topic}");
    }
    let published = summary.published.iter();
    let lost: u64 = published
        .map(|(topic, published)| published - count(topic))
        .sum();
    assert!(lost > 0 && summary.lost == Some(lost), "{lost} {summary:?}");
    let reader = lgvi_bag::BagReader::open(bag).unwrap();
    let said = |key: &str| reader.custom()[key].parse::<u64>().unwrap();
    assert!(said("unwritten") > 0 && said("unwritten") <= said("lost"));
    assert!(said("lost") <= lost, "{} of {lost}", said("lost"));
    // States come in order: those that the recorder has received follow those in the bag.
    let states = format!("unwritten:{STATE}");
    assert!(said(&states) + count(&STATE.to_owned()) <= summary.published[STATE]);
    let message = &summary.failure.as_ref().unwrap().message;
    let told = format!("closed without the last {} messages", said("unwritten"));
    assert!(message.contains(&told), "{told:?} is not in {message}");
}

/// All states from the first on, repeated bit for bit; foreign readers read them too.
#[track_caller]
fn is_readable(world: &World, bag: &Path) -> u64 {
    let states = Recording::read(bag).on(STATE).count() as u64;
    assert!(states > 0, "no states");
    world.verify_agrees(bag, states);
    world
        .python("read_bags.py", &[bag.to_str().unwrap()])
        .finish()
        .expect(0);
    states
}

#[test]
fn a_disk_that_fills_up() {
    with_disks("crash_disk::a_disk_that_fills_up", || {
        let world = World::new();
        let disk = Disk::mount(&world, "disk", 2 << 20);
        let bag = disk.path("flight");
        let file = bag.join("flight_0.mcap");
        let flight = fly(&world, &bag);
        let summary = fails(
            flight,
            1,
            &[file.to_str().unwrap(), "No space left on device", "closed"],
        );
        is_accounted_for(&summary, &bag);
        let states = is_readable(&world, &bag);
        let bytes = fs::metadata(&file).unwrap().len();
        assert!(
            bytes > 1 << 20,
            "{bytes} bytes of the disk were used, for {states} states"
        );
    });
}

#[test]
fn a_disk_that_is_full_from_the_start() {
    with_disks("crash_disk::a_disk_that_is_full_from_the_start", || {
        let world = World::new();
        let disk = Disk::mount(&world, "disk", 64 << 10);
        let filled = fs::write(disk.path("ballast"), vec![1; 1 << 20]).unwrap_err();
        assert_eq!(filled.kind(), std::io::ErrorKind::StorageFull);
        let bag = disk.path("flight");
        let flight = fly(&world, &bag);
        let finished = flight.finish();
        assert!(matches!(finished.code, Some(1 | 2)), "{:?}", finished.code);
        let summary: Summary = finished.json();
        let message = summary.failure.unwrap().message;
        assert!(
            message.contains(bag.to_str().unwrap()) && message.contains("No space left on device"),
            "{message}"
        );
    });
}

#[test]
fn a_disk_that_is_read_only() {
    with_disks("crash_disk::a_disk_that_is_read_only", || {
        let world = World::new();
        let disk = Disk::mount(&world, "disk", 1 << 20);
        disk.make_read_only();
        let bag = disk.path("flight");
        let flight = fly(&world, &bag);
        fails(flight, 2, &[bag.to_str().unwrap(), "Read-only file system"]);
    });
}

#[test]
fn a_description_that_cannot_be_written() {
    let world = World::new();
    let bag = world.path("flight");
    let flight = fly(&world, &bag);
    await_chunks(&bag);
    let metadata = bag.join("metadata.yaml");
    fs::create_dir(&metadata).unwrap();
    flight.signal(Signal::SIGINT);
    let finished = flight.finish();
    assert!(
        finished.code.is_some_and(|code| code != 0),
        "{:?}",
        finished.code
    );
    let said = format!("{}{}", finished.stdout, finished.stderr);
    assert!(said.contains(metadata.to_str().unwrap()), "{said}");
    fs::remove_dir(&metadata).unwrap();
    let output = world.path("recovered");
    assert!(lgvi_bag::recover(&bag, &output).unwrap().is_whole());
    is_readable(&world, &output);
}

#[test]
fn a_bag_that_is_deleted_in_flight() {
    let world = World::new();
    let bag = world.path("flight");
    let flight = fly(&world, &bag);
    await_chunks(&bag);
    fs::remove_dir_all(&bag).unwrap();
    fails(flight, 1, &[bag.to_str().unwrap(), "deleted"]);
    assert!(!bag.exists());
}

#[test]
fn a_file_that_is_deleted_in_flight() {
    let world = World::new();
    let bag = world.path("flight");
    let flight = fly(&world, &bag);
    await_chunks(&bag);
    let file = bag.join("flight_0.mcap");
    fs::remove_file(&file).unwrap();
    fails(flight, 1, &[file.to_str().unwrap(), "deleted"]);
}

/// A program that may make no files of more than so many bytes, as after `ulimit -f`.
fn limited(world: &World, bytes: u64, program: &str, arguments: &[&str]) -> Process {
    let mut command = world.command(Path::new("sh"));
    let blocks = (bytes / 512).to_string();
    command.args(["-c", "ulimit -f $0; exec \"$@\"", &blocks]);
    command.arg(lgvi_tests::binary(program)).args(arguments);
    world.start(program, command)
}

#[test]
fn a_limit_on_the_size_of_files() {
    const LIMIT: u64 = 4 << 20;
    const TOPIC: &str = "/limited/state";
    let world = World::new();
    let patience = Duration::from_secs(1);
    let delivery = Delivery::Lossless { patience };
    let mut sender = Sender::new(&world, &[TOPIC.to_owned()], delivery);
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let states = format!("states:=['{TOPIC}']");
    let mut arguments = vec!["--supervised", "--ros-args"];
    for parameter in [&*output, &*states, "topics:=[]", "compression:=none"] {
        arguments.extend(["-p", parameter]);
    }
    let mut recorder = limited(&world, LIMIT, "lgvi_recorder", &arguments);
    recorder.await_ready();
    let start = Instant::now();
    while recorder.runs() {
        assert!(start.elapsed() < PATIENCE, "no limit is met");
        sender.send();
    }
    let finished = recorder.finish().expect(1);
    let file = bag.join("bag_0.mcap");
    finished.says(&[
        file.to_str().unwrap(),
        "File too large",
        "the bag is closed",
    ]);
    let length = fs::metadata(&file).unwrap().len();
    assert!((LIMIT / 2..=LIMIT).contains(&length), "{length}");
    let numbers = state_numbers(&bag);
    assert!(numbers.windows(2).all(|pair| pair[0] + 1 == pair[1]));
    let reader = lgvi_bag::BagReader::open(&bag).unwrap();
    let unwritten: usize = reader.custom()["unwritten"].parse().unwrap();
    assert!(unwritten > 0 && numbers.len() + unwritten <= sender.sent().len());
}

#[test]
fn tables_of_files_that_get_too_long() {
    let world = World::new();
    let bag = root().join("bags/inclination_change");
    let tables = world.path("tables");
    let arguments = [
        "convert",
        bag.to_str().unwrap(),
        "--format",
        "csv",
        "--output",
    ];
    let arguments = [&arguments[..], &[tables.to_str().unwrap()]].concat();
    let finished = limited(&world, 64 << 10, "lgvi", &arguments).finish();
    finished.expect(2).says(&["File too large"]);
}
