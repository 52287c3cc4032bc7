//! Which remote endpoints are matched with ours.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use rustdds::{DomainParticipantStatusEvent as Event, GUID};
use tracing::debug;

/// The matched remote endpoints of each local one.
#[derive(Debug, Default)]
pub(super) struct Matches {
    remotes: Mutex<BTreeMap<GUID, BTreeSet<GUID>>>,
    changed: Condvar,
    discovery: Mutex<Option<Instant>>,
}

impl Matches {
    /// How many remote endpoints a local one is matched with.
    pub(super) fn count(&self, local: GUID) -> usize {
        count(&self.lock(), local)
    }

    /// Blocks until there are so many, or the time has passed; returns whether there are.
    pub(super) fn wait(&self, local: GUID, wanted: usize, timeout: Duration) -> bool {
        let (remotes, _) = self
            .changed
            .wait_timeout_while(self.lock(), timeout, |remotes| {
                count(remotes, local) < wanted
            })
            .unwrap_or_else(PoisonError::into_inner);
        count(&remotes, local) >= wanted
    }

    /// Whether a local endpoint is matched with one of the participant that a remote endpoint belongs to.
    pub(super) fn reaches(&self, local: GUID, remote: GUID) -> bool {
        self.lock()
            .get(&local)
            .is_some_and(|remotes| remotes.iter().any(|other| other.prefix == remote.prefix))
    }

    /// The remote endpoints that a local one is matched with.
    pub(super) fn of(&self, local: GUID) -> BTreeSet<GUID> {
        self.lock().get(&local).cloned().unwrap_or_default()
    }

    /// The remote endpoints that a local one is matched with, of participants that another one is matched with too.
    pub(super) fn paired(&self, local: GUID, other: GUID) -> BTreeSet<GUID> {
        paired(&self.lock(), local, other).collect()
    }

    /// Blocks until two local endpoints are matched with the same participant, or the time has passed; returns whether
    /// they are.
    pub(super) fn wait_for_pair(&self, first: GUID, second: GUID, timeout: Duration) -> bool {
        let (remotes, _) = self
            .changed
            .wait_timeout_while(self.lock(), timeout, |remotes| {
                paired(remotes, first, second).next().is_none()
            })
            .unwrap_or_else(PoisonError::into_inner);
        paired(&remotes, first, second).next().is_some()
    }

    /// Forgets a local endpoint.
    pub(super) fn forget(&self, local: GUID) {
        self.lock().remove(&local);
    }

    /// When another participant was last discovered.
    pub(super) fn last_discovery(&self) -> Option<Instant> {
        *self
            .discovery
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes note of what DDS reports.
    pub(super) fn apply(&self, event: Event) {
        match event {
            Event::RemoteReaderMatched {
                local_writer: local,
                remote_reader: remote,
            }
            | Event::RemoteWriterMatched {
                local_reader: local,
                remote_writer: remote,
            } => {
                debug!(?local, ?remote, "matched");
                self.lock().entry(local).or_default().insert(remote);
            }
            Event::ParticipantDiscovered { .. } => {
                *self
                    .discovery
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                for remotes in self.lock().values_mut() {
                    remotes.remove(&guid);
                }
            }
            Event::ParticipantLost { id, .. } => {
                for remotes in self.lock().values_mut() {
                    remotes.retain(|remote| remote.prefix != id);
                }
            }
            _ => return,
        }
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<GUID, BTreeSet<GUID>>> {
        self.remotes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn paired(
    remotes: &BTreeMap<GUID, BTreeSet<GUID>>,
    local: GUID,
    other: GUID,
) -> impl Iterator<Item = GUID> {
    let of = |local| remotes.get(&local).into_iter().flatten();
    of(local)
        .filter(move |remote| of(other).any(|other| remote.prefix == other.prefix))
        .copied()
}

fn count(remotes: &BTreeMap<GUID, BTreeSet<GUID>>, local: GUID) -> usize {
    remotes.get(&local).map_or(0, BTreeSet::len)
}
