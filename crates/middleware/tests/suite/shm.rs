//! Shared memory between nodes, of one process and of several, each test in a directory of its own.

use std::{
    env, fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicU64, Ordering},
    thread,
    time::{Duration, Instant},
};

use lgvi_middleware::{
    Shutdown,
    node::NodeError,
    shm::{
        ControlPublisher, Delivered, Delivery, ShmError, ShmNode, ShmOptions, StatePublisher,
        StateSubscriber,
    },
};
use lgvi_msgs::shm::{BodySample, ControlHeader, Name, StateHeader};
use nix::unistd::{Uid, geteuid, seteuid};
use tempfile::TempDir;

const TOPIC: &str = "/lgvi_propagator/state";
const PATIENCE: Duration = Duration::from_secs(20);
const BUFFER: usize = 8192;

/// A directory of its own. iceoryx2 keeps a counter of 16 bytes in /dev/shm for good: it goes with the directory.
struct World(TempDir);

impl World {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    /// What iceoryx2 has left in the directory and under its prefix in /dev/shm.
    fn remains(&self) -> Vec<PathBuf> {
        let mut found = in_shm(self.path());
        found.retain(|path| !is_counter(path));
        files(self.path(), &mut found);
        found
    }
}

impl Drop for World {
    fn drop(&mut self) {
        for counter in in_shm(self.path()).iter().filter(|path| is_counter(path)) {
            fs::remove_file(counter).unwrap();
        }
    }
}

fn is_counter(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension == "global_mgmt")
}

fn in_shm(root: &Path) -> Vec<PathBuf> {
    let prefix = options(root).prefix();
    let mut found = Vec::new();
    files(Path::new("/dev/shm"), &mut found);
    found.retain(|path| {
        path.file_name()
            .unwrap()
            .to_str()
            .unwrap()
            .starts_with(&prefix)
    });
    found
}

/// The part of a service that is made last.
fn dynamic(root: &Path) -> PathBuf {
    let mut made = in_shm(root).into_iter();
    let last = made.find(|path| path.extension().is_some_and(|end| end == "dynamic"));
    last.expect("a service")
}

fn files(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}

fn options(root: &Path) -> ShmOptions {
    ShmOptions {
        domain_id: 7,
        root: Some(root.into()),
    }
}

fn node(root: &Path, name: &str) -> ShmNode {
    ShmNode::new(name, &options(root)).unwrap()
}

fn header(sequence: u64) -> StateHeader {
    StateHeader {
        sequence,
        step: 10 * sequence,
        time: 0.5 * sequence as f64,
        stamp_nanoseconds: 1,
    }
}

fn body(sequence: u64, index: usize) -> BodySample {
    BodySample {
        name: Name::try_from("chaser").unwrap(),
        position: [sequence as f64, index as f64, 0.0],
        ..BodySample::default()
    }
}

fn send(publisher: &mut StatePublisher, sequence: u64) -> Delivered {
    let bodies = [0, 1].map(|index| body(sequence, index));
    publisher.send(header(sequence), &bodies).unwrap()
}

fn receive(subscriber: &mut StateSubscriber) -> Option<u64> {
    let sample = subscriber.receive().unwrap()?;
    let sequence = sample.header().sequence;
    assert_eq!(*sample.header(), header(sequence));
    assert_eq!(sample.elements(), [body(sequence, 0), body(sequence, 1)]);
    Some(sequence)
}

fn receive_within(subscriber: &mut StateSubscriber, patience: Duration) -> Option<u64> {
    let start = Instant::now();
    loop {
        match receive(subscriber) {
            None if start.elapsed() < patience => thread::sleep(Duration::from_micros(100)),
            received => return received,
        }
    }
}

#[test]
fn samples_arrive_complete_and_nothing_remains() {
    let root = World::new();
    {
        let (a, b) = (node(root.path(), "a"), node(root.path(), "b"));
        let mut publisher = a.state_publisher(TOPIC, 2, Delivery::DropNewest).unwrap();
        let mut subscriber = b.state_subscriber(TOPIC, BUFFER).unwrap();
        assert_eq!((publisher.subscribers(), subscriber.publishers()), (1, 1));
        for sequence in 0..100 {
            let delivered = send(&mut publisher, sequence);
            assert_eq!(
                delivered,
                Delivered {
                    receivers: 1,
                    refused: 0
                }
            );
            assert_eq!(receive(&mut subscriber), Some(sequence));
        }
        assert!(!root.remains().is_empty());
        drop(publisher);
        assert_eq!(subscriber.publishers(), 0);
    }
    assert_eq!(root.remains(), [""; 0].map(PathBuf::from));
}

