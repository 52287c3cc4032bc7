use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use crate::ros::{Executor, Namesake, RosNode};
use crate::{Environment, Shutdown};
use tracing::warn;

use super::NodeError;

/// How often it is looked for them.
const LOOK: Duration = Duration::from_millis(100);

/// Looks for which a newcomer stays, so that the elder sees it, too.
const STAYS: u32 = 3;

/// Sees to it that only one node of a name goes on, wherever the others are; on one host the lock does so at once.
pub(crate) struct Namesakes(Arc<OnceLock<String>>);

impl Namesakes {
    /// Raises `shutdown` soon after a node of the same name is discovered that has been there before; warns of others.
    pub(crate) fn watch(
        ros: &RosNode,
        executor: &mut Executor,
        environment: &Environment,
        shutdown: &Shutdown,
    ) -> Self {
        let refused = Arc::new(OnceLock::new());
        let (refusing, shutdown, ros) = (Arc::clone(&refused), shutdown.clone(), ros.clone());
        let domain_id = environment.domain_id;
        let mut known = BTreeSet::new();
        let mut looks = 0;
        executor.every(LOOK, move || {
            if refusing.get().is_some() {
                looks += 1;
                if looks == STAYS {
                    shutdown.request();
                }
            }
            for namesake in ros.namesakes() {
                if shutdown.requested() || !known.insert(namesake.participant.clone()) {
                    continue;
                }
                let (name, other) = (ros.fully_qualified_name(), describe(&namesake));
                if namesake.elder {
                    let _ = refusing.set(refusal(&name, domain_id, &other));
                } else {
                    warn!("another node named {name} has appeared ({other}): this node was there first and continues");
                }
            }
        });
        Self(refused)
    }

    /// Fails if the node had to make room for another.
    pub(crate) fn refused(&self) -> Result<(), NodeError> {
        let refusal = self.0.get().cloned().map(NodeError::Input);
        refusal.map_or(Ok(()), Err)
    }
}

/// Why a node does not start beside `other`.
pub(crate) fn refusal(name: &str, domain_id: u16, other: &str) -> String {
    format!(
        "a node named {name} runs in domain {domain_id} already ({other}), expected none: end it, \
         or give this one another name with -r __node:=NAME or another namespace with -r __ns:=/NAMESPACE"
    )
}

fn describe(namesake: &Namesake) -> String {
    let addresses = namesake.addresses.iter().map(ToString::to_string);
    let addresses: Vec<_> = addresses.collect();
    let participant = &namesake.participant;
    if addresses.is_empty() {
        format!("participant {participant}")
    } else {
        format!("participant {participant} at {}", addresses.join(", "))
    }
}
