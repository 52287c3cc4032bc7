//! Which remote endpoints are matched with ours.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Condvar, Mutex},
    time::{Duration, Instant},
};

use rustdds::{DomainParticipantStatusEvent as Event, GUID};
use tracing::debug;

use crate::sync::{lock, wait_while};

/// The matched remote endpoints of each local one.
type Remotes = BTreeMap<GUID, BTreeSet<GUID>>;

/// The same, as DDS reports them.
#[derive(Debug, Default)]
pub(super) struct Matches {
    remotes: Mutex<Remotes>,
    changed: Condvar,
    discovery: Mutex<Option<Instant>>,
}

impl Matches {
    /// How many remote endpoints a local one is matched with.
    pub(super) fn count(&self, local: GUID) -> usize {
        count(&lock(&self.remotes), local)
    }

    /// Blocks until there are so many, or the time has passed; returns whether there are.
    pub(super) fn wait(&self, local: GUID, wanted: usize, timeout: Duration) -> bool {
        let too_few = |remotes: &mut Remotes| count(remotes, local) < wanted;
        let remotes = wait_while(&self.changed, &self.remotes, timeout, too_few);
        count(&remotes, local) >= wanted
    }

    /// Whether a local endpoint is matched with a remote one.
    pub(super) fn has(&self, local: GUID, remote: GUID) -> bool {
        lock(&self.remotes)
            .get(&local)
            .is_some_and(|remotes| remotes.contains(&remote))
    }

    /// Whether a server can answer all clients of the participant that `writer`, which has sent a request, belongs to: as many
    /// readers of its replies are known as writers of requests.
    pub(super) fn answers(&self, replies: GUID, requests: GUID, writer: GUID) -> bool {
        let remotes = lock(&self.remotes);
        let of = |local| {
            let remotes = remotes.get(&local).into_iter().flatten();
            remotes.filter(|remote| remote.prefix == writer.prefix)
        };
        let others = of(requests).filter(|other| **other != writer).count();
        of(replies).count() > others
    }

    /// The remote endpoints that a local one is matched with.
    pub(super) fn of(&self, local: GUID) -> BTreeSet<GUID> {
        lock(&self.remotes).get(&local).cloned().unwrap_or_default()
    }

    /// The remote endpoints that a local one is matched with, of participants that another one is matched with too.
    pub(super) fn paired(&self, local: GUID, other: GUID) -> BTreeSet<GUID> {
        paired(&lock(&self.remotes), local, other).collect()
    }

    /// Blocks until two local endpoints are matched with the same participant, or the time has passed; returns whether
    /// they are.
    pub(super) fn wait_for_pair(&self, first: GUID, second: GUID, timeout: Duration) -> bool {
        let none = |remotes: &mut Remotes| paired(remotes, first, second).next().is_none();
        let remotes = wait_while(&self.changed, &self.remotes, timeout, none);
        paired(&remotes, first, second).next().is_some()
    }

    /// Forgets a local endpoint.
    pub(super) fn forget(&self, local: GUID) {
        lock(&self.remotes).remove(&local);
    }

    /// Forgets the remote endpoints for which this is not so.
    pub(super) fn retain(&self, stays: impl Fn(GUID) -> bool) {
        let mut remotes = lock(&self.remotes);
        remotes
            .values_mut()
            .for_each(|of| of.retain(|remote| stays(*remote)));
        remotes.retain(|_, of| !of.is_empty());
        drop(remotes);
        self.changed.notify_all();
    }

    /// When another participant was last discovered.
    pub(super) fn last_discovery(&self) -> Option<Instant> {
        *lock(&self.discovery)
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
                lock(&self.remotes).entry(local).or_default().insert(remote);
            }
            Event::ParticipantDiscovered { .. } => {
                *lock(&self.discovery) = Some(Instant::now());
            }
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                for remotes in lock(&self.remotes).values_mut() {
                    remotes.remove(&guid);
                }
            }
            Event::ParticipantLost { id, .. } => {
                for remotes in lock(&self.remotes).values_mut() {
                    remotes.retain(|remote| remote.prefix != id);
                }
            }
            _ => return,
        }
        self.changed.notify_all();
    }
}

fn paired(remotes: &Remotes, local: GUID, other: GUID) -> impl Iterator<Item = GUID> {
    let of = |local| remotes.get(&local).into_iter().flatten();
    of(local)
        .filter(move |remote| of(other).any(|other| remote.prefix == other.prefix))
        .copied()
}

fn count(remotes: &Remotes, local: GUID) -> usize {
    remotes.get(&local).map_or(0, BTreeSet::len)
}

#[cfg(test)]
mod tests {
    use rustdds::dds::statusevents::LostReason;

    use super::*;

    fn guid(participant: u8, entity: u8) -> GUID {
        let mut bytes = [0; 16];
        (bytes[0], bytes[13]) = (participant, entity);
        GUID::from_bytes(bytes)
    }

    fn matched(matches: &Matches, local: GUID, remote: GUID) {
        matches.apply(Event::RemoteReaderMatched {
            local_writer: local,
            remote_reader: remote,
        });
    }

    #[test]
    fn a_match_that_is_reported_after_the_loss_is_forgotten() {
        let matches = Matches::default();
        let (local, gone, there) = (guid(1, 1), guid(2, 1), guid(3, 1));
        matches.apply(Event::ReaderLost {
            guid: gone,
            reason: LostReason::Disposed,
        });
        matched(&matches, local, gone);
        matched(&matches, local, there);
        matches.retain(|remote| remote != gone);
        assert_eq!(matches.of(local), BTreeSet::from([there]));
        matches.retain(|_| false);
        assert!(lock(&matches.remotes).is_empty());
    }

    /// A participant's first client does not vouch for its second one.
    #[test]
    fn each_client_of_a_participant_counts() {
        let matches = Matches::default();
        let (replies, requests) = (guid(1, 1), guid(1, 2));
        let (first, second) = (guid(2, 1), guid(2, 3));
        assert!(!matches.answers(replies, requests, first));
        matched(&matches, replies, guid(3, 2));
        assert!(!matches.answers(replies, requests, first), "a stranger's");
        matched(&matches, replies, guid(2, 2));
        // Whether or not the match of the request's writer has been reported.
        assert!(matches.answers(replies, requests, first));
        matched(&matches, requests, first);
        assert!(matches.answers(replies, requests, first));
        assert!(!matches.answers(replies, requests, second));
        matched(&matches, requests, second);
        assert!(!matches.answers(replies, requests, second));
        matched(&matches, replies, guid(2, 4));
        assert!(matches.answers(replies, requests, second));
    }
}
