//! Subscriptions on Zenoh.

use std::{
    sync::Arc,
    task::{Context, Poll},
    time::Duration,
};

use ::zenoh::{Wait, pubsub::Subscriber};
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, HistoryConfig, RecoveryConfig};

use super::{Announced, Connection, attachment::Attachment, keys::Endpoint, text};
use crate::{
    ros::{Sample, SampleInfo, TakeError, WriterId, arrivals::Arrivals, wire::WireSubscription},
    wall,
};

/// As long as it takes: a publisher that does not answer with its past is no reason to go without that of others.
const QUERY: Duration = Duration::from_secs(600);

/// A subscription. A reliable one asks publishers for what they keep, whatever durability it requests: so it misses
/// nothing that is sent while the two find each other, as over DDS.
pub(super) struct Subscription {
    arrivals: Arc<Arrivals>,
    _subscriber: Declared,
    announced: Announced,
}

enum Declared {
    Plain { _subscriber: Subscriber<()> },
    Reliable { _subscriber: AdvancedSubscriber<()> },
}

impl Subscription {
    pub(super) fn new(node: &Arc<Connection>, endpoint: Endpoint) -> Result<Self, String> {
        let offer = endpoint.offer;
        let arrivals = Arc::new(Arrivals::new(offer.depth));
        let kept = Arc::clone(&arrivals);
        let subscriber = node
            .session
            .declare_subscriber(endpoint.key(node.node.domain_id))
            .callback(move |sample| kept.put(Ok(taken(&sample, kept.received() + 1))));
        let declared = if offer.reliable {
            let history = HistoryConfig::default()
                .detect_late_publishers()
                .max_samples(offer.depth);
            let reliable = subscriber
                .history(history)
                .query_timeout(QUERY)
                .subscriber_detection()
                .recovery(RecoveryConfig::default().heartbeat());
            Declared::Reliable {
                _subscriber: reliable.wait().map_err(text)?,
            }
        } else {
            Declared::Plain {
                _subscriber: subscriber.wait().map_err(text)?,
            }
        };
        Ok(Self {
            announced: Announced::new(node, endpoint)?,
            arrivals,
            _subscriber: declared,
        })
    }
}

/// A sample without an attachment is that of a publisher which is no node of ROS 2; `count` numbers it.
fn taken(sample: &::zenoh::sample::Sample, count: u64) -> Sample<Vec<u8>> {
    let attachment = Attachment::read(sample.attachment());
    Sample {
        message: sample.payload().to_bytes().into_owned(),
        info: SampleInfo {
            writer: attachment.map_or(WriterId([0; 16]), |attachment| attachment.writer()),
            sequence: attachment.map_or(count, |attachment| attachment.sequence.unsigned_abs()),
            source_time: attachment.map(|attachment| attachment.time),
            received_time: wall::now(),
            related: None,
        },
    }
}

impl WireSubscription for Subscription {
    fn take(&self) -> Result<Option<Sample<Vec<u8>>>, TakeError> {
        self.arrivals.take().transpose()
    }

    fn poll_take(&self, context: &Context<'_>) -> Poll<Result<Sample<Vec<u8>>, TakeError>> {
        self.arrivals.poll_take(context)
    }

    fn matched(&self) -> usize {
        self.announced.matched()
    }

    fn wait_for_matches(&self, count: usize, timeout: Duration) -> bool {
        self.announced.wait_for_matches(count, timeout)
    }

    fn incompatible(&self) -> usize {
        self.announced.incompatible()
    }

    fn received(&self) -> u64 {
        self.arrivals.received()
    }

    fn lost(&self) -> u64 {
        self.arrivals.lost()
    }

    fn topic(&self) -> &str {
        self.announced.name()
    }
}
