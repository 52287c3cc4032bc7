//! Subscriptions, to messages and to their CDR bytes.

use std::{fmt, future::poll_fn, marker::PhantomData, ops::Deref, time::Duration};

use lgvi_msgs::{RosMessage, cdr::CdrError};

use super::wire::WireSubscription;
use crate::block::block_on_for;

/// A sample that cannot be taken. Later ones can.
#[derive(Debug, thiserror::Error)]
pub enum TakeError {
    /// The bytes are not a message of the expected type.
    #[error("{topic}: sample {} of {}: {source}", info.sequence, info.writer)]
    Decode {
        /// The topic.
        topic: String,
        /// Who sent the sample, and when.
        info: SampleInfo,
        /// What is wrong with it.
        source: Box<CdrError>,
    },
    /// A request whose client carries identities in another way than this node, so that it cannot be answered.
    #[error(
        "{service}: a request of {client} is not in the form of {ours}: RMW_IMPLEMENTATION must be the same there and here"
    )]
    Mapping {
        /// The service.
        service: String,
        /// The publisher of the request.
        client: WriterId,
        /// The `RMW_IMPLEMENTATION` of this node.
        ours: &'static str,
    },
    /// The sample is not in plain CDR, or the wire has failed.
    #[error("{topic}: {reason}")]
    Wire {
        /// The topic.
        topic: String,
        /// What the DDS stack says.
        reason: String,
    },
}

/// A received message and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample<M> {
    /// The message.
    pub message: M,
    /// Where it comes from.
    pub info: SampleInfo,
}

/// Where a sample comes from. Times are nanoseconds since the UNIX epoch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleInfo {
    /// The publisher.
    pub writer: WriterId,
    /// Counts the publisher's samples from 1; a gap is a loss.
    pub sequence: u64,
    /// When it was published, if the publisher says so.
    pub source_time: Option<i64>,
    /// When it was received, with all of its publisher's before it.
    pub received_time: i64,
    /// What it belongs to, if the publisher says so: DDS-RPC's related sample identity.
    pub related: Option<SampleId>,
}

/// The identity of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SampleId {
    /// The publisher; in what belongs to a service, the client's reader of replies may stand for it.
    pub writer: WriterId,
    /// Counts the publisher's samples from 1; -2³² is unknown.
    pub sequence: i64,
}

/// The identity of a publisher: the DDS GUID, or what stands for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WriterId(pub [u8; 16]);

impl fmt::Display for WriterId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Receives messages of one type; what else it can do is what a [`RawSubscription`] can.
pub struct Subscription<M> {
    raw: RawSubscription,
    messages: PhantomData<fn() -> M>,
}

/// Receives CDR bytes as they were sent, behind the four-byte encapsulation header that tells their byte order.
pub struct RawSubscription(Box<dyn WireSubscription>);

impl<M: RosMessage> Subscription<M> {
    pub(super) fn new(raw: RawSubscription) -> Self {
        Self {
            raw,
            messages: PhantomData,
        }
    }

    /// Takes the next message that has arrived; `None` if there is none.
    pub fn take(&self) -> Result<Option<Sample<M>>, TakeError> {
        let sample = self.raw.take()?;
        sample.map(|sample| self.decode(sample)).transpose()
    }

    /// Waits for the next message, up to `timeout`; `None` if none came.
    pub fn recv_timeout(&self, timeout: Duration) -> Result<Option<Sample<M>>, TakeError> {
        block_on_for(self.recv(), timeout).transpose()
    }

    /// Waits for the next message; safe to cancel. Call it in a loop for a stream.
    pub async fn recv(&self) -> Result<Sample<M>, TakeError> {
        self.decode(self.raw.recv().await?)
    }

    fn decode(&self, sample: Sample<Vec<u8>>) -> Result<Sample<M>, TakeError> {
        let info = sample.info;
        lgvi_msgs::cdr::decode(&sample.message)
            .map(|message| Sample { message, info })
            .map_err(|source| TakeError::Decode {
                topic: self.topic().into(),
                info,
                source: Box::new(source),
            })
    }
}

impl<M> Deref for Subscription<M> {
    type Target = RawSubscription;

    fn deref(&self) -> &RawSubscription {
        &self.raw
    }
}

impl RawSubscription {
    pub(super) fn new(wire: Box<dyn WireSubscription>) -> Self {
        Self(wire)
    }

    /// Takes the next sample that has arrived; `None` if there is none. Samples of one publisher come in order.
    pub fn take(&self) -> Result<Option<Sample<Vec<u8>>>, TakeError> {
        self.0.arrivals().take().transpose()
    }

    /// Waits for the next sample, up to `timeout`; `None` if none came.
    pub fn recv_timeout(&self, timeout: Duration) -> Result<Option<Sample<Vec<u8>>>, TakeError> {
        block_on_for(self.recv(), timeout).transpose()
    }

    /// Waits for the next sample; safe to cancel. Call it in a loop for a stream.
    pub async fn recv(&self) -> Result<Sample<Vec<u8>>, TakeError> {
        poll_fn(|context| self.0.arrivals().poll_take(context)).await
    }

    /// How many publishers of other participants are matched. Cheap.
    pub fn matched_publishers(&self) -> usize {
        self.0.endpoint().matched()
    }

    /// Blocks until so many publishers are matched or the time has passed; returns whether they are.
    pub fn wait_for_publishers(&self, count: usize, timeout: Duration) -> bool {
        self.0.endpoint().wait_for_matches(count, timeout)
    }

    /// How many samples have arrived, taken or not.
    pub fn received(&self) -> u64 {
        self.0.arrivals().received()
    }

    /// How many publishers of other participants cannot be received, by their quality of service or their type. Each is
    /// named in a warning.
    pub fn incompatible(&self) -> usize {
        self.0.endpoint().incompatible()
    }

    /// How many samples were lost after the first one of their publisher: on the way, or pushed out by newer ones
    /// because they were not taken in time.
    pub fn lost(&self) -> u64 {
        self.0.arrivals().lost()
    }

    /// The absolute topic name.
    pub fn topic(&self) -> &str {
        self.0.endpoint().topic()
    }
}
