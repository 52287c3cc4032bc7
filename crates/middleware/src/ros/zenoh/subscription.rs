//! Subscriptions on Zenoh.

use std::sync::Arc;

use ::zenoh::{Wait, key_expr::KeyExpr, pubsub::Subscriber, sample::SampleKind};

use super::{
    Announced, Connection,
    attachment::taken,
    keys::Endpoint,
    ordered::{CACHED_PUBLISHERS, Ordered},
    text,
};
use crate::ros::{
    arrivals::Arrivals,
    wire::{WireEndpoint, WireSubscription},
};

/// A subscription. A reliable one asks publishers for what they keep, whatever durability it requests, as over DDS.
pub(super) struct Subscription {
    arrivals: Arc<Arrivals>,
    _subscribers: Vec<Subscriber<()>>,
    announced: Announced,
}

impl Subscription {
    pub(super) fn new(node: &Arc<Connection>, endpoint: Endpoint) -> Result<Self, String> {
        let arrivals = Arc::new(Arrivals::new(endpoint.offer.depth));
        let subscribers = if endpoint.offer.reliable {
            reliable(node, &endpoint, &arrivals)
        } else {
            best_effort(node, &endpoint, &arrivals).map(|subscriber| vec![subscriber])
        };
        Ok(Self {
            _subscribers: subscribers.map_err(text)?,
            announced: Announced::new(node, endpoint)?,
            arrivals,
        })
    }
}

fn best_effort(
    node: &Connection,
    endpoint: &Endpoint,
    arrivals: &Arc<Arrivals>,
) -> ::zenoh::Result<Subscriber<()>> {
    let arrivals = Arc::clone(arrivals);
    node.session
        .declare_subscriber(endpoint.key(node.node.domain_id))
        .callback(move |sample| arrivals.put(Ok(taken(&sample))))
        .wait()
}

/// The subscriber to the topic, and the one to publishers that keep samples.
fn reliable(
    node: &Connection,
    endpoint: &Endpoint,
    arrivals: &Arc<Arrivals>,
) -> ::zenoh::Result<Vec<Subscriber<()>>> {
    let key = KeyExpr::try_from(endpoint.key(node.node.domain_id))?;
    let depth = endpoint.offer.depth;
    let ordered = Ordered::new(&node.session, &key, Arc::clone(arrivals), depth)?;
    let cached = key.join(CACHED_PUBLISHERS)?;
    let (live, past) = (Arc::clone(&ordered), ordered);
    let live = node
        .session
        .declare_subscriber(key)
        .callback(move |sample| live.arrived(taken(&sample)));
    let past = node
        .session
        .liveliness()
        .declare_subscriber(cached)
        .history(true)
        .callback(move |token| {
            if token.kind() == SampleKind::Put {
                past.query(&token.key_expr().clone().into_owned());
            }
        });
    Ok(vec![live.wait()?, past.wait()?])
}

impl WireSubscription for Subscription {
    fn endpoint(&self) -> &dyn WireEndpoint {
        &self.announced
    }

    fn arrivals(&self) -> &Arrivals {
        &self.arrivals
    }
}
