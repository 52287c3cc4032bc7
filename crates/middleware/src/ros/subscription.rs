//! Subscriptions, to messages and to their CDR bytes.

use std::{
    fmt,
    future::poll_fn,
    marker::PhantomData,
    sync::Arc,
    task::{Context, Poll},
    time::Duration,
};

use lgvi_msgs::{RosMessage, cdr::CdrError};
use rustdds::{GUID, rpc::SampleIdentity};

use super::{graph::Side, inbox::Inbox, node::Inner};
use crate::block::block_on_for;

/// A sample that cannot be taken. Later ones can.
#[derive(Debug, thiserror::Error)]
pub enum TakeError {
    /// The bytes are not a message of the expected type.
    #[error("{topic}: sample {} of {}", info.sequence, info.writer)]
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
    /// The sample is not in plain CDR, or the DDS stack has failed.
    #[error("{topic}: {reason}")]
    Dds {
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

/// The identity of a publisher: its DDS GUID.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WriterId(pub [u8; 16]);

impl From<SampleIdentity> for SampleId {
    fn from(identity: SampleIdentity) -> Self {
        Self {
            writer: WriterId(identity.writer_guid.to_bytes()),
            sequence: identity.sequence_number.into(),
        }
    }
}

impl From<SampleId> for SampleIdentity {
    fn from(id: SampleId) -> Self {
        Self {
            writer_guid: GUID::from_bytes(id.writer.0),
            sequence_number: id.sequence.into(),
        }
    }
}

impl fmt::Display for WriterId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// Receives messages of one type.
pub struct Subscription<M> {
    raw: RawSubscription,
    messages: PhantomData<fn() -> M>,
}

/// Receives CDR bytes as they were sent, behind the four-byte encapsulation header that tells their byte order.
pub struct RawSubscription {
    inbox: Arc<Inbox>,
    node: Arc<Inner>,
}

impl<M: RosMessage> Subscription<M> {
    pub(super) fn new(raw: RawSubscription) -> Self {
        Self {
            raw,
            messages: PhantomData,
        }
    }

    /// Takes the next message that has arrived; `None` if there is none.
    pub fn take(&self) -> Result<Option<Sample<M>>, TakeError> {
        self.raw
            .take()?
            .map(|sample| self.decode(sample))
            .transpose()
    }

    /// Waits for the next message, up to `timeout`; `None` if none came.
    pub fn recv_timeout(&self, timeout: Duration) -> Result<Option<Sample<M>>, TakeError> {
        self.raw
            .recv_timeout(timeout)?
            .map(|sample| self.decode(sample))
            .transpose()
    }

    /// Waits for the next message; safe to cancel. Call it in a loop for a stream.
    pub async fn recv(&self) -> Result<Sample<M>, TakeError> {
        self.decode(self.raw.recv().await?)
    }

    /// Takes the next message, or has the task woken when one arrives.
    pub(super) fn poll_take(&self, context: &Context<'_>) -> Poll<Result<Sample<M>, TakeError>> {
        self.raw
            .poll_take(context)
            .map(|sample| self.decode(sample?))
    }

    fn decode(&self, sample: Sample<Vec<u8>>) -> Result<Sample<M>, TakeError> {
        let info = sample.info;
        lgvi_msgs::cdr::decode(&sample.message)
            .map(|message| Sample { message, info })
            .map_err(|source| TakeError::Decode {
                topic: self.raw.topic().into(),
                info,
                source: Box::new(source),
            })
    }
}

impl<M> Subscription<M> {
    /// How many publishers of other participants are matched. Cheap.
    pub fn matched_publishers(&self) -> usize {
        self.raw.matched_publishers()
    }

    /// Blocks until so many publishers are matched or the time has passed; returns whether they are.
    pub fn wait_for_publishers(&self, count: usize, timeout: Duration) -> bool {
        self.raw.wait_for_publishers(count, timeout)
    }

    /// How many samples have arrived.
    pub fn received(&self) -> u64 {
        self.raw.received()
    }

    /// How many publishers of other participants cannot be received; see [`RawSubscription::incompatible`].
    pub fn incompatible(&self) -> usize {
        self.raw.incompatible()
    }

    /// How many samples were lost; see [`RawSubscription::lost`].
    pub fn lost(&self) -> u64 {
        self.raw.lost()
    }

    /// The absolute topic name.
    pub fn topic(&self) -> &str {
        self.raw.topic()
    }
}

impl RawSubscription {
    pub(super) fn new(node: Arc<Inner>, inbox: Arc<Inbox>) -> Self {
        node.add(Side::Subscription, inbox.guid());
        node.background.add(Arc::clone(&inbox));
        Self { inbox, node }
    }

    /// Takes the next sample that has arrived; `None` if there is none. Samples of one publisher come in order.
    pub fn take(&self) -> Result<Option<Sample<Vec<u8>>>, TakeError> {
        self.inbox.take().transpose()
    }

    /// Waits for the next sample, up to `timeout`; `None` if none came.
    pub fn recv_timeout(&self, timeout: Duration) -> Result<Option<Sample<Vec<u8>>>, TakeError> {
        block_on_for(self.recv(), timeout).transpose()
    }

    /// Waits for the next sample; safe to cancel. Call it in a loop for a stream.
    pub async fn recv(&self) -> Result<Sample<Vec<u8>>, TakeError> {
        poll_fn(|context| self.poll_take(context)).await
    }

    pub(super) fn poll_take(
        &self,
        context: &Context<'_>,
    ) -> Poll<Result<Sample<Vec<u8>>, TakeError>> {
        self.inbox.poll_take(context)
    }

    pub(super) fn guid(&self) -> GUID {
        self.inbox.guid()
    }

    /// How many publishers of other participants are matched. Cheap.
    pub fn matched_publishers(&self) -> usize {
        self.node.matches.count(self.inbox.guid())
    }

    /// Blocks until so many publishers are matched or the time has passed; returns whether they are.
    pub fn wait_for_publishers(&self, count: usize, timeout: Duration) -> bool {
        self.node.matches.wait(self.inbox.guid(), count, timeout)
    }

    /// How many samples have arrived, taken or not.
    pub fn received(&self) -> u64 {
        self.inbox.received()
    }

    /// How many publishers of other participants cannot be received, by their quality of service or their type. Each is
    /// named in a warning.
    pub fn incompatible(&self) -> usize {
        self.node.faults.count(self.inbox.guid())
    }

    /// How many samples were lost after the first one of their publisher: on the way, or pushed out by newer ones
    /// because they were not taken in time.
    pub fn lost(&self) -> u64 {
        self.inbox.lost()
    }

    /// The absolute topic name.
    pub fn topic(&self) -> &str {
        self.inbox.topic()
    }
}

impl Drop for RawSubscription {
    fn drop(&mut self) {
        self.node.background.remove(&self.inbox);
        self.node.remove(Side::Subscription, self.inbox.guid());
    }
}

impl fmt::Debug for RawSubscription {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("RawSubscription").field(&self.inbox).finish()
    }
}

impl<M> fmt::Debug for Subscription<M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Subscription").field(&self.raw).finish()
    }
}

