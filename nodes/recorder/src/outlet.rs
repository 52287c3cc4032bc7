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
    pub(crate) fn new(queue: &Arc<Queue>) -> Self {
        queue.open_outlet();
        Self {
            queue: Arc::clone(queue),
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

#[cfg(test)]
mod tests {
    use allocation_counter::{AllocationInfo, measure};
    use lgvi_msgs::cdr;
    use lgvi_msgs::msg::SystemState;
    use lgvi_msgs::shm::{BodySample, Name, StateHeader};

    use super::*;
    use crate::queue::Taken;

    /// A state's way: its message, its bytes, its batch; once the batches that go round have grown.
    #[test]
    fn a_message_is_put_without_allocating() {
        let queue = Queue::new(8 << 20, Arc::default());
        let mut outlet = Outlet::new(&queue);
        let bodies = ["one", "other"].map(|name| BodySample {
            name: Name::try_from(name).unwrap(),
            position: [1.0; 3],
            linear_momentum: [2.0; 3],
            attitude: [0.0; 9],
            angular_momentum: [3.0; 3],
        });
        let mut message = SystemState::default();
        let mut put = |messages: u64| {
            for sequence in 0..messages {
                let header = StateHeader {
                    sequence,
                    step: sequence,
                    time: 0.0,
                    stamp_nanoseconds: 0,
                };
                header.update_message(&bodies, &mut message).unwrap();
                let head = Head {
                    publisher: 0,
                    track: 0,
                    log_time: 0,
                    publish_time: 0,
                    sequence,
                };
                let encode = |bytes: &mut Vec<u8>| cdr::encode_into(bytes, &message);
                outlet.put_with(head, encode).unwrap();
                // What the writer does with all that waits.
                if sequence % 1000 == 999 {
                    while let Taken::Batch(batch) = queue.take(Duration::ZERO) {
                        queue.give_back(batch);
                    }
                }
            }
        };
        put(10_000);
        assert_eq!(measure(|| put(100_000)), AllocationInfo::default());
    }
}