#[test]
fn a_second_publisher_is_told_that_another_instance_runs() {
    let root = World::new();
    let (a, b) = (node(root.path(), "a"), node(root.path(), "b"));
    let first = a.state_publisher(TOPIC, 1, Delivery::DropNewest).unwrap();
    let error = b
        .state_publisher(TOPIC, 1, Delivery::DropNewest)
        .unwrap_err();
    assert!(matches!(error, ShmError::AlreadyPublished { limit: 1, .. }));
    assert!(error.to_string().contains("another instance is running"));
    drop(first);
    b.state_publisher(TOPIC, 1, Delivery::DropNewest).unwrap();
}

#[test]
fn domains_and_topics_are_apart() {
    let root = World::new();
    let here = node(root.path(), "here");
    let there = ShmNode::new(
        "there",
        &ShmOptions {
            domain_id: 8,
            root: Some(root.path().into()),
        },
    )
    .unwrap();
    let publisher = here
        .state_publisher(TOPIC, 1, Delivery::DropNewest)
        .unwrap();
    let _elsewhere = there.state_subscriber(TOPIC, 1).unwrap();
    let _other = here.state_subscriber("/other/state", 1).unwrap();
    assert_eq!(publisher.subscribers(), 0);
}

#[test]
fn a_slow_subscriber_loses_the_newest_and_both_sides_count_it() {
    let root = World::new();
    let (a, b) = (node(root.path(), "a"), node(root.path(), "b"));
    let mut publisher = a.state_publisher(TOPIC, 2, Delivery::DropNewest).unwrap();
    let mut slow = b.state_subscriber(TOPIC, 4).unwrap();
    let mut fast = b.state_subscriber(TOPIC, BUFFER).unwrap();
    for sequence in 0..10 {
        let delivered = send(&mut publisher, sequence);
        assert_eq!(delivered.refused, usize::from(sequence >= 4));
    }
    let received: Vec<_> = std::iter::from_fn(|| receive(&mut slow)).collect();
    assert_eq!(received, [0, 1, 2, 3]);
    send(&mut publisher, 10);
    assert_eq!(receive(&mut slow), Some(10));
    assert_eq!((slow.lost(), publisher.lost()), (6, 6));
    assert_eq!(std::iter::from_fn(|| receive(&mut fast)).count(), 11);
    assert_eq!(fast.lost(), 0);
}

#[test]
fn lossless_delivery_waits_for_a_slow_subscriber() {
    const COUNT: u64 = 100_000;
    let root = World::new();
    let (a, b) = (node(root.path(), "a"), node(root.path(), "b"));
    let delivery = Delivery::Lossless { patience: PATIENCE };
    let mut publisher = a.state_publisher(TOPIC, 2, delivery).unwrap();
    let mut subscriber = b.state_subscriber(TOPIC, 64).unwrap();
    thread::scope(|scope| {
        scope.spawn(move || {
            assert!(publisher.wait_for_subscribers(1, PATIENCE).unwrap());
            let start = Instant::now();
            for sequence in 0..COUNT {
                send(&mut publisher, sequence);
            }
            eprintln!("{COUNT} samples in {:?}", start.elapsed());
            assert_eq!(publisher.lost(), 0);
        });
        for sequence in 0..COUNT {
            assert_eq!(receive_within(&mut subscriber, PATIENCE), Some(sequence));
            if sequence % 10_000 == 0 {
                thread::sleep(Duration::from_millis(2));
            }
        }
    });
    assert_eq!(subscriber.lost(), 0);
}

