//! The writing thread.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lgvi_bag::{BagSummary, BagWriter, TopicId, WriteError};

use tracing::info;

use crate::account::{Account, Track};
use crate::batch::Batch;
use crate::queue::{Queue, Taken};

/// How often what is written is made safe from a sudden end of the process.
const FLUSH: Duration = Duration::from_millis(500);

/// How often the counts are told.
const COUNTS: Duration = Duration::from_millis(50);

/// The thread that writes a bag.
pub(crate) struct Sink {
    thread: JoinHandle<Result<BagSummary, WriteError>>,
}

/// What is written to.
struct Bag {
    writer: BagWriter,
    account: Arc<Account>,
    /// The topics that have been written to, by their places in the account.
    topics: Vec<Option<(TopicId, Arc<Track>)>>,
    /// The file that was written last.
    path: PathBuf,
}

/// Ends the queue however the thread ends.
struct Ending(Arc<Queue>);

impl Drop for Ending {
    fn drop(&mut self) {
        self.0.end();
    }
}

impl Sink {
    /// Writes to `writer` what comes through the queue; `tell` is called from time to time.
    pub(crate) fn start(
        writer: BagWriter,
        queue: &Arc<Queue>,
        account: &Arc<Account>,
        tell: impl FnMut() + Send + 'static,
    ) -> std::io::Result<Self> {
        let queue = Arc::clone(queue);
        let bag = Bag {
            writer,
            account: Arc::clone(account),
            topics: Vec::new(),
            path: PathBuf::new(),
        };
        let thread = std::thread::Builder::new()
            .name("writer".into())
            .spawn(move || bag.fill(&queue, tell))?;
        Ok(Self { thread })
    }

    /// Whether the thread has ended, which it does before [`Sink::finish`] only when writing failed.
    pub(crate) fn failed(&self) -> bool {
        self.thread.is_finished()
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
                tell();
                (told, untold) = (Instant::now(), false);
            }
        }
        tell();
        self.writer.finish(self.account.metadata())
    }

    fn write(&mut self, batch: &Batch) -> Result<(), WriteError> {
        for (head, cdr) in batch.messages() {
            self.add_topic(head.track)?;
            let Some((topic, track)) = &self.topics[head.track] else {
                continue;
            };
            let [log_time, publish_time] =
                [head.log_time, head.publish_time].map(|time| time.max(0).cast_unsigned());
            // The bag's field is narrower; what counts is that neighbours differ.
            let sequence = head.sequence as u32;
            self.writer.write_of(
                head.publisher,
                *topic,
                log_time,
                publish_time,
                sequence,
                cdr,
            )?;
            track.written.fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    }

    /// Takes note of the file that is written.
    fn follow(&mut self) {
        let path = self.writer.path();
        if path != self.path {
            info!("writing {}", path.display());
            self.account.write_to(&path);
            self.path = path;
        }
    }

    /// Adds the topic of a place in the account to the bag, unless it is there.
    fn add_topic(&mut self, place: usize) -> Result<(), WriteError> {
        if self.topics.len() <= place {
            self.topics.resize_with(place + 1, || None);
        }
        if self.topics[place].is_none()
            && let Some(track) = self.account.track(place)
            && let Some(topic) = track.topic.get()
        {
            self.topics[place] = Some((self.writer.add_topic(topic)?, track));
        }
        Ok(())
    }
}
