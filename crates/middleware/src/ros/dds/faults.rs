//! Remote endpoints on our topics that ours cannot work with, reported once each by name.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
    sync::Mutex,
    time::{Duration, Instant},
};

use rustdds::{DomainParticipantStatusEvent as Event, GUID, QosPolicies, policy, qos::QosPolicyId};
use tracing::warn;

use super::{graph::Side, names::Names};
use crate::{ros::type_names, sync::lock};

/// How long a report waits for the remote node to announce its name.
const PATIENCE: Duration = Duration::from_secs(1);

/// Local endpoints, remote types, and what is wrong between them.
#[derive(Debug, Default)]
pub(super) struct Faults(Mutex<Table>);

#[derive(Debug, Default)]
struct Table {
    locals: BTreeMap<GUID, Local>,
    types: BTreeMap<GUID, String>,
    pending: Vec<Pending>,
    found: BTreeSet<(GUID, GUID)>,
}

#[derive(Debug)]
struct Local {
    side: Side,
    topic: String,
    dds_type: String,
}

#[derive(Debug)]
struct Pending {
    local: GUID,
    remote: GUID,
    /// The policy, what is requested and what is offered; nothing if the endpoints match but for, perhaps, the type.
    policy: Option<(&'static str, String, String)>,
    since: Instant,
}

impl Faults {
    /// Takes note of a local endpoint.
    pub(super) fn add(&self, guid: GUID, side: Side, topic: &str, dds_type: &str) {
        let local = Local {
            side,
            topic: topic.into(),
            dds_type: dds_type.into(),
        };
        lock(&self.0).locals.insert(guid, local);
    }

    /// Forgets a local endpoint.
    pub(super) fn remove(&self, guid: GUID) {
        let mut table = lock(&self.0);
        table.locals.remove(&guid);
        table.pending.retain(|pending| pending.local != guid);
        table.found.retain(|(local, _)| *local != guid);
    }

    /// How many remote endpoints a local one cannot work with.
    pub(super) fn count(&self, local: GUID) -> usize {
        let table = lock(&self.0);
        table
            .found
            .iter()
            .filter(|(found, _)| *found == local)
            .count()
    }

    /// Takes note of what DDS reports.
    pub(super) fn apply(&self, event: &Event) {
        let mut table = lock(&self.0);
        match event {
            Event::ReaderDetected { reader: endpoint }
            | Event::WriterDetected { writer: endpoint } => {
                table
                    .types
                    .insert(endpoint.guid, endpoint.type_name.clone());
            }
            Event::RemoteReaderMatched {
                local_writer: local,
                remote_reader: remote,
            }
            | Event::RemoteWriterMatched {
                local_reader: local,
                remote_writer: remote,
            } => table.add(*local, *remote, None),
            Event::RemoteReaderQosIncompatible {
                local_writer: local,
                remote_reader: remote,
                requested_qos,
                offered_qos,
            }
            | Event::RemoteWriterQosIncompatible {
                local_reader: local,
                remote_writer: remote,
                requested_qos,
                offered_qos,
            } => table.add(*local, *remote, failing_policy(offered_qos, requested_qos)),
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                table.forget(|remote| remote == *guid);
            }
            Event::ParticipantLost { id, .. } => table.forget(|remote| remote.prefix == *id),
            _ => {}
        }
    }

    /// Forgets the remote endpoints for which this is not so.
    pub(super) fn retain(&self, stays: impl Fn(GUID) -> bool) {
        lock(&self.0).forget(|remote| !stays(remote));
    }

    /// Reports what is new and, if possible, has a name; to be called often. Returns when to call it at the latest.
    pub(super) fn report(&self, names: &Names) -> Option<Duration> {
        let mut table = lock(&self.0);
        for pending in std::mem::take(&mut table.pending) {
            table.report(pending, names);
        }
        let oldest = table.pending.first()?;
        Some(PATIENCE.saturating_sub(oldest.since.elapsed()))
    }
}

