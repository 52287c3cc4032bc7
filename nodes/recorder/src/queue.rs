//! The queue between those who receive and the one who writes, bounded in bytes and in messages.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use lgvi_middleware::sync::{lock, wait_while};

use crate::account::Account;
use crate::batch::Batch;

/// The most messages that wait to be written, however small.
const MESSAGES: usize = 1 << 18;

/// How long those who wait wait before they say so again.
const SAY: Duration = Duration::from_millis(100);

/// Batches that are kept to be used again, and how much memory each may hold (bytes).
const SPARE: usize = 16;
const SPARE_CAPACITY: usize = 256 << 10;

/// Why a file is not split.
const CLOSED: &str = "the bag is closed";

/// Who has asked for a split, and waits to hear how it went.
pub(crate) type Split = Box<dyn FnOnce(Result<(), String>) + Send>;

/// Messages that wait to be written.
pub(crate) struct Queue {
    state: Mutex<State>,
    /// There is something to take.
    filled: Condvar,
    /// There is more room.
    emptied: Condvar,
    /// What may wait or be written at a time (bytes).
    budget: usize,
    account: Arc<Account>,
}

#[derive(Default)]
struct State {
    waiting: VecDeque<Batch>,
    spare: Vec<Batch>,
    splits: Vec<Split>,
    /// Of what waits and of what is being written.
    size: usize,
    messages: usize,
    outlets: usize,
    /// Nothing more will be taken.
    ended: bool,
}

/// What the writer gets.
pub(crate) enum Taken {
    Batch(Batch),
    Split(Split),
    /// The time is over.
    Nothing,
    /// Nothing more will come.
    End,
}

impl Queue {
    /// `budget` is what may wait (bytes); a message that is larger by itself waits alone.
    pub(crate) fn new(budget: usize, account: Arc<Account>) -> Arc<Self> {
        Arc::new(Self {
            state: Mutex::default(),
            filled: Condvar::new(),
            emptied: Condvar::new(),
            budget,
            account,
        })
    }

    /// One outlet more is there.
    pub(crate) fn open_outlet(&self) {
        lock(&self.state).outlets += 1;
    }

    /// Takes what is next, up to `timeout`.
    pub(crate) fn take(&self, timeout: Duration) -> Taken {
        let idle = |state: &mut State| {
            state.splits.is_empty() && state.waiting.is_empty() && state.outlets > 0
        };
        let mut state = wait_while(&self.filled, &self.state, timeout, idle);
        if let Some(split) = state.splits.pop() {
            Taken::Split(split)
        } else if let Some(batch) = state.waiting.pop_front() {
            Taken::Batch(batch)
        } else if state.outlets == 0 {
            Taken::End
        } else {
            Taken::Nothing
        }
    }

    /// Gives back a batch that has been written.
    pub(crate) fn give_back(&self, mut batch: Batch) {
        let mut state = lock(&self.state);
        state.size -= batch.size();
        state.messages -= batch.len();
        batch.clear();
        if state.spare.len() < SPARE && batch.capacity() <= SPARE_CAPACITY {
            state.spare.push(batch);
        }
        drop(state);
        self.emptied.notify_all();
    }

    /// Has the writer begin a new file.
    pub(crate) fn split(&self, split: Split) {
        let mut state = lock(&self.state);
        if state.ended {
            drop(state);
            return split(Err(CLOSED.to_owned()));
        }
        state.splits.push(split);
        self.filled.notify_one();
    }

    /// Nothing will be taken from here on: nobody waits for room.
    pub(crate) fn end(&self) {
        let mut state = lock(&self.state);
        state.ended = true;
        state.waiting.clear();
        let splits = std::mem::take(&mut state.splits);
        drop(state);
        self.emptied.notify_all();
        for split in splits {
            split(Err(CLOSED.to_owned()));
        }
    }

    /// The same, and waits until nobody hands over any more.
    pub(crate) fn end_with_outlets(&self) {
        self.end();
        let open = |state: &mut State| state.outlets > 0;
        drop(wait_while(&self.filled, &self.state, Duration::MAX, open));
    }

