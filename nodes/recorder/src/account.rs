//! What is known of a recording while it lasts: messages received, written and lost by topic, and waits.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

use lgvi_bag::Topic;
use lgvi_middleware::ros::{Level, Status};
use lgvi_middleware::sync::lock;
use tracing::warn;

/// Name and version of the recorder, as they stand in the bag.
const SOFTWARE: &str = concat!("lgvi_recorder ", env!("CARGO_PKG_VERSION"));

/// How often it is said at most that receiving waits, and that a topic has lost messages.
const COMPLAINT: Duration = Duration::from_secs(5);

/// A topic that is recorded.
#[derive(Debug)]
pub(crate) struct Track {
    pub(crate) name: String,
    /// How it stands in the bag; known before its first message is handed over.
    pub(crate) topic: OnceLock<Topic>,
    /// Messages that are to be in the bag.
    pub(crate) received: AtomicU64,
    /// Those of them that the bag's writer has taken.
    pub(crate) written: AtomicU64,
    /// Those that it cannot take.
    pub(crate) unusable: AtomicU64,
    /// Messages that have not been received.
    pub(crate) lost: AtomicU64,
    /// Messages that came in a pause.
    pub(crate) left_out: AtomicU64,
    /// How many of them have been complained of, and when that was.
    complained: Mutex<Option<(u64, Instant)>>,
    /// Whether shared memory has a publisher, or had messages a moment ago.
    pub(crate) in_memory: AtomicBool,
}

impl Track {
    /// Says that messages have been lost, at the first loss and then from time to time while it goes on.
    fn complain(&self) {
        let lost = self.lost.load(Ordering::Relaxed);
        if lost == 0 {
            return;
        }
        let mut complained = lock(&self.complained);
        let due = complained.is_none_or(|(_, then)| then.elapsed() >= COMPLAINT);
        if due && lost > complained.map_or(0, |(count, _)| count) {
            *complained = Some((lost, Instant::now()));
            warn!("{}: {lost} messages have been lost so far", self.name);
        }
    }
}

/// The account of one recording.
#[derive(Debug, Default)]
pub(crate) struct Account {
    tracks: Mutex<Vec<Arc<Track>>>,
    /// Topics that cannot be recorded.
    refused: Mutex<BTreeSet<String>>,
    /// Messages received that an error has kept out of the bag, by topic.
    unwritten: Mutex<BTreeMap<String, u64>>,
    /// The name of the scene that is flown.
    scene: OnceLock<String>,
    waits: AtomicU64,
    /// In nanoseconds.
    waited: AtomicU64,
    complained: Mutex<Option<Instant>>,
    /// The file that is written.
    file: Mutex<String>,
}

impl Account {
    /// Adds a topic; returns its place too.
    pub(crate) fn add(&self, name: &str) -> (usize, Arc<Track>) {
        let track = Arc::new(Track {
            name: name.to_owned(),
            topic: OnceLock::new(),
            received: AtomicU64::new(0),
            written: AtomicU64::new(0),
            unusable: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            left_out: AtomicU64::new(0),
            complained: Mutex::default(),
            in_memory: AtomicBool::new(false),
        });
        let mut tracks = lock(&self.tracks);
        tracks.push(Arc::clone(&track));
        (tracks.len() - 1, track)
    }

    /// The topic at a place.
    pub(crate) fn track(&self, place: usize) -> Option<Arc<Track>> {
        lock(&self.tracks).get(place).cloned()
    }

    /// Takes note of a topic that cannot be recorded; whether that is news.
    pub(crate) fn refuse(&self, name: &str) -> bool {
        lock(&self.refused).insert(name.to_owned())
    }

    /// Takes note of a topic that can be recorded after all.
    pub(crate) fn accept(&self, name: &str) {
        lock(&self.refused).remove(name);
    }

