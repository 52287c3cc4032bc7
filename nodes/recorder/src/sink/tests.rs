use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::atomic::Ordering;

use lgvi_bag::{BagOptions, BagReader, Qos, ROS2MSG, Rest, Topic};

use super::*;
use crate::batch::Head;
use crate::outlet::Outlet;

const BUDGET: usize = 1 << 20;

fn topic(name: &str, type_name: &str) -> Topic {
    Topic {
        name: name.to_owned(),
        type_name: type_name.to_owned(),
        type_hash: String::new(),
        definition: String::new(),
        definition_encoding: ROS2MSG.to_owned(),
        qos: Qos::default(),
    }
}

fn start(queue: &Arc<Queue>, account: &Arc<Account>, bag: &Path) -> Sink {
    let writer = BagWriter::create(bag, BagOptions::default()).unwrap();
    Sink::start(writer, queue, account, || {}).unwrap()
}

/// Without compression, into files of one long message or two.
fn start_splitting(queue: &Arc<Queue>, account: &Arc<Account>, bag: &Path) -> Sink {
    let options = BagOptions {
        compression: lgvi_bag::Compression::None,
        max_bytes: std::num::NonZeroU64::new(1000),
        ..BagOptions::default()
    };
    let writer = BagWriter::create(bag, options).unwrap();
    Sink::start(writer, queue, account, || {}).unwrap()
}

fn head(track: usize, sequence: u64) -> Head {
    Head {
        track,
        publisher: 0,
        log_time: 1,
        publish_time: 1,
        sequence,
    }
}

fn custom(bag: &Path) -> BTreeMap<String, String> {
    BagReader::open(bag).unwrap().custom().clone()
}

/// What waits, what is in the hands of receivers and what they still receive when writing fails.
#[test]
fn all_that_was_received_and_is_not_in_the_bag_is_counted() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    let account = Arc::<Account>::default();
    let queue = Queue::new(BUDGET, Arc::clone(&account));
    let tracks = ["/a", "/b"].map(|name| {
        let (place, track) = account.add(name);
        track
            .topic
            .get_or_init(|| topic(name, "std_msgs/msg/Empty"));
        (place, track)
    });
    let receive = |outlet: &mut Outlet, index: usize, count: u64| {
        let (place, track) = &tracks[index];
        for sequence in 0..count {
            track.received.fetch_add(1, Ordering::Relaxed);
            outlet.put(head(*place, sequence), &[0; 8]);
        }
    };
    let mut outlets = [Outlet::new(&queue), Outlet::new(&queue)];
    let sink = start(&queue, &account, &bag);
    receive(&mut outlets[0], 0, 100);
    outlets[0].hand_over();
    // The next file cannot be made, which ends the bag.
    fs::write(bag.join("bag_1.mcap"), "").unwrap();
    let (answer, answered) = std::sync::mpsc::channel();
    while tracks[0].1.written.load(Ordering::Relaxed) < 100 {
        std::thread::yield_now();
    }
    queue.split(Box::new(move |split| answer.send(split).unwrap()));
    while !sink.failed() {
        std::thread::yield_now();
    }
    // Handed over, and not.
    receive(&mut outlets[0], 0, 30);
    outlets[0].hand_over();
    receive(&mut outlets[1], 1, 7);
    drop(outlets);
    let error = sink.finish().unwrap().unwrap_err();
    let failed = answered.recv().unwrap().unwrap_err();
    assert_eq!(failed, error.to_string());
    assert!(failed.ends_with("without the last 37 messages"), "{failed}");
    let WriteError::Failed { rest, .. } = error else {
        panic!("{error:?}");
    };
    let messages = BTreeMap::from([("/a".to_owned(), 100)]);
    assert_eq!(rest, Rest::Closed { messages, lost: 37 });
    let lost = BTreeMap::from([("/a".to_owned(), 30), ("/b".to_owned(), 7)]);
    assert_eq!(account.lost(), lost);
    let custom = custom(&bag);
    let said = [
        "unwritten",
        "unwritten:/a",
        "unwritten:/b",
        "lost",
        "lost:/a",
        "lost:/b",
    ];
    assert_eq!(
        said.map(|key| &*custom[key]),
        ["37", "30", "7", "37", "30", "7"]
    );
}

#[test]
fn a_message_that_the_bag_cannot_take_is_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    let account = Arc::<Account>::default();
    let queue = Queue::new(BUDGET, Arc::clone(&account));
    for type_name in ["std_msgs/msg/Empty", "std_msgs/msg/String"] {
        let (_, track) = account.add("/a");
        track.topic.get_or_init(|| topic("/a", type_name));
    }
    let mut outlet = Outlet::new(&queue);
    let sink = start(&queue, &account, &bag);
    for sequence in 0..9 {
        outlet.put(head(usize::from(sequence % 3 == 2), sequence), &[0; 8]);
    }
    drop(outlet);
    let summary = sink.finish().unwrap().unwrap();
    assert_eq!(summary.messages["/a"], 6);
    assert_eq!(account.lost()["/a"], 3);
    assert_eq!(custom(&bag)["lost:/a"], "3");
}

/// What is known of losses is in each file that is closed, and after a flush in one that is not.
#[test]
fn losses_survive_a_split_and_a_kill() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("bag");
    let account = Arc::<Account>::default();
    let queue = Queue::new(BUDGET, Arc::clone(&account));
    let (_, track) = account.add("/a");
    track
        .topic
        .get_or_init(|| topic("/a", "std_msgs/msg/Empty"));
    track.lost.store(7, Ordering::Relaxed);
    let mut outlet = Outlet::new(&queue);
    let sink = start_splitting(&queue, &account, &bag);
    for sequence in 0..3 {
        outlet.put(head(0, sequence), &[0; 3000]);
    }
    outlet.hand_over();
    let contains = |file: &str, text: &str| {
        let bytes = fs::read(bag.join(file)).unwrap_or_default();
        bytes
            .windows(text.len())
            .any(|part| part == text.as_bytes())
    };
    let start = Instant::now();
    while !contains("bag_1.mcap", "lost:/a") {
        assert!(
            start.elapsed() < Duration::from_secs(60),
            "nothing is flushed"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(contains("bag_0.mcap", "lost:/a: '7'"));
    drop(outlet);
    sink.finish().unwrap().unwrap();
}
