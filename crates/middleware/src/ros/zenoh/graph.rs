//! Which nodes and endpoints there are, by their liveliness tokens.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Condvar, Mutex},
    time::{Duration, Instant},
};

use ::zenoh::{
    Session, Wait,
    pubsub::Subscriber,
    sample::{Sample, SampleKind},
};
use tracing::warn;

use super::{
    keys::{self, Endpoint, Entity, Kind, Node, Offer},
    text,
};
use crate::{
    ros::{
        Namesake, TopicInfo,
        namesakes::{Birth, is_elder},
        topics, type_names,
    },
    sync::{lock, wait_while},
};

/// Knows the tokens of other sessions.
pub(super) struct Graph {
    shared: Arc<Shared>,
    created: Instant,
    _tokens: Subscriber<()>,
}

#[derive(Default)]
struct Shared {
    own: String,
    table: Mutex<Table>,
    changed: Condvar,
}

#[derive(Default)]
struct Table {
    others: BTreeMap<String, Entity>,
    /// Our endpoints, of which mismatches are reported.
    own: Vec<Endpoint>,
    /// Tokens of others that were reported, each for one of ours.
    reported: BTreeSet<(String, String)>,
}

impl Graph {
    pub(super) fn listen(session: &Session, node: &Node) -> Result<Self, String> {
        let shared = Arc::new(Shared {
            own: node.session.clone(),
            ..Shared::default()
        });
        let kept = Arc::clone(&shared);
        let tokens = session
            .liveliness()
            .declare_subscriber(keys::tokens(node.domain_id))
            .history(true)
            .callback(move |sample| kept.apply(&sample));
        Ok(Self {
            shared,
            created: Instant::now(),
            _tokens: tokens.wait().map_err(text)?,
        })
    }

    /// Has mismatches with an endpoint of ours reported.
    pub(super) fn watch(&self, endpoint: &Endpoint) {
        let mut table = lock(&self.shared.table);
        table.own.push(endpoint.clone());
        table.report();
    }

    /// Forgets an endpoint of ours.
    pub(super) fn forget(&self, endpoint: &Endpoint) {
        let mut table = lock(&self.shared.table);
        let place = table.own.iter().position(|own| own == endpoint);
        place.map(|place| table.own.swap_remove(place));
    }

    /// How many endpoints of others one of ours works with.
    pub(super) fn matched(&self, own: &Endpoint) -> usize {
        lock(&self.shared.table).matched(own)
    }

    /// How many are on the other side, and of another type.
    pub(super) fn incompatible(&self, own: &Endpoint) -> usize {
        let table = lock(&self.shared.table);
        table
            .facing(own)
            .filter(|(_, other)| !own.understands(other))
            .count()
    }

    /// Blocks until there are so many matches, or the time has passed; returns whether there are.
    pub(super) fn wait(&self, own: &Endpoint, count: usize, timeout: Duration) -> bool {
        let Shared { table, changed, .. } = &*self.shared;
        let table = wait_while(changed, table, timeout, |table| table.matched(own) < count);
        table.matched(own) >= count
    }

    pub(super) fn topics(&self) -> Vec<TopicInfo> {
        let table = lock(&self.shared.table);
        let endpoints = table
            .others
            .values()
            .filter_map(|other| other.endpoint.as_ref());
        topics::collect(endpoints.filter_map(|endpoint| {
            let Offer {
                reliable, durable, ..
            } = endpoint.offer;
            let offer = match endpoint.kind {
                Kind::Publisher => Some((reliable, durable)),
                Kind::Subscription => None,
                Kind::Server | Kind::Client => return None,
            };
            let type_name = type_names::ros_type(&endpoint.type_name)?;
            Some((endpoint.topic.clone(), type_name, offer))
        }))
    }

    pub(super) fn nodes(&self) -> Vec<String> {
        let table = lock(&self.shared.table);
        let nodes = table
            .others
            .values()
            .filter(|other| other.endpoint.is_none());
        let mut names: Vec<_> = nodes
            .map(|other| other.node.fully_qualified_name())
            .collect();
        names.sort_unstable();
        names
    }

    pub(super) fn namesakes(&self, own: &Node) -> Vec<Namesake> {
        let table = lock(&self.shared.table);
        let name = own.fully_qualified_name();
        let nodes = table
            .others
            .values()
            .filter(|other| other.endpoint.is_none() && other.node.fully_qualified_name() == name);
        let namesakes = nodes.map(|other| Namesake {
            participant: other.node.session.clone(),
            addresses: Vec::new(),
            elder: is_elder(birth(own), self.created.elapsed(), birth(&other.node)),
        });
        namesakes.collect()
    }
}

impl Shared {
    fn apply(&self, sample: &Sample) {
        let token = sample.key_expr().as_str();
        let Some(entity) = Entity::read(token) else {
            return;
        };
        if entity.node.session == self.own {
            return;
        }
        let mut table = lock(&self.table);
        match sample.kind() {
            SampleKind::Put => {
                table.others.insert(token.to_owned(), entity);
                table.report();
            }
            SampleKind::Delete => {
                table.others.remove(token);
                table.reported.retain(|(other, _)| other != token);
            }
        }
        drop(table);
        self.changed.notify_all();
    }
}

impl Table {
    fn facing<'t>(&'t self, own: &'t Endpoint) -> impl Iterator<Item = (&'t String, &'t Endpoint)> {
        let others = self.others.iter();
        others
            .filter_map(|(token, other)| other.endpoint.as_ref().map(|endpoint| (token, endpoint)))
            .filter(|(_, other)| own.faces(other))
    }

    fn matched(&self, own: &Endpoint) -> usize {
        let facing = self.facing(own);
        facing.filter(|(_, other)| own.understands(other)).count()
    }

    /// Warns of each mismatch once.
    fn report(&mut self) {
        let Self {
            others,
            own,
            reported,
        } = self;
        let name = |endpoint: &Endpoint| {
            let ros = type_names::ros_type(&endpoint.type_name);
            let name = ros.unwrap_or_else(|| endpoint.type_name.clone());
            let hash = endpoint.hash.as_deref().unwrap_or("no hash");
            format!("{name} ({hash})")
        };
        for (token, Entity { node, endpoint }) in others {
            let Some(other) = endpoint else { continue };
            for own in own.iter().filter(|own| own.faces(other)) {
                if own.understands(other) || !reported.insert((token.clone(), own.topic.clone())) {
                    continue;
                }
                warn!(
                    "{:?} of {} on {} has the type {}, ours is {}: no messages can be understood",
                    other.kind,
                    node.fully_qualified_name(),
                    own.topic,
                    name(other),
                    name(own)
                );
            }
        }
    }
}

/// When a node was born, which its number says, and its session.
fn birth(node: &Node) -> Birth {
    let mut session = [0; 16];
    for (to, from) in session.iter_mut().zip(node.session.bytes()) {
        *to = from;
    }
    (i64::try_from(node.id).unwrap_or(i64::MAX), session)
}
