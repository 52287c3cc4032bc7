//! What a node knows of others is compared with whom RustDDS knows, every few seconds.
//!
//! Reports of RustDDS 0.15 come from two threads: that an endpoint is matched may come after that it is gone. So what
//! the node remembers of endpoints that RustDDS does not know is forgotten here.
//!
//! RustDDS does not find a participant again whose lease has run out; that of one whose process is stopped (Ctrl-Z, a
//! debugger) does. So those on this host are kept as long as the socket is open that they listen with.

use std::{
    collections::{BTreeMap, BTreeSet},
    net::SocketAddr,
    sync::Arc,
    time::{Duration, Instant},
};

use rustdds::{DomainParticipant, GUID, RTPSEntity};

use crate::ros::WriterId;

use super::{inbox::Inbox, keeps::Keeps, laggards::participant, rtps, sockets::Sockets};

/// How often. The shortest usual lease is 10 s.
const PERIOD: Duration = Duration::from_secs(2);

/// Compares every few seconds.
pub(super) struct Census {
    participant: DomainParticipant,
    latest: Instant,
    /// The sockets that participants on this host listen with.
    listening: BTreeMap<[u8; 12], BTreeSet<u64>>,
}

/// The endpoints that RustDDS knows, and where their participants are reached.
#[derive(Default)]
struct Population {
    endpoints: BTreeSet<GUID>,
    participants: BTreeMap<[u8; 12], BTreeSet<SocketAddr>>,
}

impl Census {
    pub(super) fn new(participant: DomainParticipant) -> Self {
        Self {
            participant,
            latest: Instant::now(),
            listening: BTreeMap::new(),
        }
    }

    /// Compares, if it is time; returns when to call it at the latest. What is kept must not change meanwhile, but for
    /// the inboxes.
    pub(super) fn take(&mut self, keeps: &Keeps, inboxes: &[Arc<Inbox>]) -> Duration {
        let elapsed = self.latest.elapsed();
        if elapsed < PERIOD {
            return PERIOD - elapsed;
        }
        self.latest = Instant::now();
        let heard: Vec<_> = inboxes
            .iter()
            .map(|inbox| inbox.arrivals().publishers())
            .collect();
        let population = Population::of(&self.participant);
        for (inbox, publishers) in inboxes.iter().zip(heard) {
            let there = |publisher: &WriterId| {
                let endpoint = GUID::from_bytes(publisher.0);
                population.endpoints.contains(&endpoint)
            };
            let gone = publishers.into_iter().filter(|publisher| !there(publisher));
            gone.for_each(|publisher| inbox.arrivals().forget(publisher));
        }
        let own = self.participant.guid();
        keeps.retain(
            |endpoint| endpoint.prefix == own.prefix || population.endpoints.contains(&endpoint),
            |guid| population.participants.contains_key(&participant(guid)),
        );
        self.keep(keeps, &population);
        PERIOD
    }

    /// Keeps the participants whose sockets are open.
    fn keep(&mut self, keeps: &Keeps, population: &Population) {
        let listening = &mut self.listening;
        listening.retain(|participant, _| population.participants.contains_key(participant));
        let sockets = Sockets::of_this_host();
        let own = participant(self.participant.guid());
        for (&other, addresses) in &population.participants {
            if other == own {
                continue;
            }
            let open = sockets.at(addresses);
            let known = match listening.remove(&other) {
                Some(known) => &known & &open,
                None => {
                    // A socket is one participant's: one that was killed may have left its place to this one.
                    let others = listening.values_mut();
                    others.for_each(|sockets| sockets.retain(|socket| !open.contains(socket)));
                    open
                }
            };
            // With security one that hangs cannot be overwritten for: it must be lost, or it would hold up all others.
            if !known.is_empty() && !keeps.laggards.is_secured() {
                let sign = rtps::sign_of_life(self.participant.guid(), other);
                keeps.laggards.send_home(&sign);
            }
            listening.insert(other, known);
        }
    }
}

impl Population {
    fn of(participant: &DomainParticipant) -> Self {
        let mut population = Self::default();
        for reader in participant.discovered_readers() {
            let proxy = reader.reader_proxy;
            population.add(proxy.remote_reader_guid, proxy.unicast_locator_list);
        }
        for writer in participant.discovered_writers() {
            let proxy = writer.writer_proxy;
            population.add(proxy.remote_writer_guid, proxy.unicast_locator_list);
        }
        population
    }

    fn add<L: Into<SocketAddr>>(&mut self, endpoint: GUID, locators: Vec<L>) {
        self.endpoints.insert(endpoint);
        let addresses = self.participants.entry(participant(endpoint)).or_default();
        addresses.extend(locators.into_iter().map(Into::into));
    }
}
