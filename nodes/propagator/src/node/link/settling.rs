//! Waiting, at the end, for what was published to be acknowledged.

use std::sync::mpsc;
use std::time::{Duration, Instant};

use super::Published;

/// How long one topic is waited for at a stretch.
const SLICE: Duration = Duration::from_millis(10);

/// A topic whose messages may still be under way.
pub(super) trait Outgoing {
    /// How much of `patience` its subscribers are worth.
    fn patience(&self, patience: Duration) -> Duration;

    /// Whether all is acknowledged, or is so within `wait`.
    fn acknowledged_within(&self, wait: Duration) -> bool;

    /// Waits no more for what is not acknowledged, and says so.
    fn give_up(&self);

    /// Its name, and how many messages were sent.
    fn published(&self) -> (String, u64);
}

/// Waits for the topics, one after the other, until a time that is the same for all.
pub(super) struct Settling {
    patience: Duration,
    began: Instant,
    /// The topic that is waited for, and since when.
    topic: usize,
    since: Instant,
    answer: mpsc::Sender<Published>,
}

impl Settling {
    /// Up to `patience` from now; `answer` is told what was published.
    pub(super) fn new(patience: Duration, answer: mpsc::Sender<Published>) -> Self {
        let began = Instant::now();
        Self {
            patience,
            began,
            topic: 0,
            since: began,
            answer,
        }
    }

    /// Waits a little while for one topic; whether none is left.
    pub(super) fn go_on(&mut self, topics: &[&dyn Outgoing]) -> bool {
        let Some(topic) = topics.get(self.topic) else {
            let published = topics.iter().map(|topic| topic.published()).collect();
            // Who has asked may have gone.
            let _ = self.answer.send(published);
            return true;
        };
        let all = self.patience.saturating_sub(self.began.elapsed());
        let own = topic.patience(self.patience);
        let left = all.min(own.saturating_sub(self.since.elapsed()));
        let acknowledged = topic.acknowledged_within(left.min(SLICE));
        if !acknowledged && left.is_zero() {
            topic.give_up();
        }
        if acknowledged || left.is_zero() {
            self.topic += 1;
            self.since = Instant::now();
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use std::cell::{Cell, RefCell};

    use super::*;

    /// Whose subscriber is suspended.
    #[derive(Default)]
    struct Stalled {
        waits: RefCell<Vec<Duration>>,
        given_up: Cell<u32>,
    }

    impl Outgoing for Stalled {
        fn patience(&self, patience: Duration) -> Duration {
            patience
        }

        fn acknowledged_within(&self, wait: Duration) -> bool {
            self.waits.borrow_mut().push(wait);
            std::thread::sleep(wait);
            false
        }

        fn give_up(&self) {
            self.given_up.set(self.given_up.get() + 1);
        }

        fn published(&self) -> (String, u64) {
            ("/topic".to_owned(), 1)
        }
    }

    #[test]
    fn all_topics_together_are_waited_for_no_longer_than_one() {
        let patience = Duration::from_millis(100);
        let stalled: Vec<_> = (0..1000).map(|_| Stalled::default()).collect();
        let topics: Vec<_> = stalled.iter().map(|topic| topic as &dyn Outgoing).collect();
        let (answer, published) = mpsc::channel();
        let mut settling = Settling::new(patience, answer);
        while !settling.go_on(&topics) {}
        let waits = stalled.iter().flat_map(|topic| topic.waits.take());
        let waits: Vec<_> = waits.collect();
        assert!(waits.iter().sum::<Duration>() <= patience, "{waits:?}");
        assert!(waits.iter().all(|wait| *wait <= SLICE), "{waits:?}");
        assert!(stalled.iter().all(|topic| topic.given_up.get() == 1));
        assert_eq!(published.recv().unwrap().get("/topic"), Some(&1));
    }
}