    /// Whether nothing will be taken any more.
    pub(crate) fn ended(&self) -> bool {
        lock(&self.state).ended
    }

    /// What may wait (bytes).
    pub(crate) fn budget(&self) -> usize {
        self.budget
    }

    /// One outlet is there no more.
    pub(crate) fn close_outlet(&self) {
        lock(&self.state).outlets -= 1;
        self.filled.notify_all();
    }

    /// Hands over a batch, and leaves an empty one; `false` where nobody takes it any more.
    pub(crate) fn put(&self, batch: &mut Batch) -> bool {
        let (size, messages) = (batch.size(), batch.len());
        let full = |state: &mut State| {
            let over = state.size + size > self.budget || state.messages + messages > MESSAGES;
            !state.ended && state.size > 0 && over
        };
        let mut state = lock(&self.state);
        let mut said = Instant::now();
        let mut first = true;
        while full(&mut state) {
            drop(state);
            state = wait_while(&self.emptied, &self.state, SAY, full);
            self.account.waited(first, said.elapsed());
            (said, first) = (Instant::now(), false);
        }
        if state.ended {
            batch.clear();
            return false;
        }
        state.size += size;
        state.messages += messages;
        let empty = state.spare.pop().unwrap_or_default();
        state.waiting.push_back(std::mem::replace(batch, empty));
        self.filled.notify_one();
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::Head;
    use crate::outlet::Outlet;

    const HEAD: Head = Head {
        publisher: 0,
        track: 0,
        log_time: 0,
        publish_time: 0,
        sequence: 0,
    };

    /// Takes until the end, slowly; how much was in the queue at most, and the messages.
    fn take_slowly(queue: &Queue) -> (usize, Vec<u64>) {
        let (mut most, mut sequences) = (0, Vec::new());
        loop {
            match queue.take(SAY) {
                Taken::Batch(batch) => {
                    most = most.max(lock(&queue.state).size);
                    std::thread::sleep(Duration::from_millis(1));
                    sequences.extend(batch.messages().map(|(head, _)| head.sequence));
                    queue.give_back(batch);
                }
                Taken::End => return (most, sequences),
                Taken::Split(_) | Taken::Nothing => {}
            }
        }
    }

    #[test]
    fn who_puts_waits_for_who_takes_and_nothing_is_lost() {
        let account = Arc::<Account>::default();
        let budget = 4000;
        let queue = Queue::new(budget, Arc::clone(&account));
        let mut outlet = Outlet::new(&queue);
        let (most, sequences) = std::thread::scope(|scope| {
            let taker = scope.spawn(|| take_slowly(&queue));
            for sequence in 0..200 {
                outlet.put(Head { sequence, ..HEAD }, &[0; 300]);
            }
            drop(outlet);
            taker.join().unwrap()
        });
        assert_eq!(sequences, (0..200).collect::<Vec<_>>());
        assert!(most <= budget, "{most}");
        let (waits, waited) = account.waits();
        assert!(waits > 0 && waited > 0.0, "{waits} {waited}");
    }

    #[test]
    fn a_message_larger_than_the_budget_waits_alone() {
        let account = Arc::<Account>::default();
        let queue = Queue::new(1000, Arc::clone(&account));
        let mut outlet = Outlet::new(&queue);
        std::thread::scope(|scope| {
            let taker = scope.spawn(|| take_slowly(&queue));
            for sequence in 0..3 {
                outlet.put(Head { sequence, ..HEAD }, &[0; 5000]);
            }
            drop(outlet);
            assert_eq!(taker.join().unwrap().1, [0, 1, 2]);
        });
    }

    #[test]
    fn nobody_waits_for_a_writer_that_has_ended() {
        let queue = Queue::new(100, Arc::default());
        let mut outlet = Outlet::new(&queue);
        queue.end();
        (0..10).for_each(|_| outlet.put(HEAD, &[0; 300]));
        let (answer, answered) = std::sync::mpsc::channel();
        queue.split(Box::new(move |split| answer.send(split).unwrap()));
        assert_eq!(answered.recv().unwrap(), Err(CLOSED.to_owned()));
    }
}
