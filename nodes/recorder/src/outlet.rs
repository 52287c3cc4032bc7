//! The end of the queue that a receiver fills.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::batch::{Batch, Head};
use crate::queue::Queue;

/// From which size on a batch is handed over (bytes).
const BATCH: usize = 64 << 10;

/// How long messages lie in a batch before it is handed over.
const LINGER: Duration = Duration::from_millis(10);

/// Gathers a receiver's messages, and hands them over many at a time.
pub(crate) struct Outlet {
    queue: Arc<Queue>,
    batch: Batch,
    /// When the batch got its first message.
    since: Option<Instant>,
}

impl Outlet {
    pub(crate) fn new(queue: Arc<Queue>) -> Self {
        Self {
            queue,
            batch: Batch::default(),
            since: None,
        }
    }

    /// Adds a message whose bytes `encode` appends.
    ///
    /// # Errors
    /// Those of `encode`, after which nothing has been added.
    pub(crate) fn put_with<E>(
        &mut self,
        head: Head,
        encode: impl FnOnce(&mut Vec<u8>) -> Result<(), E>,
    ) -> Result<(), E> {
        self.batch.push_with(head, encode)?;
        if self.since.is_none() {
            self.since = Some(Instant::now());
        }
        // A small budget has small batches, so that several fit.
        if self.batch.size() >= BATCH.min(self.queue.budget() / 4) {
            self.hand_over();
        }
        Ok(())
    }

    /// Adds a message.
    pub(crate) fn put(&mut self, head: Head, cdr: &[u8]) {
        let append = |bytes: &mut Vec<u8>| {
            bytes.extend_from_slice(cdr);
            Ok::<(), Infallible>(())
        };
        let Ok(()) = self.put_with(head, append);
    }

    /// Hands over what has lain for a while.
    pub(crate) fn tick(&mut self) {
        if self.since.is_some_and(|since| since.elapsed() >= LINGER) {
            self.hand_over();
        }
    }

    /// Whether nobody takes anything any more.
    pub(crate) fn is_over(&self) -> bool {
        self.queue.ended()
    }

    /// Hands over what there is.
    pub(crate) fn hand_over(&mut self) {
        self.since = None;
        if self.batch.len() > 0 {
            // The writer ends before the receivers only when it has failed, which it says itself.
            let _ = self.queue.put(&mut self.batch);
        }
    }
}

impl Drop for Outlet {
    fn drop(&mut self) {
        self.hand_over();
        self.queue.close_outlet();
    }
}
