//! Publishers on Zenoh.

use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use ::zenoh::{Wait, qos::CongestionControl};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

use super::{Announced, Connection, attachment::Attachment, keys::Endpoint, reliability, text};
use crate::{
    ros::{
        PublishError, WriterId,
        publisher::next,
        wire::{WireEndpoint, WirePublisher},
    },
    sync::lock,
    wall,
};

/// As `rmw_zenoh_cpp` does.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// How often a route is looked for.
const ROUTE: Duration = Duration::from_millis(1);

/// A publisher; a durable one has a cache for late joiners.
pub(super) struct Publisher {
    publisher: AdvancedPublisher<'static>,
    /// Held while a sample is handed over, so that the numbers are in order.
    turn: Mutex<()>,
    sent: AtomicU64,
    announced: Announced,
}

impl Publisher {
    pub(super) fn new(node: &Arc<Connection>, endpoint: Endpoint) -> Result<Self, String> {
        let offer = endpoint.offer;
        let congestion = if offer.reliable {
            CongestionControl::Block
        } else {
            CongestionControl::Drop
        };
        let mut publisher = node
            .session
            .declare_publisher(endpoint.key(node.node.domain_id))
            .reliability(reliability(offer))
            .congestion_control(congestion)
            .advanced();
        if offer.durable {
            let cache = CacheConfig::default().max_samples(offer.depth);
            publisher = publisher.publisher_detection().cache(cache);
            if offer.reliable {
                let detection = MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT);
                publisher = publisher.sample_miss_detection(detection);
            }
        }
        Ok(Self {
            publisher: publisher.wait().map_err(text)?,
            announced: Announced::new(node, endpoint)?,
            turn: Mutex::new(()),
            sent: AtomicU64::new(0),
        })
    }
}

impl WireEndpoint for Publisher {
    /// A subscription may be announced before Zenoh has a route to it.
    fn matched(&self) -> usize {
        match self.announced.matched() {
            0 => 0,
            matched => {
                let status = self.publisher.matching_status().wait();
                let has_route = status.is_ok_and(|status| status.matching());
                if has_route { matched } else { 0 }
            }
        }
    }

    fn wait_for_matches(&self, count: usize, timeout: Duration) -> bool {
        let begun = Instant::now();
        if !self.announced.wait_for_matches(count, timeout) {
            return false;
        }
        while self.matched() < count {
            if begun.elapsed() >= timeout {
                return false;
            }
            thread::sleep(ROUTE);
        }
        true
    }

    fn incompatible(&self) -> usize {
        self.announced.incompatible()
    }

    fn topic(&self) -> &str {
        self.announced.topic()
    }
}

impl WirePublisher for Publisher {
    fn endpoint(&self) -> &dyn WireEndpoint {
        self
    }

    fn publish(&self, cdr: Vec<u8>, _: Option<Duration>) -> Result<(), PublishError> {
        let _turn = lock(&self.turn);
        let attachment = Attachment {
            sequence: next(self.sent()),
            time: wall::now(),
            gid: self.announced.gid,
        };
        let put = self.publisher.put(cdr).attachment(attachment).wait();
        put.map_err(|error| PublishError::Wire {
            topic: self.topic().to_owned(),
            reason: error.to_string(),
        })?;
        self.sent.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    fn flush(&self, _: Duration) -> Result<(), PublishError> {
        Ok(())
    }

    fn acknowledged_within(&self, _: Duration) -> bool {
        true
    }

    fn patience(&self, patience: Duration) -> Duration {
        patience
    }

    fn sent(&self) -> u64 {
        self.sent.load(Ordering::Relaxed)
    }

    fn dropped(&self) -> u64 {
        0
    }

    fn id(&self) -> WriterId {
        WriterId(self.announced.gid)
    }
}