impl Table {
    fn add(&mut self, local: GUID, remote: GUID, policy: Option<(&'static str, String, String)>) {
        // DDS reports the same again whenever it hears of the remote endpoint.
        let same = |pending: &Pending| (pending.local, pending.remote) == (local, remote);
        if self.found.contains(&(local, remote)) || self.pending.iter().any(same) {
            return;
        }
        self.pending.push(Pending {
            local,
            remote,
            policy,
            since: Instant::now(),
        });
    }

    fn forget(&mut self, gone: impl Fn(GUID) -> bool) {
        self.types.retain(|remote, _| !gone(*remote));
        self.pending.retain(|pending| !gone(pending.remote));
        self.found.retain(|(_, remote)| !gone(*remote));
    }

    fn report(&mut self, pending: Pending, names: &Names) {
        let overdue = pending.since.elapsed() >= PATIENCE;
        let Some(local) = self.locals.get(&pending.local) else {
            // It is about to be noted; or it is one of the node's own, or gone.
            if !overdue {
                self.pending.push(pending);
            }
            return;
        };
        let remote_type = self.types.get(&pending.remote).unwrap_or(&local.dds_type);
        if pending.policy.is_none() && *remote_type == local.dds_type {
            return;
        }
        self.found.insert((pending.local, pending.remote));
        let name = names.node_of(pending.remote);
        if name.is_none() && !overdue {
            self.pending.push(pending);
            return;
        }
        let name = name.unwrap_or_else(|| format!("{:?}", pending.remote));
        let topic = &local.topic;
        match (local.side, &pending.policy) {
            (Side::Publisher, Some((policy, requested, offered))) => warn!(
                "subscription of {name} on {topic} requests {policy} {requested}, offered is {offered}: no messages \
                 will be delivered"
            ),
            (Side::Subscription, Some((policy, requested, offered))) => warn!(
                "publisher of {name} on {topic} offers {policy} {offered}, requested is {requested}: no messages will \
                 be delivered"
            ),
            (side, None) => {
                let kind = match side {
                    Side::Publisher => "subscription",
                    Side::Subscription => "publisher",
                };
                let ros =
                    |name: &String| type_names::ros_type(name).unwrap_or_else(|| name.clone());
                warn!(
                    "{kind} of {name} on {topic} has the type {}, ours is {}: no messages can be understood",
                    ros(remote_type),
                    ros(&local.dds_type)
                );
            }
        }
    }
}

/// The first policy by which what is offered is less than what is requested, with both values.
fn failing_policy(
    offered: &QosPolicies,
    requested: &QosPolicies,
) -> Option<(&'static str, String, String)> {
    let both = |value: fn(&QosPolicies) -> String| (value(requested), value(offered));
    let policy = offered.compliance_failure_wrt(requested)?;
    let (name, (requested, offered)) = match policy {
        QosPolicyId::Durability => ("durability", both(durability)),
        QosPolicyId::Reliability => ("reliability", both(reliability)),
        QosPolicyId::Deadline => ("deadline", both(|qos| text(qos.deadline()))),
        QosPolicyId::Liveliness => ("liveliness", both(|qos| text(qos.liveliness()))),
        QosPolicyId::LatencyBudget => ("latency budget", both(|qos| text(qos.latency_budget()))),
        QosPolicyId::Ownership => ("ownership", both(|qos| text(qos.ownership()))),
        QosPolicyId::Presentation => ("presentation", both(|qos| text(qos.presentation()))),
        QosPolicyId::DestinationOrder => (
            "destination order",
            both(|qos| text(qos.destination_order())),
        ),
        _ => ("another policy", both(|qos| text(Some(qos)))),
    };
    Some((name, requested, offered))
}

fn text(value: Option<impl fmt::Debug>) -> String {
    value.map_or_else(|| "the default".into(), |value| format!("{value:?}"))
}

fn durability(qos: &QosPolicies) -> String {
    match qos.durability() {
        None | Some(policy::Durability::Volatile) => "VOLATILE",
        Some(policy::Durability::TransientLocal) => "TRANSIENT_LOCAL",
        Some(policy::Durability::Transient) => "TRANSIENT",
        Some(policy::Durability::Persistent) => "PERSISTENT",
    }
    .into()
}

fn reliability(qos: &QosPolicies) -> String {
    match qos.reliability() {
        Some(policy::Reliability::Reliable { .. }) => "RELIABLE".into(),
        Some(policy::Reliability::BestEffort) => "BEST_EFFORT".into(),
        // By the DDS specification that of a publisher is the one, that of a subscription the other.
        None => "by default".into(),
    }
}