#[test]
fn lossless_delivery_waits_for_memory() {
    /// So large that memory is for a quarter of a full buffer.
    const BODIES: usize = 1024;
    const COUNT: u64 = 3000;
    let root = World::new();
    let (a, b) = (node(root.path(), "a"), node(root.path(), "b"));
    let mut dropping = a
        .state_publisher("/dropping", BODIES, Delivery::DropNewest)
        .unwrap();
    let _idle = b.state_subscriber("/dropping", BUFFER).unwrap();
    let refused: u64 = (0..COUNT)
        .map(|sequence| send(&mut dropping, sequence).refused as u64)
        .sum();
    assert!(
        (1..1000).contains(&refused),
        "{refused} of {COUNT}, which do not fill the buffer"
    );
    let room = COUNT - refused;

    let delivery = Delivery::Lossless { patience: PATIENCE };
    let mut publisher = a.state_publisher(TOPIC, BODIES, delivery).unwrap();
    let mut subscriber = b.state_subscriber(TOPIC, BUFFER).unwrap();
    let sent = &AtomicU64::new(0);
    thread::scope(|scope| {
        scope.spawn(move || {
            for sequence in 0..COUNT {
                send(&mut publisher, sequence);
                sent.fetch_add(1, Ordering::Relaxed);
            }
            assert_eq!(publisher.lost(), 0);
        });
        let start = Instant::now();
        while sent.load(Ordering::Relaxed) < room {
            assert!(start.elapsed() < PATIENCE, "{sent:?} of {room}");
            thread::sleep(Duration::from_millis(1));
        }
        for sequence in 0..COUNT {
            assert_eq!(receive_within(&mut subscriber, PATIENCE), Some(sequence));
        }
    });
}

#[test]
fn a_subscriber_that_hangs_costs_one_wait() {
    let patience = Duration::from_millis(200);
    let root = World::new();
    let (a, b) = (node(root.path(), "a"), node(root.path(), "b"));
    let mut publisher = a
        .state_publisher(TOPIC, 2, Delivery::Lossless { patience })
        .unwrap();
    let mut hanging = b.state_subscriber(TOPIC, 4).unwrap();
    let start = Instant::now();
    for sequence in 0..1000 {
        send(&mut publisher, sequence);
        if sequence == 0 {
            assert_eq!(receive(&mut hanging), Some(0));
        }
    }
    let elapsed = start.elapsed();
    assert!(elapsed >= patience && elapsed < 3 * patience, "{elapsed:?}");
    assert_eq!(publisher.lost(), 1000 - 5);
}

#[test]
fn a_late_subscriber_gets_the_last_control_sequence() {
    let root = World::new();
    let (a, b) = (node(root.path(), "a"), node(root.path(), "b"));
    const LIMIT: usize = 100_000_000;
    let topic = "/lgvi_planner/control_sequence";
    let mut publisher = a.control_publisher(topic).unwrap();
    let mut other = a.control_publisher(topic).unwrap();
    let bytes = |length: usize| -> Vec<u8> { (0..length).map(|k| (k % 251) as u8).collect() };
    let header = |number| ControlHeader {
        publisher: [9; 16],
        number,
    };
    for (number, length) in [(1, 3), (2, LIMIT), (3, 0), (4, 1000)] {
        publisher.send(header(number), &bytes(length)).unwrap();
    }
    let mut subscriber = b.control_subscriber(topic).unwrap();
    let mut receive = |publisher: &mut ControlPublisher| {
        publisher.wait_for_subscribers(1, PATIENCE).unwrap();
        let sample = subscriber.receive().unwrap().unwrap();
        (*sample.header(), sample.elements().to_vec())
    };
    assert_eq!(receive(&mut publisher), (header(4), bytes(1000)));
    other.send(header(5), &bytes(LIMIT)).unwrap();
    let (received, long) = receive(&mut other);
    assert_eq!(received, header(5));
    assert!(long == bytes(LIMIT));
    let error = other.send(header(6), &bytes(LIMIT + 1)).unwrap_err();
    let expected = (LIMIT + 1, LIMIT);
    assert!(
        matches!(error, ShmError::TooLong { length, limit, .. } if (length, limit) == expected),
        "{error}"
    );
}

