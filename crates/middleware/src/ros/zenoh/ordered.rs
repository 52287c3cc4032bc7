//! The samples of reliable publishers in order and once each, with those that were sent before there was a route.
//!
//! `zenoh_ext::AdvancedSubscriber` 1.10.2 is for this and loses the beginning of a burst: it holds back what arrives
//! while it queries a publisher's cache, delivers the next sample at once, and then drops what it held back as old.

use std::{
    mem,
    sync::{Arc, Mutex},
    time::Duration,
};

use ::zenoh::{
    Session, Wait,
    key_expr::KeyExpr,
    query::{ConsolidationMode, QueryTarget, Reply, ReplyKeyExpr},
};

use crate::{
    ros::{
        Sample,
        arrivals::{Arrivals, UNNUMBERED},
    },
    sync::lock,
};

use super::attachment::taken;

/// How long a publisher has to answer with what it keeps. Samples that follow a gap wait for the answer.
const QUERY: Duration = Duration::from_secs(5);

/// Where the caches of `zenoh_ext` answer, below the topic's key.
const CACHES: &str = "@adv/**";

/// Where publishers that have a cache announce themselves, below the topic's key.
pub(super) const CACHED_PUBLISHERS: &str = "@adv/pub/**";

/// Puts samples in order and asks caches for those that are missing.
pub(super) struct Ordered {
    session: Session,
    caches: KeyExpr<'static>,
    depth: usize,
    order: Mutex<Order>,
}

struct Order {
    arrivals: Arc<Arrivals>,
    /// Queries under way.
    queries: usize,
    /// Samples after a gap, as long as queries are under way.
    held: Vec<Sample<Vec<u8>>>,
}

/// Ends a query when Zenoh drops its callback.
struct Query(Arc<Ordered>);

impl Ordered {
    pub(super) fn new(
        session: &Session,
        key: &KeyExpr<'static>,
        arrivals: Arc<Arrivals>,
        depth: usize,
    ) -> Result<Arc<Self>, ::zenoh::Error> {
        Ok(Arc::new(Self {
            session: session.clone(),
            caches: key.join(CACHES)?,
            depth,
            order: Mutex::new(Order {
                arrivals,
                queries: 0,
                held: Vec::new(),
            }),
        }))
    }

    /// Takes a sample that was just published.
    pub(super) fn arrived(self: &Arc<Self>, sample: Sample<Vec<u8>>) {
        let mut order = lock(&self.order);
        if !order.is_after_gap(&sample) {
            order.deliver(sample);
            return;
        }
        order.held.push(sample);
        let asked = order.queries > 0;
        drop(order);
        if !asked {
            self.query(&self.caches);
        }
    }

    /// Asks the caches that answer at a key.
    pub(super) fn query(self: &Arc<Self>, key: &KeyExpr<'static>) {
        lock(&self.order).queries += 1;
        let query = Query(Arc::clone(self));
        let asked = self
            .session
            .get(format!("{key}?_max={}", self.depth))
            .callback(move |reply: Reply| {
                if let Ok(sample) = reply.result() {
                    lock(&query.0.order).held.push(taken(sample));
                }
            })
            .consolidation(ConsolidationMode::None)
            .accept_replies(ReplyKeyExpr::Any)
            .target(QueryTarget::All)
            .timeout(QUERY)
            .wait();
        if let Err(error) = asked {
            tracing::debug!(%error, "publishers cannot be asked for what they keep");
        }
    }
}

impl Drop for Query {
    fn drop(&mut self) {
        let mut order = lock(&self.0.order);
        order.queries -= 1;
        if order.queries == 0 {
            let mut held = mem::take(&mut order.held);
            held.sort_by_key(|sample| (sample.info.source_time, sample.info.sequence));
            for sample in held {
                order.deliver(sample);
            }
        }
    }
}

impl Order {
    fn is_after_gap(&self, sample: &Sample<Vec<u8>>) -> bool {
        sample.info.sequence > self.arrivals.latest(sample.info.writer) + 1
    }

    /// Delivers a sample unless it, or a later one of its publisher, has been delivered.
    fn deliver(&self, sample: Sample<Vec<u8>>) {
        let Sample { info, .. } = &sample;
        if info.sequence > self.arrivals.latest(info.writer) || info.sequence == UNNUMBERED {
            self.arrivals.put(Ok(sample));
        }
    }
}
