//! Publishers, of messages and of ready CDR bytes.

use std::{marker::PhantomData, ops::Deref, time::Duration};

use lgvi_msgs::{RosMessage, cdr::CdrError};

use super::{
    SampleId,
    wire::{LITTLE_ENDIAN, WirePublisher},
};

/// A message that was not published, or not received by all.
#[derive(Debug, thiserror::Error)]
pub enum PublishError {
    /// Too many samples are unsent or unacknowledged, and no room could be made. The message is dropped.
    #[error("{topic}: no room; dropped a message after {waited:?}, {dropped} so far")]
    Full {
        /// The topic.
        topic: String,
        /// How long room was waited for.
        waited: Duration,
        /// Messages this publisher has dropped.
        dropped: u64,
    },
    /// Not all reliable subscriptions have acknowledged all messages.
    #[error("{topic}: messages are still unacknowledged after {waited:?}")]
    Unacknowledged {
        /// The topic.
        topic: String,
        /// How long was waited.
        waited: Duration,
    },
    /// The message cannot be encoded.
    #[error(transparent)]
    Encode(#[from] CdrError),
    /// Ready bytes do not start with the header of little-endian plain CDR.
    #[error("{topic}: CDR starts with {found:02x?}; expected 00 01 and two bytes of options")]
    Encapsulation {
        /// The topic.
        topic: String,
        /// The first four bytes, or fewer if there are fewer.
        found: Vec<u8>,
    },
    /// A request or a reply that the wire would garble; see the limitations of services.
    #[error(
        "{topic}: {length} bytes with an identity; at most {limit} can be sent to the present peers"
    )]
    TooLong {
        /// The service.
        topic: String,
        /// How long the message is, encapsulation header included.
        length: usize,
        /// How long it may be.
        limit: usize,
    },
    /// The wire has failed.
    #[error("{topic}: {reason}")]
    Wire {
        /// The topic.
        topic: String,
        /// What it says.
        reason: String,
    },
}

/// Publishes messages of one type; what else it can do is what a [`RawPublisher`] can.
pub struct Publisher<M> {
    raw: RawPublisher,
    messages: PhantomData<fn(&M)>,
}

/// Publishes ready CDR bytes.
///
/// Dropping it waits for acknowledgments up to 0.1 s, and until 0.1 s after the last message, unless nobody listens:
/// [`flush`](Self::flush) before, if more time may be needed. Once the process is to end, all waits of a node's
/// publishers share 0.3 s; see [`RosNode::leave_on`](super::RosNode::leave_on).
pub struct RawPublisher(Box<dyn WirePublisher>);

/// The number of the sample after so many: samples count from 1, and what is not sent has no number.
pub(super) fn next(sent: u64) -> i64 {
    i64::try_from(sent).unwrap_or(i64::MAX).saturating_add(1)
}

impl<M: RosMessage> Publisher<M> {
    pub(super) fn new(raw: RawPublisher) -> Self {
        Self {
            raw,
            messages: PhantomData,
        }
    }

    /// Publishes a message; see [`RawPublisher::publish`].
    pub fn publish(&self, message: &M) -> Result<(), PublishError> {
        self.raw.publish(lgvi_msgs::cdr::encode(message)?)
    }

    /// Publishes a message, waiting for room; see [`RawPublisher::publish_lossless`].
    pub fn publish_lossless(&self, message: &M, patience: Duration) -> Result<(), PublishError> {
        self.raw
            .publish_lossless(lgvi_msgs::cdr::encode(message)?, patience)
    }
}

impl<M> Deref for Publisher<M> {
    type Target = RawPublisher;

    fn deref(&self) -> &RawPublisher {
        &self.raw
    }
}

impl RawPublisher {
    pub(super) fn new(wire: Box<dyn WirePublisher>) -> Self {
        Self(wire)
    }

    /// Publishes CDR bytes that start with the four-byte encapsulation header of little-endian plain CDR.
    ///
    /// Waits at most [`Qos::max_wait`](super::Qos::max_wait) for room, and never with [`Qos::sensor`](super::Qos::sensor). After a wait in vain, what the
    /// subscriptions that do not keep up have not yet received is overwritten, but for the later half of the window; that
    /// takes up to 20 ms for each that is tried. A participant that has not kept up once is waited for only 20 ms from
    /// then on, once in half a window, by all publishers of the node, until it does keep up. The first message after a
    /// match waits for its acknowledgment too, up to the same limit and at most a second.
    pub fn publish(&self, cdr: Vec<u8>) -> Result<(), PublishError> {
        self.0.publish(self.checked(cdr)?, None)
    }

    /// Publishes CDR bytes, waiting up to `patience` for room, by the rules of [`publish`](Self::publish).
    ///
    /// No message is lost on the way to a reliable subscription that does not hang for longer, and whose depth covers what
    /// it has yet to take.
    pub fn publish_lossless(&self, cdr: Vec<u8>, patience: Duration) -> Result<(), PublishError> {
        self.0.publish(self.checked(cdr)?, Some(patience))
    }

    /// Blocks until every matched reliable subscription has acknowledged every message, up to `patience`; up to 0.1 s if
    /// one of their participants has not kept up before, or an earlier flush of the node was in vain.
    pub fn flush(&self, patience: Duration) -> Result<(), PublishError> {
        self.0.flush(patience)
    }

    /// Whether every matched reliable subscription has acknowledged every message, or does so within `wait`. Blames none.
    pub fn acknowledged_within(&self, wait: Duration) -> bool {
        self.0.acknowledged_within(wait)
    }

    /// How long [`flush`](Self::flush) waits at most for the acknowledgments: hardly, if they are not to be expected from
    /// all.
    pub fn patience(&self, patience: Duration) -> Duration {
        self.0.patience(patience)
    }

    /// How many subscriptions of other participants are matched. Cheap.
    pub fn matched_subscriptions(&self) -> usize {
        self.0.endpoint().matched()
    }

    /// Blocks until so many subscriptions are matched or the time has passed; returns whether they are.
    pub fn wait_for_subscriptions(&self, count: usize, timeout: Duration) -> bool {
        self.0.endpoint().wait_for_matches(count, timeout)
    }

    /// The identity that subscriptions will find with the next message, if it is published and no other thread comes
    /// before; after a failure, the message after that has it.
    pub fn next_sample(&self) -> SampleId {
        SampleId {
            writer: self.0.id(),
            sequence: next(self.sent()),
        }
    }

    /// How many messages were published.
    pub fn sent(&self) -> u64 {
        self.0.sent()
    }

    /// How many subscriptions of other participants cannot be served, by their quality of service or their type. Each
    /// is named in a warning.
    pub fn incompatible(&self) -> usize {
        self.0.endpoint().incompatible()
    }

    /// How many messages were dropped for want of room.
    pub fn dropped(&self) -> u64 {
        self.0.dropped()
    }

    /// The absolute topic name.
    pub fn topic(&self) -> &str {
        self.0.endpoint().topic()
    }

    fn checked(&self, cdr: Vec<u8>) -> Result<Vec<u8>, PublishError> {
        if cdr.starts_with(&LITTLE_ENDIAN[..2]) && cdr.len() >= LITTLE_ENDIAN.len() {
            return Ok(cdr);
        }
        Err(PublishError::Encapsulation {
            topic: self.topic().to_owned(),
            found: cdr.into_iter().take(LITTLE_ENDIAN.len()).collect(),
        })
    }
}
