//! The writing thread.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lgvi_bag::{BagOptions, BagSummary, BagWriter, Durability, Qos, Topic, TopicId, WriteError};
use lgvi_msgs::MessageType;

/// Messages that wait to be written.
const QUEUE: usize = 4096;

/// How often what is written is made safe from a sudden end of the process.
const FLUSH: Duration = Duration::from_millis(500);

/// How often the counts are told.
const COUNTS: Duration = Duration::from_millis(50);

/// A message to be written.
pub(crate) struct Record {
    pub(crate) topic: Arc<str>,
    pub(crate) message_type: MessageType,
    /// How many messages of this topic its publisher keeps for late joiners.
    pub(crate) depth: u32,
    /// When it is logged (ns since the UNIX epoch).
    pub(crate) log_time: i64,
    /// When it was published (ns since the UNIX epoch).
    pub(crate) publish_time: i64,
    pub(crate) sequence: u64,
    pub(crate) cdr: Vec<u8>,
}

/// Messages written, by topic.
pub(crate) type Counts = BTreeMap<String, u64>;

/// The thread that writes a bag.
pub(crate) struct Sink {
    pub(crate) queue: SyncSender<Record>,
    thread: JoinHandle<Result<BagSummary, WriteError>>,
}

impl Sink {
    /// Writes to `writer` what comes through the queue; `tell` hears the counts from time to time.
    pub(crate) fn start(
        writer: BagWriter,
        tell: impl FnMut(&Counts) + Send + 'static,
    ) -> std::io::Result<Self> {
        let (queue, records) = sync_channel(QUEUE);
        let thread = std::thread::Builder::new()
            .name("writer".into())
            .spawn(move || write(writer, &records, tell))?;
        Ok(Self { queue, thread })
    }

    /// Whether the thread has ended, which it does before [`Sink::finish`] only when writing failed.
    pub(crate) fn failed(&self) -> bool {
        self.thread.is_finished()
    }

    /// Writes what is queued and closes the bag. All other senders to the queue must be gone.
    pub(crate) fn finish(self) -> Option<Result<BagSummary, WriteError>> {
        drop(self.queue);
        self.thread.join().ok()
    }
}

/// Creates the bag.
pub(crate) fn create(config: &crate::config::Config) -> Result<BagWriter, WriteError> {
    BagWriter::create(&config.output, BagOptions::default())
}

fn write(
    mut writer: BagWriter,
    records: &Receiver<Record>,
    mut tell: impl FnMut(&Counts),
) -> Result<BagSummary, WriteError> {
    let mut topics: BTreeMap<Arc<str>, (TopicId, u64)> = BTreeMap::new();
    let (mut flushed, mut told) = (Instant::now(), Instant::now());
    let (mut unflushed, mut untold) = (false, false);
    loop {
        match records.recv_timeout(COUNTS) {
            Ok(record) => {
                let (id, count) = match topics.entry(Arc::clone(&record.topic)) {
                    Entry::Occupied(known) => known.into_mut(),
                    Entry::Vacant(new) => new.insert((writer.add_topic(&topic(&record))?, 0)),
                };
                let [log_time, publish_time] =
                    [record.log_time, record.publish_time].map(|time| time.max(0).cast_unsigned());
                // The bag's field is narrower; what counts is that neighbours differ.
                let sequence = record.sequence as u32;
                writer.write(*id, log_time, publish_time, sequence, &record.cdr)?;
                *count += 1;
                (unflushed, untold) = (true, true);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        if unflushed && flushed.elapsed() >= FLUSH {
            writer.flush()?;
            (flushed, unflushed) = (Instant::now(), false);
        }
        if untold && told.elapsed() >= COUNTS {
            tell(&counts(&topics));
            (told, untold) = (Instant::now(), false);
        }
    }
    tell(&counts(&topics));
    writer.finish(BTreeMap::new())
}

fn counts(topics: &BTreeMap<Arc<str>, (TopicId, u64)>) -> Counts {
    let each = topics
        .iter()
        .map(|(topic, (_, count))| (topic.to_string(), *count));
    each.collect()
}

fn topic(record: &Record) -> Topic {
    Topic {
        name: record.topic.to_string(),
        type_name: record.message_type.name.into(),
        type_hash: record.message_type.hash.into(),
        definition: record.message_type.definition.into(),
        qos: Qos {
            durability: Durability::TransientLocal,
            depth: record.depth,
            ..Qos::default()
        },
    }
}
