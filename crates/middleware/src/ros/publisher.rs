//! Publishers, of messages and of ready CDR bytes.

use std::{
    fmt,
    marker::PhantomData,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use lgvi_msgs::{RosMessage, cdr::CdrError};
use rustdds::{
    GUID, RTPSEntity, Timestamp, WriteOptionsBuilder, bytes::Bytes, dds::result::WriteResult,
    no_key::DataWriter,
};

use super::{
    cdr::{CdrBytes, LITTLE_ENDIAN},
    graph::Side,
    node::Inner,
    qos::Qos,
    subscription::SampleId,
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
    /// A request or a reply that RustDDS would garble; see the limitations of services.
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
    /// The DDS stack has failed.
    #[error("{topic}: {reason}")]
    Dds {
        /// The topic.
        topic: String,
        /// What it says.
        reason: String,
    },
}

/// How long what was published last has before its publisher leaves.
///
/// A RustDDS 0.15 subscription acknowledges what it has received, and forgets what nobody has taken from it yet when
/// the publisher leaves. Those of this crate take at once, which is after a few milliseconds at the end of a burst.
const FAREWELL: Duration = Duration::from_millis(100);

/// How long RustDDS has for the first heartbeat to a subscription that it has just reported as matched.
///
/// Cyclone DDS gives to a volatile reader only what follows the first heartbeat that the reader sees. RustDDS announces
/// in a heartbeat all that has been written, so that what is not yet on its way by then would never be delivered.
/// Hence the first message after a match comes after that heartbeat, and the others after its acknowledgment.
const INTRODUCTION: Duration = Duration::from_millis(2);

/// How long that acknowledgment is waited for at most; some subscriptions never send one.
const ACQUAINTANCE: Duration = Duration::from_secs(1);

/// The most bytes that RustDDS sends unfragmented to any peer: 1452 less a heartbeat and the head of the submessage.
///
/// In a fragment RustDDS 0.15.1 writes the related sample identity a byte too late, behind the tag of an `Option`, so that
/// nobody understands it; with debug assertions its thread panics.
const MAX_RELATED: usize = 1452 - 32 - 48;

/// The same to peers that are on the loopback interface alone, whose datagrams may have 65 507 bytes (Linux) or 16 384.
const MAX_RELATED_ON_LOOPBACK: usize = if cfg!(target_os = "linux") {
    60_000
} else {
    16_000
};

/// Publishes messages of one type. Dropping it takes up to 0.2 s if it has just published; see [`RawPublisher`].
pub struct Publisher<M> {
    raw: RawPublisher,
    messages: PhantomData<fn(&M)>,
}

/// Publishes ready CDR bytes.
///
/// Dropping it waits for acknowledgments up to 0.1 s, and until 0.1 s after the last message, unless nobody listens:
/// [`flush`](Self::flush) before, if more time may be needed. Once the process is to end, all waits of a node's
/// publishers share 0.3 s; see [`RosNode::leave_on`](super::RosNode::leave_on).
pub struct RawPublisher {
    pub(super) writer: DataWriter<Bytes, CdrBytes>,
    pub(super) topic: String,
    /// How many samples fit between the oldest one that is not acknowledged and the latest.
    pub(super) window: usize,
    limit: Duration,
    introduced: AtomicUsize,
    /// Whether the latest message found no room.
    pub(super) stalled: AtomicBool,
    pub(super) sent: AtomicU64,
    pub(super) dropped: AtomicU64,
    latest: Mutex<Option<Instant>>,
    pub(super) node: Arc<Inner>,
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

impl<M> Publisher<M> {
    /// Waits for acknowledgments; see [`RawPublisher::flush`].
    pub fn flush(&self, patience: Duration) -> Result<(), PublishError> {
        self.raw.flush(patience)
    }

    /// See [`RawPublisher::acknowledged_within`].
    pub fn acknowledged_within(&self, wait: Duration) -> bool {
        self.raw.acknowledged_within(wait)
    }

    /// See [`RawPublisher::patience`].
    pub fn patience(&self, patience: Duration) -> Duration {
        self.raw.patience(patience)
    }

    /// How many subscriptions of other participants are matched. Cheap.
    pub fn matched_subscriptions(&self) -> usize {
        self.raw.matched_subscriptions()
    }

    /// Blocks until so many subscriptions are matched or the time has passed; returns whether they are.
    pub fn wait_for_subscriptions(&self, count: usize, timeout: Duration) -> bool {
        self.raw.wait_for_subscriptions(count, timeout)
    }

    /// How many messages were published.
    pub fn sent(&self) -> u64 {
        self.raw.sent()
    }

    /// How many messages were dropped for want of room.
    pub fn dropped(&self) -> u64 {
        self.raw.dropped()
    }

    /// How many subscriptions of other participants cannot be served; see [`RawPublisher::incompatible`].
    pub fn incompatible(&self) -> usize {
        self.raw.incompatible()
    }

    /// The absolute topic name.
    pub fn topic(&self) -> &str {
        self.raw.topic()
    }
}

impl RawPublisher {
    pub(super) fn new(
        node: Arc<Inner>,
        topic: String,
        writer: DataWriter<Bytes, CdrBytes>,
        qos: &Qos,
    ) -> Self {
        node.add(Side::Publisher, writer.guid());
        Self {
            writer,
            topic,
            window: qos.window(),
            limit: qos.publish_limit(),
            introduced: AtomicUsize::new(0),
            stalled: AtomicBool::new(false),
            sent: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
            latest: Mutex::new(None),
            node,
        }
    }

    /// Publishes CDR bytes that start with the four-byte encapsulation header of little-endian plain CDR.
    ///
    /// Waits at most [`Qos::max_wait`] for room, and never with [`Qos::sensor`]. After a wait in vain, what the
    /// subscriptions that do not keep up have not yet received is overwritten, but for the later half of the window; that
    /// takes up to 20 ms for each that is tried. A participant that has not kept up once is waited for only 20 ms from
    /// then on, once in half a window, by all publishers of the node, until it does keep up. The first message after a
    /// match waits for its acknowledgment too, up to the same limit and at most a second.
    pub fn publish(&self, cdr: Vec<u8>) -> Result<(), PublishError> {
        self.write(cdr, self.limit, None).map(drop)
    }

    /// Publishes CDR bytes, waiting up to `patience` for room, by the rules of [`publish`](Self::publish).
    ///
    /// No message is lost on the way to a reliable subscription that does not hang for longer, and whose depth covers what
    /// it has yet to take.
    pub fn publish_lossless(&self, cdr: Vec<u8>, patience: Duration) -> Result<(), PublishError> {
        self.write(cdr, patience, None).map(drop)
    }

    /// Blocks until every matched reliable subscription has acknowledged every message, up to `patience`; up to 0.1 s if
    /// one of their participants has not kept up before, or an earlier flush of the node was in vain.
    pub fn flush(&self, patience: Duration) -> Result<(), PublishError> {
        let start = Instant::now();
        match self.acknowledged(self.patience(patience)) {
            Ok(true) => Ok(()),
            Ok(false) => {
                for reader in self.node.reliable_readers(self.writer.guid()) {
                    self.node.laggards.suspect(reader.guid);
                }
                Err(PublishError::Unacknowledged {
                    topic: self.topic.clone(),
                    waited: start.elapsed(),
                })
            }
            Err(error) => Err(self.dds_error(&error)),
        }
    }

    /// How many subscriptions of other participants are matched. Cheap.
    pub fn matched_subscriptions(&self) -> usize {
        self.node.matches.count(self.writer.guid())
    }

    /// Blocks until so many subscriptions are matched or the time has passed; returns whether they are.
    pub fn wait_for_subscriptions(&self, count: usize, timeout: Duration) -> bool {
        self.node.matches.wait(self.writer.guid(), count, timeout)
    }

    /// How many messages were published.
    pub fn sent(&self) -> u64 {
        self.sent.load(Ordering::Relaxed)
    }

    /// How many subscriptions of other participants cannot be served, by their quality of service or their type. Each
    /// is named in a warning.
    pub fn incompatible(&self) -> usize {
        self.node.faults.count(self.writer.guid())
    }

    /// How many messages were dropped for want of room.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// The absolute topic name.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Publishes what belongs to another sample, by the rules of [`publish`](Self::publish).
    pub(super) fn publish_related(
        &self,
        cdr: Vec<u8>,
        related: Option<SampleId>,
    ) -> Result<SampleId, PublishError> {
        if related.is_some() && cdr.len() > MAX_RELATED {
            let (topic, length, limit) = (self.topic.clone(), cdr.len(), self.max_related());
            if length > limit {
                return Err(PublishError::TooLong {
                    topic,
                    length,
                    limit,
                });
            }
        }
        self.write(cdr, self.limit, related)
    }

    /// The most bytes of what belongs to another sample.
    pub(super) fn max_related(&self) -> usize {
        if self.node.reaches_loopback_only(self.writer.guid()) {
            MAX_RELATED_ON_LOOPBACK
        } else {
            MAX_RELATED
        }
    }

    pub(super) fn guid(&self) -> GUID {
        self.writer.guid()
    }

    fn write(
        &self,
        mut cdr: Vec<u8>,
        limit: Duration,
        related: Option<SampleId>,
    ) -> Result<SampleId, PublishError> {
        if !cdr.starts_with(&LITTLE_ENDIAN[..2]) || cdr.len() < LITTLE_ENDIAN.len() {
            return Err(PublishError::Encapsulation {
                topic: self.topic.clone(),
                found: cdr.into_iter().take(LITTLE_ENDIAN.len()).collect(),
            });
        }
        if self.node.laggards.is_secured() {
            pad(&mut cdr);
        }
        let payload = Bytes::from(cdr).slice(LITTLE_ENDIAN.len()..);
        let limit = if self.stalled.load(Ordering::Relaxed) {
            Duration::ZERO
        } else {
            limit
        };
        self.note_recovery();
        let matched = self.matched_subscriptions();
        let introduce = self.introduced.swap(matched, Ordering::Relaxed) < matched;
        if introduce {
            thread::sleep(INTRODUCTION.min(limit));
        }
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity_opt(related.map(Into::into))
            .build();
        let identity = self.admit(&payload, &options, limit)?;
        self.sent.fetch_add(1, Ordering::Relaxed);
        *self.latest() = Some(Instant::now());
        if introduce {
            // Whether all have acknowledged: what follows is sent in any case.
            let acquaintance = self.patience(limit.min(ACQUAINTANCE));
            let _ = self.acknowledged(acquaintance);
        }
        Ok(identity.into())
    }

    /// Ends what is done for subscriptions that did not keep up, once all have received everything.
    fn note_recovery(&self) {
        let (writer, laggards) = (self.writer.guid(), &self.node.laggards);
        if laggards.has_gaps(writer)
            && matches!(
                self.writer.wait_for_acknowledgments(Duration::ZERO),
                Ok(true)
            )
        {
            laggards.close_gaps(writer);
            for reader in self.node.matches.of(writer) {
                laggards.pardon(reader);
            }
        }
    }

    /// Waits until all is acknowledged; returns whether it is.
    fn acknowledged(&self, patience: Duration) -> WriteResult<bool, ()> {
        let acknowledged = self.node.farewell.wait(patience, |slice| {
            match self.writer.wait_for_acknowledgments(slice) {
                Ok(false) => None,
                ended => Some(ended),
            }
        });
        acknowledged.unwrap_or(Ok(false))
    }

    /// Whether every matched reliable subscription has acknowledged every message, or does so within `wait`. Blames none.
    pub fn acknowledged_within(&self, wait: Duration) -> bool {
        matches!(self.acknowledged(wait), Ok(true))
    }

    /// How long [`flush`](Self::flush) waits at most for the acknowledgments: hardly, if they are not to be expected from
    /// all.
    pub fn patience(&self, patience: Duration) -> Duration {
        let matched = self.node.matches.of(self.writer.guid());
        if self.node.laggards.suspects_any(&matched) {
            patience.min(FAREWELL)
        } else {
            patience
        }
    }

    fn latest(&self) -> MutexGuard<'_, Option<Instant>> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn dds_error(&self, error: &impl fmt::Display) -> PublishError {
        PublishError::Dds {
            topic: self.topic.clone(),
            reason: error.to_string(),
        }
    }
}

impl Drop for RawPublisher {
    fn drop(&mut self) {
        let latest = *self.latest();
        if let Some(latest) = latest
            && self.matched_subscriptions() > 0
            && !self.stalled.load(Ordering::Relaxed)
        {
            // Whether all have acknowledged: it leaves in any case.
            let _ = self.flush(FAREWELL);
            let farewell = &self.node.farewell;
            farewell.pause(FAREWELL.saturating_sub(latest.elapsed()));
        }
        self.node.laggards.close_gaps(self.writer.guid());
        self.node.remove(Side::Publisher, self.writer.guid());
    }
}

impl fmt::Debug for RawPublisher {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("RawPublisher")
            .field("topic", &self.topic)
            .field("dropped", &self.dropped())
            .finish_non_exhaustive()
    }
}

impl<M> fmt::Debug for Publisher<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Publisher").field(&self.raw).finish()
    }
}

/// Fills CDR to a multiple of four bytes, as DATA is anyway (RTPS 2.5, 9.4.1).
///
/// RustDDS 0.15 looks for the end of what is encrypted at the end of DATA, and refuses what was filled there.
fn pad(cdr: &mut Vec<u8>) {
    cdr.resize(cdr.len().next_multiple_of(4), 0);
}
