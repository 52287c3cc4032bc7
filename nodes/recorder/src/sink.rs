//! The writing thread.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lgvi_bag::{BagSummary, BagWriter, TopicId, WriteError};

use tracing::{info, warn};

use crate::account::{Account, Track};
use crate::batch::{Batch, Head};
use crate::queue::{Queue, Taken};

/// How often what is written is made safe from a sudden end of the process.
const FLUSH: Duration = Duration::from_millis(500);

/// How often the counts are told.
const COUNTS: Duration = Duration::from_millis(50);

/// The thread that writes a bag.
pub(crate) struct Sink {
    thread: JoinHandle<Result<BagSummary, WriteError>>,
    queue: Arc<Queue>,
}

/// What is written to.
struct Bag {
    writer: BagWriter,
    account: Arc<Account>,
    /// Topics by their places in the account.
    topics: Vec<Recorded>,
    /// The file that was written last.
    path: PathBuf,
}

/// A topic in the bag.
struct Recorded {
    track: Arc<Track>,
    /// Once it has been written to.
    id: Option<TopicId>,
}

/// Ends the queue however the thread ends.
struct Ending(Arc<Queue>);

impl Drop for Ending {
    fn drop(&mut self) {
        self.0.end();
    }
}

impl Sink {
    /// Writes to `writer` what comes through the queue; `tell` is called from time to time. Where writing fails, all that has
    /// been received by then is counted before the bag is closed: whoever sees that it has [`failed`](Self::failed) has to
    /// drop the queue's outlets.
    pub(crate) fn start(
        mut writer: BagWriter,
        queue: &Arc<Queue>,
        account: &Arc<Account>,
        tell: impl FnMut() + Send + 'static,
    ) -> std::io::Result<Self> {
        let (left, unwritten_of) = (Arc::clone(queue), Arc::clone(account));
        writer.on_failure(move |unwritten| {
            left.end_with_outlets();
            unwritten_of.give_up(unwritten);
            unwritten_of.metadata()
        });
        let bag = Bag {
            writer,
            account: Arc::clone(account),
            topics: Vec::new(),
            path: PathBuf::new(),
        };
        let thread = std::thread::Builder::new().name("writer".into()).spawn({
            let queue = Arc::clone(queue);
            move || bag.fill(&queue, tell)
        })?;
        let queue = Arc::clone(queue);
        Ok(Self { thread, queue })
    }

    /// Whether nothing more is written, which before [`Sink::finish`] is so only when writing failed.
    pub(crate) fn failed(&self) -> bool {
        self.queue.ended()
    }

    /// Writes what is queued and closes the bag. All outlets of the queue must be gone.
    pub(crate) fn finish(self) -> Option<Result<BagSummary, WriteError>> {
        self.thread.join().ok()
    }
}

impl Bag {
    fn fill(
        mut self,
        queue: &Arc<Queue>,
        mut tell: impl FnMut(),
    ) -> Result<BagSummary, WriteError> {
        let _ending = Ending(Arc::clone(queue));
        let (mut flushed, mut told) = (Instant::now(), Instant::now());
        let (mut unflushed, mut untold) = (false, false);
        loop {
            self.follow();
            match queue.take(COUNTS) {
                Taken::Batch(batch) => {
                    self.write(&batch)?;
                    queue.give_back(batch);
                    (unflushed, untold) = (true, true);
                }
                Taken::Split(answer) => {
                    self.writer.set_custom(self.account.metadata());
                    let split = self.writer.split();
                    answer(split.as_ref().map_err(ToString::to_string).copied());
                    split?;
                }
                Taken::Nothing => {}
                Taken::End => break,
            }
            if unflushed && flushed.elapsed() >= FLUSH {
                // Should writing fail, this is what the bag says of itself.
                self.writer.set_custom(self.account.metadata());
                self.writer.flush()?;
                (flushed, unflushed) = (Instant::now(), false);
            }
            if untold && told.elapsed() >= COUNTS {
                self.account.not_repeated(self.writer.not_repeated());
                tell();
                (told, untold) = (Instant::now(), false);
            }
        }
        self.account.not_repeated(self.writer.not_repeated());
        tell();
        self.writer.finish(self.account.metadata())
    }

