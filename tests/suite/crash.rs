//! The recorder is killed at random moments: each of its bags can be recovered, and the last second at most is lost.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use lgvi_bag::{RecoverError, recover};
use lgvi_middleware::shm::Delivery;
use lgvi_tests::{Sender, Signal, World, note, state_numbers};

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

/// How the recorders write.
const WAYS: [&[&str]; 5] = [
    &["compression:=zstd"],
    &["compression:=none"],
    &["compression:=lz4"],
    &["compression:=zstd", "max_duration:=0.3"],
    &["compression:=none", "max_bytes:=100000"],
];

/// A recorder's end.
struct Kill {
    bag: PathBuf,
    ready: Option<Instant>,
    at: Instant,
}

impl Kill {
    /// For how long before the end states had been sent that are not found, of a recorder that was ready for them.
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

/// Sends states on all topics until told to end; gives when each had been sent.
fn send(world: &World, over: &AtomicBool) -> Vec<Instant> {
    let topics: Vec<_> = (0..TOPICS).map(topic).collect();
    let mut sender = Sender::new(world, &topics, DELIVERY);
    let start = Instant::now();
    while !over.load(Ordering::Relaxed) {
        sender.send();
        let due = start + PERIOD * sender.sent().len() as u32;
        thread::sleep(due.saturating_duration_since(Instant::now()));
    }
    sender.sent().to_vec()
}

/// Runs a recorder and kills it at its moment.
fn record_and_kill(world: &World, number: usize) -> Kill {
    let mut random = fastrand::Rng::with_seed(SEED + number as u64);
    let bag = world.path(&format!("bag_{number}"));
    let output = format!("output:={}", bag.display());
    let states = format!("states:=['{}']", topic(number % TOPICS));
    let parameters = [
        &[&*output, &*states, "topics:=[]"],
        WAYS[number % WAYS.len()],
    ]
    .concat();
    let mut command = world.command(&lgvi_tests::binary("lgvi_recorder"));
    command.args(["--supervised", "--ros-args", "-r"]);
    command.arg(format!("__node:=recorder_{number}"));
    for parameter in parameters {
        command.args(["-p", parameter]);
    }
    let recorder = world.start(&format!("recorder_{number}"), command);
    // One in ten is killed while it starts.
    let ready = (!number.is_multiple_of(10)).then(|| {
        recorder.await_ready();
        Instant::now()
    });
    thread::sleep(Duration::from_secs_f64(random.f64() * LONGEST));
    let at = Instant::now();
    recorder.signal(Signal::SIGKILL);
    let ended = recorder.finish();
    assert_eq!(ended.code, None, "{}{}", ended.stdout, ended.stderr);
    Kill { bag, ready, at }
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
        let found = state_numbers(&output);
        assert!(
            found.windows(2).all(|pair| pair[0] + 1 == pair[1]),
            "{bag}: a gap in {found:?}"
        );
        counts.insert(output.to_str().unwrap().to_owned(), found.len());
        if let Some(loss) = kill.loss(&found, &sent) {
            assert!(
                loss <= LOST,
                "{bag}: {loss:.3?} are lost, {found:?} are not"
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
