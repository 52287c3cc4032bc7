//! A bag's messages one after the other, and where one is among them.

use lgvi_bag::{BagReader, Message, Messages};
use lgvi_middleware::node::NodeError;

/// A place between two messages of a bag.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Place {
    /// What was recorded before this time (ns) lies behind,
    time: u64,
    /// and so many messages to be played that were recorded at it.
    passed: usize,
}

/// The messages that are to be played, from a place on.
pub(crate) struct Reel<'a> {
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
        wanted: &[bool],
        end: u64,
        place: Place,
    ) -> Result<Self, NodeError> {
        let mut messages = chosen(bag, place.time, wanted);
        for passed in messages.by_ref().take(place.passed) {
            passed.map_err(NodeError::input)?;
        }
        Ok(Self {
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
    /// It cannot be read.
    pub(crate) fn peek(&mut self) -> Result<Option<&Shown<'a>>, NodeError> {
        if self.next.is_none() && !self.ended {
            let message = self.messages.next().transpose().map_err(NodeError::input)?;
            self.next = message
                .filter(|message| message.log_time <= self.end)
                .map(|message| Shown {
                    topic: message.topic_index,
                    message,
                });
            self.ended = self.next.is_none();
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

/// The messages of some of a bag's topics from a time (ns) on. Chunks without any of them are not read.
pub(crate) fn chosen<'a>(bag: &'a BagReader, start: u64, topics: &[bool]) -> Messages<'a> {
    let mut topics = topics.iter();
    bag.messages_of(start, |_| topics.next() == Some(&true))
}
