//! Publishers on DDS writers.

use std::{
    fmt,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use rustdds::{
    GUID, RTPSEntity, Timestamp, WriteOptionsBuilder, bytes::Bytes, dds::result::WriteResult,
    no_key::DataWriter,
};

use super::{cdr::CdrBytes, graph::Side, local::Local, participant::Participant, policies};
use crate::{
    ros::{
        PublishError, Qos, RosError, SampleId, WriterId,
        wire::{LITTLE_ENDIAN, WireEndpoint, WirePublisher},
    },
    sync::lock,
};

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

/// A DDS writer and its window.
pub(super) struct Writer {
    pub(super) local: Local,
    pub(super) writer: DataWriter<Bytes, CdrBytes>,
    /// How many samples fit between the oldest one that is not acknowledged and the latest.
    pub(super) window: usize,
    limit: Duration,
    introduced: AtomicUsize,
    /// Whether the latest message found no room.
    pub(super) stalled: AtomicBool,
    pub(super) sent: AtomicU64,
    pub(super) dropped: AtomicU64,
    latest: Mutex<Option<Instant>>,
}

impl Writer {
    pub(super) fn new(
        node: &Arc<Participant>,
        topic: &str,
        dds_topic: String,
        type_name: &str,
        qos: &Qos,
    ) -> Result<Self, RosError> {
        let writer = node.endpoint(topic, dds_topic, type_name, |publisher, _, topic| {
            publisher.create_datawriter_no_key(topic, Some(policies::offered(qos)))
        })?;
        Ok(Self {
            local: Local::new(node, Side::Publisher, writer.guid(), topic, type_name),
            writer,
            window: qos.window(),
            limit: qos.publish_limit(),
            introduced: AtomicUsize::new(0),
            stalled: AtomicBool::new(false),
            sent: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
            latest: Mutex::new(None),
        })
    }

    /// Publishes what belongs to another sample, by the rules of [`publish`](Self::publish).
    pub(super) fn publish_related(
        &self,
        cdr: Vec<u8>,
        related: Option<SampleId>,
    ) -> Result<SampleId, PublishError> {
        let length = cdr.len();
        if related.is_some() && length > MAX_RELATED && length > self.max_related() {
            return Err(PublishError::TooLong {
                topic: self.local.topic.clone(),
                length,
                limit: self.max_related(),
            });
        }
        self.write(cdr, self.limit, related)
    }

    /// The most bytes of what belongs to another sample.
    pub(super) fn max_related(&self) -> usize {
        if self.node().reaches_loopback_only(self.guid()) {
            MAX_RELATED_ON_LOOPBACK
        } else {
            MAX_RELATED
        }
    }

    pub(super) fn guid(&self) -> GUID {
        self.local.guid
    }

    pub(super) fn node(&self) -> &Participant {
        &self.local.node
    }

    fn write(
        &self,
        mut cdr: Vec<u8>,
        limit: Duration,
        related: Option<SampleId>,
    ) -> Result<SampleId, PublishError> {
        if self.node().laggards.is_secured() {
            pad(&mut cdr);
        }
        let payload = Bytes::from(cdr).slice(LITTLE_ENDIAN.len()..);
        let limit = if self.stalled.load(Ordering::Relaxed) {
            Duration::ZERO
        } else {
            limit
        };
        self.note_recovery();
        let matched = self.local.matched();
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
        *lock(&self.latest) = Some(Instant::now());
        if introduce {
            // Whether all have acknowledged: what follows is sent in any case.
            let acquaintance = self.patience(limit.min(ACQUAINTANCE));
            let _ = self.acknowledged(acquaintance);
        }
        Ok(identity.into())
    }

    /// Ends what is done for subscriptions that did not keep up, once all have received everything.
    fn note_recovery(&self) {
        let (writer, laggards) = (self.guid(), &self.node().laggards);
        if laggards.has_gaps(writer)
            && matches!(
                self.writer.wait_for_acknowledgments(Duration::ZERO),
                Ok(true)
            )
        {
            laggards.close_gaps(writer);
            for reader in self.node().matches.of(writer) {
                laggards.pardon(reader);
            }
        }
    }

    /// Waits until all is acknowledged; returns whether it is.
    fn acknowledged(&self, patience: Duration) -> WriteResult<bool, ()> {
        let acknowledged = self.node().farewell.wait(patience, |slice| {
            match self.writer.wait_for_acknowledgments(slice) {
                Ok(false) => None,
                ended => Some(ended),
            }
        });
        acknowledged.unwrap_or(Ok(false))
    }

    pub(super) fn dds_error(&self, error: &impl fmt::Display) -> PublishError {
        PublishError::Wire {
            topic: self.local.topic.clone(),
            reason: error.to_string(),
        }
    }
}

impl WirePublisher for Writer {
    fn endpoint(&self) -> &dyn WireEndpoint {
        &self.local
    }

    fn publish(&self, cdr: Vec<u8>, patience: Option<Duration>) -> Result<(), PublishError> {
        self.write(cdr, patience.unwrap_or(self.limit), None)
            .map(drop)
    }

    fn flush(&self, patience: Duration) -> Result<(), PublishError> {
        let start = Instant::now();
        match self.acknowledged(self.patience(patience)) {
            Ok(true) => Ok(()),
            Ok(false) => {
                for reader in self.node().reliable_readers(self.guid()) {
                    self.node().laggards.suspect(reader.guid);
                }
                Err(PublishError::Unacknowledged {
                    topic: self.local.topic.clone(),
                    waited: start.elapsed(),
                })
            }
            Err(error) => Err(self.dds_error(&error)),
        }
    }

    fn acknowledged_within(&self, wait: Duration) -> bool {
        matches!(self.acknowledged(wait), Ok(true))
    }

    fn patience(&self, patience: Duration) -> Duration {
        let matched = self.node().matches.of(self.guid());
        if self.node().laggards.suspects_any(&matched) {
            patience.min(FAREWELL)
        } else {
            patience
        }
    }

    fn sent(&self) -> u64 {
        self.sent.load(Ordering::Relaxed)
    }

    fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    fn id(&self) -> WriterId {
        WriterId(self.guid().to_bytes())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        let latest = *lock(&self.latest);
        if let Some(latest) = latest
            && self.local.matched() > 0
            && !self.stalled.load(Ordering::Relaxed)
        {
            // Whether all have acknowledged: it leaves in any case.
            let _ = self.flush(FAREWELL);
            let farewell = &self.node().farewell;
            farewell.pause(FAREWELL.saturating_sub(latest.elapsed()));
        }
        self.node().laggards.close_gaps(self.guid());
    }
}

/// Fills CDR to a multiple of four bytes, as DATA is anyway (RTPS 2.5, 9.4.1).
///
/// RustDDS 0.15 looks for the end of what is encrypted at the end of DATA, and refuses what was filled there.
fn pad(cdr: &mut Vec<u8>) {
    cdr.resize(cdr.len().next_multiple_of(4), 0);
}
