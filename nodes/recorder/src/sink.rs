//! The writing thread.

use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use lgvi_bag::{BagSummary, BagWriter, WriteError};
use tracing::info;

use crate::account::Account;
use crate::batch::Batch;
use crate::queue::{Queue, Taken};
use crate::recorded::Recorded;

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

/// Ends the queue however the thread ends.
struct Ending(Arc<Queue>);

impl Drop for Ending {
    fn drop(&mut self) {
        self.0.end();
    }
}

impl Sink {
    /// Writes to `writer` what comes through the queue, until it has no outlets; `tell` is called from time to time. Where writing fails, all that has
    /// been received by then is counted before the bag is closed: whoever sees that it has [`failed`](Self::failed) has to
    /// drop the queue's outlets.
    pub(crate) fn start(
        mut writer: BagWriter,
        queue: &Arc<Queue>,
        account: &Arc<Account>,
        tell: impl FnMut() + Send + 'static,
    ) -> std::io::Result<Self> {
        let (failing, told) = (Arc::clone(queue), Arc::clone(account));
        writer.on_failure(move |unwritten| {
            failing.end_with_outlets();
            told.give_up(unwritten);
            told.metadata()
        });
        let bag = Bag {
            writer,
            account: Arc::clone(account),
            topics: Vec::new(),
            path: PathBuf::new(),
        };
        let (queue, taken) = (Arc::clone(queue), Arc::clone(queue));
        let thread = std::thread::Builder::new()
            .name("writer".into())
            .spawn(move || bag.fill(&taken, tell))?;
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
        self.describe();
        loop {
            self.follow();
            match queue.take(COUNTS) {
                Taken::Batch(batch) => {
                    self.write(&batch)?;
                    queue.give_back(batch);
                    (unflushed, untold) = (true, true);
                }
                Taken::Split(answer) => {
                    self.describe();
                    let split = self.writer.split();
                    answer(split.as_ref().map_err(ToString::to_string).copied());
                    split?;
                }
                Taken::Nothing => {}
                Taken::End => break,
            }
            if unflushed && flushed.elapsed() >= FLUSH {
                self.describe();
                self.writer.flush()?;
                (flushed, unflushed) = (Instant::now(), false);
            }
            if untold && told.elapsed() >= COUNTS {
                self.describe();
                tell();
                (told, untold) = (Instant::now(), false);
            }
        }
        tell();
        self.writer.finish(self.account.metadata())
    }

    /// Has the bag say how it is with the recording by now, whatever ends it or its file.
    fn describe(&mut self) {
        self.writer.set_custom(self.account.metadata());
    }

    fn write(&mut self, batch: &Batch) -> Result<(), WriteError> {
        for (head, cdr) in batch.messages() {
            self.find(head.track);
            let Some(recorded) = self.topics.get_mut(head.track) else {
                continue;
            };
            match recorded.write(&mut self.writer, head, cdr) {
                Err(error) if self.writer.is_ended() => return Err(error),
                Err(error) => recorded.pass_over(&error),
                Ok(()) => {}
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
            self.topics.push(Recorded::new(track));
        }
    }
}

#[cfg(test)]
mod tests;