    fn write(&mut self, batch: &Batch) -> Result<(), WriteError> {
        for (head, cdr) in batch.messages() {
            self.find(head.track);
            let Some(recorded) = self.topics.get_mut(head.track) else {
                continue;
            };
            match write(&mut self.writer, recorded, head, cdr) {
                Ok(written) => {
                    let written = u64::from(written);
                    recorded.track.written.fetch_add(written, Ordering::Relaxed);
                }
                Err(error) if self.writer.is_ended() => return Err(error),
                Err(error) => recorded.pass_over(&error),
            }
        }
        Ok(())
    }

    /// Takes note of the file that is written, and of what it lacks.
    fn follow(&mut self) {
        let path = self.writer.path();
        if path != self.path {
            info!("writing {}", path.display());
            self.account.write_to(&path);
            self.path = path;
        }
    }

    /// Looks up the topics in the account up to this place.
    fn find(&mut self, place: usize) {
        while self.topics.len() <= place
            && let Some(track) = self.account.track(self.topics.len())
        {
            self.topics.push(Recorded { track, id: None });
        }
    }
}

impl Recorded {
    /// Counts a message that the bag cannot take.
    fn pass_over(&self, error: &WriteError) {
        let Track { name, unusable, .. } = &*self.track;
        if unusable.fetch_add(1, Ordering::Relaxed) == 0 {
            warn!("{name}: a message cannot be recorded: {error}");
        }
    }
}

/// Writes a message; false of a topic that is not described yet.
fn write(
    writer: &mut BagWriter,
    recorded: &mut Recorded,
    head: Head,
    cdr: &[u8],
) -> Result<bool, WriteError> {
    if recorded.id.is_none()
        && let Some(topic) = recorded.track.topic.get()
    {
        recorded.id = Some(writer.add_topic(topic)?);
    }
    let Some(id) = recorded.id else {
        return Ok(false);
    };
    let [log_time, publish_time] =
        [head.log_time, head.publish_time].map(|time| time.max(0).cast_unsigned());
    // The bag's field is narrower; what counts is that neighbours differ.
    let sequence = head.sequence as u32;
    let Head { publisher, .. } = head;
    writer.write_of(publisher, id, log_time, publish_time, sequence, cdr)?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;
    use std::path::Path;

    use lgvi_bag::{BagOptions, BagReader, Qos, ROS2MSG, Rest, Topic};

    use super::*;

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
        let receive = |outlet: &mut crate::outlet::Outlet, index: usize, count: u64| {
            let (place, track) = &tracks[index];
            for sequence in 0..count {
                track.received.fetch_add(1, Ordering::Relaxed);
                outlet.put(head(*place, sequence), &[0; 8]);
            }
        };
        let mut outlets = [queue.outlet(), queue.outlet()];
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
        let mut outlet = queue.outlet();
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

    #[test]
    fn latched_messages_that_are_not_repeated_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let bag = folder.path().join("bag");
        let account = Arc::<Account>::default();
        let queue = Queue::new(BUDGET, Arc::clone(&account));
        let (_, track) = account.add("/map");
        track.topic.get_or_init(|| Topic {
            qos: Qos {
                durability: lgvi_bag::Durability::TransientLocal,
                depth: 1,
                ..Qos::default()
            },
            ..topic("/map", "std_msgs/msg/String")
        });
        let mut outlet = queue.outlet();
        let options = BagOptions {
            compression: lgvi_bag::Compression::None,
            max_bytes: std::num::NonZeroU64::new(1000),
            ..BagOptions::default()
        };
        let writer = BagWriter::create(&bag, options).unwrap();
        let sink = Sink::start(writer, &queue, &account, || {}).unwrap();
        for sequence in 0..3 {
            outlet.put(head(0, sequence), &[0; 3000]);
        }
        drop(outlet);
        sink.finish().unwrap().unwrap();
        let told = format!("{:?}", account.status(false));
        assert!(told.contains("latched messages not repeated"), "{told}");
        assert!(told.contains("latched messages are not repeated"), "{told}");
        assert!(custom(&bag).contains_key("not_repeated:/map"));
    }
}
