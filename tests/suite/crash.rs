//! The recorder is killed at random moments: each of its bags can be recovered, and the last second at most is lost.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use lgvi_bag::{RecoverError, recover};
use lgvi_middleware::ros::Qos;
use lgvi_middleware::shm::Delivery;
use lgvi_msgs::std_msgs::String as Text;
use lgvi_node::Event;
use lgvi_tests::{Process, Recording, Sender, Signal, World, note, state_numbers};

/// Recorders that are killed, each at a moment of its own.
const KILLED: usize = 200;

/// Recorders that run at a time on each topic: shared memory has room for eight, some of which were killed just now.
const AT_A_TIME: usize = 4;

const TOPICS: usize = 4;

/// Where the random moments come from.
const SEED: u64 = 0x6c67_7669;

/// Between two states. A recorder that gets no time to run for two seconds has no room for more.
const PERIOD: Duration = Duration::from_millis(2);

/// How long such a recorder is waited for, or one that was killed.
const DELIVERY: Delivery = Delivery::Lossless {
    patience: Duration::from_millis(100),
};

/// What may be lost.
const LOST: Duration = Duration::from_secs(1);

/// How long a recorder runs at most once it is ready.
const LONGEST: f64 = 2.5;

/// What each recorder of four records: states alone, at their reception, texts from DDS alone, which wait for stamps that never
/// come, or both, at the stamps of the states.
const CONTENTS: [Contents; 4] = [
    Contents::States,
    Contents::Texts,
    Contents::States,
    Contents::Both,
];

/// The topic of texts.
const TEXTS: &str = "/crash/text";

/// States for each text.
const STATES_PER_TEXT: usize = 10;

/// Room for all texts that those who were killed have not acknowledged.
const TEXTS_KEPT: usize = 20_000;