#[test]
fn more_bodies_than_made_for_are_an_error() {
    let root = World::new();
    let node = node(root.path(), "a");
    let mut publisher = node
        .state_publisher(TOPIC, 1, Delivery::DropNewest)
        .unwrap();
    let error = publisher
        .send(header(0), &[body(0, 0), body(0, 1)])
        .unwrap_err();
    assert!(
        matches!(
            error,
            ShmError::TooLong {
                length: 2,
                limit: 1,
                ..
            }
        ),
        "{error}"
    );
}

const ROLE: &str = "LGVI_TEST_ROLE";

/// Runs the test `child` of this binary in another process; it prints a line when it is ready.
fn spawn(role: &str, root: &Path) -> Child {
    use std::io::{BufRead, BufReader};
    let mut child = Command::new(env::current_exe().unwrap())
        .args(["--exact", "shm::child", "--ignored", "--nocapture"])
        .env(ROLE, role)
        .env("LGVI_SHM_ROOT", root)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().contains("ready")));
    child
}

#[test]
#[ignore = "run by other tests in a process of its own"]
fn child() {
    let root = env::var("LGVI_SHM_ROOT").unwrap();
    let node = node(Path::new(&root), "child");
    let (mut publisher, mut subscriber);
    let _of_nobody;
    match env::var(ROLE).unwrap().as_str() {
        "publish" => {
            publisher = node
                .state_publisher(TOPIC, 2, Delivery::DropNewest)
                .unwrap();
            send(&mut publisher, 41);
        }
        "subscribe" => {
            subscriber = node.state_subscriber(TOPIC, 4).unwrap();
            receive(&mut subscriber);
        }
        "stranger" => {
            seteuid(Uid::from_raw(NOBODY)).unwrap();
            let error = ShmNode::new("stranger", &options(Path::new(&root))).unwrap_err();
            let error = error.to_string();
            for part in [
                root.as_str(),
                "root (uid 0)",
                &NOBODY.to_string(),
                "LGVI_SHM_ROOT",
            ] {
                assert!(error.contains(part), "{part} is not in: {error}");
            }
            let own = ShmOptions::default();
            assert_eq!(
                own.root_path(),
                Path::new("/tmp").join(format!("lgvi_{NOBODY}"))
            );
            _of_nobody = ShmNode::new("stranger", &own).unwrap();
        }
        role => panic!("{role}"),
    }
    #[allow(clippy::print_stdout)]
    {
        println!("ready");
    }
    loop {
        thread::park();
    }
}

/// A user who owns nothing.
const NOBODY: u32 = 65_534;

#[test]
fn users_of_one_host_have_shared_memory_each_and_are_told_of_that_of_others() {
    if !geteuid().is_root() {
        // Only root can act as another user; another user's directory is at hand all the same.
        let error = ShmNode::new("stranger", &options(Path::new("/"))).unwrap_err();
        assert!(error.to_string().contains("root (uid 0)"), "{error}");
        return;
    }
    let root = World::new();
    let own = ShmNode::new("own", &ShmOptions::default()).unwrap();
    let mut child = spawn("stranger", root.path());
    child.kill().unwrap();
    child.wait().unwrap();
    drop(own);
}

#[test]
fn a_directory_that_cannot_be_made_is_named() {
    let root = World::new();
    let file = root.path().join("file");
    fs::write(&file, "").unwrap();
    let error = ShmNode::new("node", &options(&file.join("shm"))).unwrap_err();
    let error = error.to_string();
    assert!(error.contains(file.to_str().unwrap()), "{error}");
    fs::remove_file(file).unwrap();
}

#[test]
fn a_killed_publisher_is_replaced_and_nothing_remains() {
    let root = World::new();
    {
        let survivor = node(root.path(), "survivor");
        let mut subscriber = survivor.state_subscriber(TOPIC, BUFFER).unwrap();
        let mut child = spawn("publish", root.path());
        assert_eq!(receive(&mut subscriber), Some(41), "history");
        child.kill().unwrap();
        child.wait().unwrap();

        let successor = node(root.path(), "successor");
        let mut publisher = successor
            .state_publisher(TOPIC, 2, Delivery::DropNewest)
            .unwrap();
        assert_eq!(subscriber.publishers(), 1);
        send(&mut publisher, 0);
        assert_eq!(receive(&mut subscriber), Some(0));
        assert_eq!(subscriber.lost(), 0, "a new run is not a loss");
    }
    assert_eq!(root.remains(), [""; 0].map(PathBuf::from));
}

