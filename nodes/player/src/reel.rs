//! A bag's messages one after the other, and where one is among them.

use lgvi_bag::{BagReader, Message, Messages};
use lgvi_node::NodeError;

/// A place between two messages of a bag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Place {
    /// What was recorded before this time (ns) lies behind,
    time: u64,
    /// and so many messages that were recorded at it.
    passed: usize,
}

/// The messages that are to be played, from a place on.
pub(crate) struct Reel<'a> {
    bag: &'a BagReader,
    /// Which of the bag's topics are to be played.
    wanted: &'a [bool],
    /// No later message is (ns).
    end: u64,
    messages: Messages<'a>,
    /// The message after the place.
    next: Option<Shown<'a>>,
    place: Place,
    ended: bool,
}

/// A message of a reel.
pub(crate) struct Shown<'a> {
    /// Which of the bag's topics it is of.
    pub(crate) topic: usize,
    pub(crate) message: Message<'a>,
}

impl Place {
    /// Before all messages of a time (ns) or later.
    pub(crate) fn at(time: u64) -> Self {
        Self { time, passed: 0 }
    }

    fn pass(&mut self, time: u64) {
        if self.time != time {
            *self = Self::at(time);
        }
        self.passed += 1;
    }
}

impl<'a> Reel<'a> {
    pub(crate) fn new(
        bag: &'a BagReader,
        wanted: &'a [bool],
        end: u64,
        place: Place,
    ) -> Result<Self, NodeError> {
        let mut messages = bag.messages_from(place.time);
        for passed in messages.by_ref().take(place.passed) {
            passed.map_err(NodeError::input)?;
        }
        Ok(Self {
            bag,
            wanted,
            end,
            messages,
            next: None,
            place,
            ended: false,
        })
    }

    /// The next message, which stays the next one; `None` at the end.
    ///
    /// # Errors
    /// A message cannot be read, or `interrupted` on the way to it.
    pub(crate) fn peek(
        &mut self,
        interrupted: impl Fn() -> bool,
    ) -> Result<Option<&Shown<'a>>, NodeError> {
        while self.next.is_none() && !self.ended {
            if interrupted() {
                return Err(NodeError::Interrupted);
            }
            let Some(message) = self.messages.next() else {
                self.ended = true;
                break;
            };
            let message = message.map_err(NodeError::input)?;
            let topic = index(self.bag, &message);
            if message.log_time > self.end {
                self.ended = true;
            } else if self.wanted.get(topic) == Some(&true) {
                self.next = Some(Shown { topic, message });
            } else {
                self.place.pass(message.log_time);
            }
        }
        Ok(self.next.as_ref())
    }

    /// Takes the message that was looked at.
    pub(crate) fn take(&mut self) -> Option<Shown<'a>> {
        let next = self.next.take()?;
        self.place.pass(next.message.log_time);
        Some(next)
    }

    /// After the message that was taken last.
    pub(crate) fn place(&self) -> Place {
        self.place
    }
}

/// Which of a bag's topics a message is of.
pub(crate) fn index(bag: &BagReader, message: &Message<'_>) -> usize {
    let topics = bag.topics();
    topics
        .iter()
        .position(|topic| std::ptr::eq(topic, message.topic))
        .unwrap_or(topics.len())
}
