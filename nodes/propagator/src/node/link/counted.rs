//! Publishers that count, and what `/diagnostics` has of them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{
    Diagnosed, Diagnostics, Level, PublishError, Publisher, Qos, RosNode, Status,
};
use lgvi_msgs::RosMessage;
use tracing::warn;

use super::settling::Outgoing;
use crate::node::config::PATIENCE;

/// How long is waited for acknowledgments when their time has passed: another topic may have had all of it.
const LAST_LOOK: Duration = Duration::from_millis(1);

/// A publisher with what it has sent.
pub(super) struct Counted<M> {
    publisher: Publisher<M>,
    /// Whether no message may be lost; that may change in flight.
    lossless: Arc<AtomicBool>,
    counts: Arc<Counts>,
}

/// What has become of a topic's messages.
pub(crate) struct Counts {
    topic: String,
    subscribers: AtomicUsize,
    /// Messages that were made from states, and those of them that were sent.
    converted: AtomicU64,
    sent: AtomicU64,
}

impl<M: RosMessage + Send + Sync + 'static> Counted<M> {
    pub(super) fn new(
        ros: &RosNode,
        topic: &str,
        qos: &Qos,
        lossless: &Arc<AtomicBool>,
    ) -> Result<Self, NodeError> {
        let publisher = ros.publisher(topic, qos)?;
        Ok(Self {
            counts: Arc::new(Counts {
                topic: publisher.topic().to_owned(),
                subscribers: AtomicUsize::new(0),
                converted: AtomicU64::new(0),
                sent: AtomicU64::new(0),
            }),
            publisher,
            lossless: Arc::clone(lossless),
        })
    }

    /// Whether anybody has subscribed: nothing is converted for nobody.
    pub(super) fn wanted(&self) -> bool {
        self.subscribers() > 0
    }

    pub(super) fn subscribers(&self) -> usize {
        let subscribers = self.publisher.matched_subscriptions();
        self.counts
            .subscribers
            .store(subscribers, Ordering::Relaxed);
        subscribers
    }

    pub(super) fn send(&self, message: &M) {
        self.counts.converted.fetch_add(1, Ordering::Relaxed);
        let sent: Result<(), PublishError> = if self.lossless.load(Ordering::Relaxed) {
            self.publisher.publish_lossless(message, PATIENCE)
        } else {
            self.publisher.publish(message)
        };
        match sent {
            Ok(()) => {
                self.counts.sent.fetch_add(1, Ordering::Relaxed);
            }
            Err(error) => warn!("{error}"),
        }
    }

    pub(super) fn counts(&self) -> Arc<Counts> {
        Arc::clone(&self.counts)
    }
}

impl<M: RosMessage + Send + Sync + 'static> Outgoing for Counted<M> {
    fn patience(&self, patience: Duration) -> Duration {
        self.publisher.patience(patience)
    }

    fn acknowledged_within(&self, wait: Duration) -> bool {
        self.publisher.acknowledged_within(wait)
    }

    fn give_up(&self) {
        if let Err(error) = self.publisher.flush(LAST_LOOK) {
            warn!("{error}");
        }
    }

    fn published(&self) -> (String, u64) {
        let sent = self.counts.sent.load(Ordering::Relaxed);
        (self.counts.topic.clone(), sent)
    }
}

/// Has the topics on `/diagnostics`.
pub(super) fn diagnose(counts: Vec<Arc<Counts>>, diagnostics: &Diagnostics) -> Diagnosed {
    let mut reported = 0;
    diagnostics.add("topics", move || status(&counts, &mut reported))
}

/// `reported` is how many messages were lost when this was last asked.
fn status(counts: &[Arc<Counts>], reported: &mut u64) -> Status {
    let mut lost = 0;
    let status = counts
        .iter()
        .fold(Status::ok("as subscribed"), |status, counts| {
            let [converted, sent] =
                [&counts.converted, &counts.sent].map(|count| count.load(Ordering::Relaxed));
            let subscribers = counts.subscribers.load(Ordering::Relaxed);
            lost += converted.saturating_sub(sent);
            let topic = &counts.topic;
            status
                .value(format!("{topic} subscribers"), subscribers)
                .value(format!("{topic} converted"), converted)
                .value(format!("{topic} sent"), sent)
        });
    let before = std::mem::replace(reported, lost);
    status.value("messages lost", lost).when(
        lost > before,
        Level::Warn,
        "subscribers did not keep up",
    )
}