    /// Takes note of what an error has kept out of the bag: the messages that its writer has taken in vain, by topic, to
    /// which those are added that have been received and not handed to it.
    pub(crate) fn give_up(&self, unwritten: &mut BTreeMap<String, u64>) {
        for track in lock(&self.tracks).iter() {
            let [received, written, unusable] = [&track.received, &track.written, &track.unusable]
                .map(|count| count.load(Ordering::Relaxed));
            let left = received.saturating_sub(written + unusable);
            if left > 0 {
                *unwritten.entry(track.name.clone()).or_default() += left;
            }
        }
        lock(&self.unwritten).clone_from(unwritten);
    }

    /// Takes note of the scene that is flown; the first one counts.
    pub(crate) fn fly(&self, scene: String) {
        let _ = self.scene.set(scene);
    }

    /// Takes note of the file that is written.
    pub(crate) fn write_to(&self, file: &Path) {
        *lock(&self.file) = file.display().to_string();
    }

    /// Takes note of a time for which receiving has waited, `first` of that wait, and says so from time to time.
    pub(crate) fn waited(&self, first: bool, time: Duration) {
        let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        self.waited.fetch_add(nanoseconds, Ordering::Relaxed);
        self.waits.fetch_add(u64::from(first), Ordering::Relaxed);
        let mut complained = lock(&self.complained);
        if complained.is_none_or(|then| then.elapsed() >= COMPLAINT) {
            *complained = Some(Instant::now());
            let (waits, waited) = self.waits();
            warn!(
                "writing does not keep up: receiving has waited {waits} times so far, {waited:.3} s"
            );
        }
    }

    /// Says which topics have lost messages, if that is news.
    pub(crate) fn complain(&self) {
        lock(&self.tracks).iter().for_each(|track| track.complain());
    }

    /// How often receiving has waited, and for how long (s).
    pub(crate) fn waits(&self) -> (u64, f64) {
        let nanoseconds = self.waited.load(Ordering::Relaxed);
        let waited = Duration::from_nanos(nanoseconds).as_secs_f64();
        (self.waits.load(Ordering::Relaxed), waited)
    }

    /// Messages written, by topic.
    pub(crate) fn written(&self) -> BTreeMap<String, u64> {
        self.counts(|track| &track.written)
    }

    /// Messages known to be missing, by topic.
    pub(crate) fn lost(&self) -> BTreeMap<String, u64> {
        let mut lost = self.counts(|track| &track.lost);
        let unusable = self.counts(|track| &track.unusable);
        let unwritten = lock(&self.unwritten).clone();
        for (topic, count) in unusable.into_iter().chain(unwritten) {
            *lost.entry(topic).or_default() += count;
        }
        lost
    }

    /// What stands in the bag's metadata.
    pub(crate) fn metadata(&self) -> BTreeMap<String, String> {
        let lost = self.lost();
        let total: u64 = lost.values().sum();
        let (_, waited) = self.waits();
        let mut metadata = BTreeMap::from([
            ("software".to_owned(), SOFTWARE.to_owned()),
            ("lost".to_owned(), total.to_string()),
            ("waited".to_owned(), format!("{waited:.6}")),
        ]);
        let each = lost
            .iter()
            .map(|(topic, lost)| (format!("lost:{topic}"), lost.to_string()));
        metadata.extend(each);
        let scene = self.scene.get().cloned();
        metadata.extend(scene.map(|scene| ("scene".to_owned(), scene)));
        metadata
    }