/// A node that is there already makes a service anew whose maker was killed and has left nothing but this.
fn is_made_anew(leave: impl FnOnce(&Path)) {
    let root = World::new();
    {
        let survivor = node(root.path(), "survivor");
        let mut child = spawn("publish", root.path());
        child.kill().unwrap();
        child.wait().unwrap();
        leave(root.path());
        let mut publisher = survivor
            .state_publisher(TOPIC, 2, Delivery::DropNewest)
            .unwrap();
        assert_eq!(send(&mut publisher, 0).receivers, 0);
    }
    assert_eq!(root.remains(), [""; 0].map(PathBuf::from));
}

/// All but the part that is made last.
#[test]
fn a_service_whose_maker_was_killed_is_made_anew() {
    is_made_anew(|root| fs::remove_file(dynamic(root)).unwrap());
}

/// A description that was begun only.
#[test]
fn a_service_whose_description_was_never_finished_is_made_anew() {
    is_made_anew(|root| {
        fs::remove_file(dynamic(root)).unwrap();
        let mut descriptions = Vec::new();
        files(&root.join("services"), &mut descriptions);
        let description = descriptions.pop().unwrap();
        assert!(descriptions.is_empty(), "{descriptions:?}");
        fs::remove_file(&description).unwrap();
        let begun = fs::File::create(&description).unwrap();
        let unfinished = fs::Permissions::from_mode(0o600);
        begun.set_permissions(unfinished).unwrap();
    });
}

/// On a busy host another process may need seconds until it has made the last part of a service.
#[test]
fn a_service_that_takes_long_to_make_is_waited_for() {
    let root = World::new();
    let node = node(root.path(), "late");
    let mut child = spawn("publish", root.path());
    let last = dynamic(root.path());
    let aside = last.with_extension("aside");
    fs::rename(&last, &aside).unwrap();
    let maker = thread::spawn(move || {
        thread::sleep(Duration::from_secs(7));
        fs::rename(aside, last).unwrap();
    });
    let subscriber = node.state_subscriber(TOPIC, BUFFER).unwrap();
    maker.join().unwrap();
    assert_eq!(subscriber.publishers(), 1);
    child.kill().unwrap();
    child.wait().unwrap();
    drop(subscriber);
    node.clean();
}

#[test]
fn who_waits_for_a_service_can_be_told_to_end() {
    let root = World::new();
    let shutdown = Shutdown::new();
    let node = node(root.path(), "late").leave_on(&shutdown);
    let mut child = spawn("publish", root.path());
    let last = dynamic(root.path());
    let aside = last.with_extension("aside");
    fs::rename(&last, &aside).unwrap();
    let requester = thread::spawn(move || {
        thread::sleep(Duration::from_secs(1));
        shutdown.request();
    });
    let error = node.state_subscriber(TOPIC, BUFFER).unwrap_err();
    requester.join().unwrap();
    assert!(
        matches!(error, ShmError::Interrupted { waited, .. } if waited < PATIENCE),
        "{error}"
    );
    assert_eq!(NodeError::from(error).code(), 0);
    fs::rename(aside, last).unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    node.clean();
}

#[test]
fn a_killed_subscriber_costs_one_wait_and_is_cleaned_up() {
    let patience = Duration::from_millis(200);
    let root = World::new();
    {
        let node = node(root.path(), "a");
        let mut publisher = node
            .state_publisher(TOPIC, 2, Delivery::Lossless { patience })
            .unwrap();
        let mut child = spawn("subscribe", root.path());
        assert_eq!(send(&mut publisher, 0).receivers, 1);
        child.kill().unwrap();
        child.wait().unwrap();
        let start = Instant::now();
        for sequence in 1..1000 {
            send(&mut publisher, sequence);
        }
        assert!(start.elapsed() < 3 * patience, "{:?}", start.elapsed());
        assert!(publisher.lost() > 0);
        node.clean();
        assert_eq!(publisher.subscribers(), 0);
        assert_eq!(
            send(&mut publisher, 1000),
            Delivered {
                receivers: 0,
                refused: 0
            }
        );
    }
    assert_eq!(root.remains(), [""; 0].map(PathBuf::from));
}