#[cfg(test)]
mod tests {
    use std::{process, thread, time::Instant};

    use lgvi_msgs::std_msgs::String as Text;

    use crate::{
        Environment, NodeArgs,
        ros::{Qos, RosNode},
    };

    const PATIENCE: std::time::Duration = std::time::Duration::from_secs(20);

    #[test]
    fn what_is_remembered_of_a_publisher_goes_with_it() {
        let environment = Environment::localhost(1 + (process::id() % 101) as u16);
        let node = |name: String| {
            let (args, _) = NodeArgs::parse(&name, []).unwrap();
            RosNode::new(&args, &environment).unwrap()
        };
        let hearer = node(format!("hearer_{}", process::id()));
        let subscription =
            hearer.raw_subscription("/said", "std_msgs/msg/String", &Qos::reliable(1));
        let subscription = subscription.unwrap();
        let speaker = node(format!("speaker_{}", process::id()));
        let publisher = speaker.publisher("/said", &Qos::reliable(1)).unwrap();
        assert!(subscription.wait_for_publishers(1, PATIENCE));
        publisher.publish(&Text::default()).unwrap();
        let sample = subscription.recv_timeout(PATIENCE).unwrap().unwrap();
        let writer = rustdds::GUID::from_bytes(sample.info.writer.0);
        let laggards = &hearer.inner().laggards;
        laggards.suspect(writer);
        assert!(subscription.inbox.publishers().contains(&writer));
        drop((publisher, speaker));
        let start = Instant::now();
        while subscription.inbox.publishers().contains(&writer) || laggards.suspects(writer) {
            assert!(start.elapsed() < PATIENCE, "it is still remembered");
            thread::yield_now();
        }
    }
}