    /// What stands in `/diagnostics`.
    pub(crate) fn status(&self, paused: bool) -> Status {
        let written: u64 = self.written().values().sum();
        let lost = self.lost();
        let total: u64 = lost.values().sum();
        let (waits, waited) = self.waits();
        let left_out: u64 = self.counts(|track| &track.left_out).values().sum();
        let refused = lock(&self.refused).len();
        let said = if paused {
            format!("paused after {written} messages")
        } else {
            format!("{written} messages written")
        };
        let status = Status::ok(said)
            .when(total > 0, Level::Warn, "messages are missing")
            .when(waits > 0, Level::Warn, "writing does not keep up")
            .when(refused > 0, Level::Warn, "topics are not recorded")
            .value("messages written", written)
            .value("messages lost", total)
            .value("messages left out in pauses", left_out)
            .value("times waited", waits)
            .value("time waited (s)", format!("{waited:.3}"))
            .value("file", &*lock(&self.file))
            .value("topics not recorded", refused);
        lost.iter().fold(status, |status, (topic, lost)| {
            status.value(format!("messages lost on {topic}"), lost)
        })
    }

    fn counts(&self, of: impl Fn(&Track) -> &AtomicU64) -> BTreeMap<String, u64> {
        let mut counts = BTreeMap::new();
        for track in lock(&self.tracks).iter() {
            let count = of(track).load(Ordering::Relaxed);
            if count > 0 {
                *counts.entry(track.name.clone()).or_default() += count;
            }
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_metadata_names_topics_that_have_lost_something() {
        let account = Account::default();
        let (_, one) = account.add("/one");
        let (place, other) = account.add("/other");
        assert_eq!(account.track(place).unwrap().name, "/other");
        one.written.store(7, Ordering::Relaxed);
        other.lost.store(3, Ordering::Relaxed);
        account.waited(true, Duration::from_millis(20));
        account.waited(false, Duration::from_millis(5));
        account.fly("pendulum".into());
        assert_eq!(account.written(), BTreeMap::from([("/one".into(), 7)]));
        assert_eq!(account.waits(), (1, 0.025));
        let expected = [
            ("lost", "3"),
            ("lost:/other", "3"),
            ("scene", "pendulum"),
            ("software", SOFTWARE),
            ("waited", "0.025000"),
        ];
        let expected = expected.map(|(key, value)| (key.to_owned(), value.to_owned()));
        assert_eq!(account.metadata(), BTreeMap::from(expected));
    }

    #[test]
    fn losses_are_told_at_once_and_then_from_time_to_time() {
        let account = Account::default();
        let (_, track) = account.add("/one");
        let told = || lock(&track.complained).map(|(lost, _)| lost);
        account.complain();
        assert_eq!(told(), None);
        for lost in [3, 5] {
            track.lost.store(lost, Ordering::Relaxed);
            account.complain();
            assert_eq!(told(), Some(3));
        }
        let earlier = Instant::now().checked_sub(COMPLAINT).unwrap();
        *lock(&track.complained) = Some((3, earlier));
        account.complain();
        assert_eq!(told(), Some(5));
    }

    #[test]
    fn a_topic_is_refused_once() {
        let account = Account::default();
        assert!(account.refuse("/strange"));
        assert!(!account.refuse("/strange"));
        account.accept("/strange");
        assert!(account.refuse("/strange"));
    }

    #[test]
    fn what_was_received_and_is_not_in_the_bag_is_lost() {
        let account = Account::default();
        let (_, one) = account.add("/one");
        let (_, other) = account.add("/other");
        one.received.store(10, Ordering::Relaxed);
        one.written.store(7, Ordering::Relaxed);
        one.unusable.store(1, Ordering::Relaxed);
        one.lost.store(4, Ordering::Relaxed);
        other.received.store(3, Ordering::Relaxed);
        other.written.store(3, Ordering::Relaxed);
        assert_eq!(account.lost(), BTreeMap::from([("/one".into(), 5)]));
        // Messages that the writer has taken in vain.
        let mut unwritten = BTreeMap::from([("/other".to_owned(), 2)]);
        account.give_up(&mut unwritten);
        let all = BTreeMap::from([("/one".into(), 2), ("/other".into(), 2)]);
        assert_eq!(unwritten, all);
        let lost = BTreeMap::from([("/one".into(), 7), ("/other".into(), 2)]);
        assert_eq!(account.lost(), lost);
    }
}