/// How the recorders write.
const WAYS: [&[&str]; 5] = [
    &["compression:=zstd"],
    &["compression:=none"],
    &["compression:=lz4"],
    &["compression:=zstd", "max_duration:=0.3"],
    &["compression:=none", "max_bytes:=100000"],
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contents {
    States,
    Texts,
    Both,
}

impl Contents {
    fn of(number: usize) -> Self {
        CONTENTS[number % CONTENTS.len()]
    }

    fn parameters(self, states: usize) -> Vec<String> {
        let states = format!("states:=['{}']", topic(states));
        let texts = format!("topics:=['{TEXTS}=std_msgs/msg/String']");
        let at_stamps = "log_time:=stamp".to_owned();
        match self {
            Self::States => vec![states, "topics:=[]".into()],
            Self::Texts => vec!["states:=[]".into(), texts, at_stamps],
            Self::Both => vec![states, texts, at_stamps],
        }
    }
}

/// When what was sent.
struct Sent {
    states: Vec<Instant>,
    texts: Vec<Instant>,
}

/// A recorder's end.
struct Kill {
    bag: PathBuf,
    contents: Contents,
    /// Since when it records all that it is to.
    ready: Option<Instant>,
    at: Instant,
}

impl Kill {
    /// The most of what states and texts have lost.
    fn most_lost(&self, states: &[u64], texts: &[u64], sent: &Sent) -> Option<Duration> {
        let states = || self.loss(states, &sent.states);
        let texts = || self.loss(texts, &sent.texts);
        match self.contents {
            Contents::States => states(),
            Contents::Texts => texts(),
            Contents::Both => states().max(texts()),
        }
    }

    /// For how long before the end messages had been sent that are not found, of a recorder that was ready for them.
    fn loss(&self, found: &[u64], sent: &[Instant]) -> Option<Duration> {
        let ready = self.ready?;
        let ready = sent.partition_point(|sent| *sent <= ready) as u64;
        let first_lost = match found {
            [first, .., last] if *first <= ready => last + 1,
            _ => ready,
        };
        let sent = sent.get(first_lost as usize)?;
        Some(self.at.saturating_duration_since(*sent))
    }
}

fn topic(number: usize) -> String {
    format!("/crash/state_{number}")
}

/// Sends states and texts on all topics until told to end; gives when each had been sent.
fn send(world: &World, over: &AtomicBool) -> Sent {
    let topics: Vec<_> = (0..TOPICS).map(topic).collect();
    let mut sender = Sender::new(world, &topics, DELIVERY);
    let node = world.ros_node("texts");
    let publisher = node
        .publisher::<Text>(TEXTS, &Qos::reliable(TEXTS_KEPT))
        .unwrap();
    let mut texts = Vec::new();
    let start = Instant::now();
    while !over.load(Ordering::Relaxed) {
        sender.send();
        if sender.sent().len().is_multiple_of(STATES_PER_TEXT) {
            let data = texts.len().to_string();
            publisher.publish(&Text { data }).unwrap();
            texts.push(Instant::now());
        }
        let due = start + PERIOD * sender.sent().len() as u32;
        thread::sleep(due.saturating_duration_since(Instant::now()));
    }
    Sent {
        states: sender.sent().to_vec(),
        texts,
    }
}

/// The numbers of a bag's texts.
fn text_numbers(bag: &Path) -> Vec<u64> {
    let texts = Recording::read(bag).messages::<Text>(TEXTS);
    let mut numbers: Vec<u64> = texts
        .iter()
        .map(|text| text.data.parse().unwrap())
        .collect();
    // Their log times are those of states, or of their reception where there was none yet.
    numbers.sort_unstable();
    numbers
}

/// Panics where a number is missing between others.
#[track_caller]
fn follow_each_other(numbers: &[u64], bag: &dyn Display) {
    assert!(
        numbers.windows(2).all(|pair| pair[0] + 1 == pair[1]),
        "{bag}: a gap in {numbers:?}"
    );
}

/// Waits until a recorder records what it is to.
fn await_recording(recorder: &Process, contents: Contents) {
    recorder.await_ready();
    if contents != Contents::States {
        recorder.await_event("a text is written", |event| match event {
            Event::Recording { messages, .. } if messages.contains_key(TEXTS) => Some(()),
            _ => None,
        });
    }
}

/// Runs a recorder and kills it at its moment.
fn record_and_kill(world: &World, number: usize) -> Kill {
    let mut random = fastrand::Rng::with_seed(SEED + number as u64);
    let bag = world.path(&format!("bag_{number}"));
    let contents = Contents::of(number);
    let ways = WAYS[number % WAYS.len()].iter().map(ToString::to_string);
    let parameters = std::iter::once(format!("output:={}", bag.display()))
        .chain(contents.parameters(number % TOPICS))
        .chain(ways);
    let mut command = world.command(&lgvi_tests::binary("lgvi_recorder"));
    command.args(["--supervised", "--ros-args", "-r"]);
    command.arg(format!("__node:=recorder_{number}"));
    for parameter in parameters {
        command.args(["-p", &parameter]);
    }
    let recorder = world.start(&format!("recorder_{number}"), command);
    // One in ten is killed while it starts.
    let ready = (!number.is_multiple_of(10)).then(|| {
        await_recording(&recorder, contents);
        Instant::now()
    });
    thread::sleep(Duration::from_secs_f64(random.f64() * LONGEST));
    let at = Instant::now();
    recorder.signal(Signal::SIGKILL);
    let ended = recorder.finish();
    assert_eq!(ended.code, None, "{}{}", ended.stdout, ended.stderr);
    Kill {
        bag,
        contents,
        ready,
        at,
    }
}

#[test]
fn a_recorder_killed_at_any_moment_loses_the_last_second_at_most() {
    let world = World::new();
    let over = AtomicBool::new(false);
    let next = AtomicUsize::new(0);
    let kills = Mutex::new(Vec::new());
    let begun = Instant::now();
    let sent = thread::scope(|scope| {
        let publisher = scope.spawn(|| send(&world, &over));
        let recorders: Vec<_> = (0..TOPICS * AT_A_TIME)
            .map(|_| {
                scope.spawn(|| {
                    loop {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if number >= KILLED {
                            break;
                        }
                        let kill = record_and_kill(&world, number);
                        kills.lock().unwrap().push(kill);
                    }
                })
            })
            .collect();
        // The publisher ends in any case.
        let ended: Vec<_> = recorders.into_iter().map(|thread| thread.join()).collect();
        over.store(true, Ordering::Relaxed);
        let sent = publisher.join().unwrap();
        ended.into_iter().for_each(|ended| ended.unwrap());
        sent
    });
    let killed = begun.elapsed();

    let mut counts = BTreeMap::new();
    let mut losses = Vec::new();
    for kill in kills.into_inner().unwrap() {
        let bag = kill.bag.display();
        if !kill.bag.exists() {
            let why = "no bag, of a recorder that was ready";
            assert!(kill.ready.is_none(), "{bag}: {why}");
            continue;
        }
        let output = kill.bag.with_extension("recovered");
        match recover(&kill.bag, &output) {
            // Its first byte was not written yet.
            Err(RecoverError::Nothing { bytes: 0, .. }) => {
                assert!(
                    kill.ready.is_none(),
                    "{bag}: empty, of a recorder that was ready"
                );
                continue;
            }
            recovered => drop(recovered.unwrap()),
        }
        let (states, texts) = (state_numbers(&output), text_numbers(&output));
        follow_each_other(&states, &bag);
        follow_each_other(&texts, &bag);
        let name = output.to_str().unwrap().to_owned();
        counts.insert(name, states.len() + texts.len());
        if let Some(loss) = kill.most_lost(&states, &texts, &sent) {
            assert!(
                loss <= LOST,
                "{bag}: {loss:.3?} are lost, {states:?} and {texts:?} are not"
            );
            losses.push(loss);
        }
    }
    let bags: Vec<_> = counts.keys().map(String::as_str).collect();
    let read = world.python("read_bags.py", &bags).finish().expect(0);
    let read: BTreeMap<String, BTreeMap<String, (usize, u64)>> = read.json();
    for (bag, count) in &counts {
        // What is repeated at the head of further files counts there.
        let found: usize = read[bag].values().map(|(count, _)| count).sum();
        assert!(found >= *count, "{bag}: rosbags reads {found} of {count}");
    }
    let with_messages = counts.values().filter(|count| **count > 0).count();
    assert!(
        with_messages > KILLED / 2,
        "{with_messages} bags with messages"
    );
    losses.sort();
    let lost = losses.iter().filter(|loss| **loss > Duration::ZERO).count();
    note(&format!(
        "{KILLED} recorders killed within {killed:.1?}: {} bags, {with_messages} with messages; {lost} of {} that were \
         ready lost something, {:.3?} at most, half of them at most {:.3?}",
        counts.len(),
        losses.len(),
        losses[losses.len() - 1],
        losses[losses.len() / 2],
    ));
}
