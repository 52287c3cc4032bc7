//! The first requests of Fast DDS clients, which may be sent before the server knows the client.
//!
//! A client of Fast DDS sends its request as soon as it has found the server, which may not have found the client by then.
//! The request is lost, and RustDDS 0.15 asks for a heartbeat in a way that Fast DDS 2 answers after its period of 3 s. So the
//! reader of requests hears of the first sample from here, and asks for it. If there is none, nobody minds.
//!
//! This is for readers of requests alone. Our heartbeat has the number of the writer's own first one, which RustDDS then ignores:
//! it would delay what a writer has sent earlier to a topic. Readers of replies have no need of it, because our clients
//! send nothing before they are matched with the server's writer.
//!
//! It does nothing for participants under DDS Security: the prefixes of their identities do not begin with the vendor's number.

use std::{
    collections::{BTreeSet, VecDeque},
    sync::Mutex,
    time::{Duration, Instant},
};

use rustdds::GUID;

use super::{
    laggards::Laggards,
    rtps::{self, FAST_DDS},
};
use crate::sync::lock;

/// Fast DDS does not send again what it has sent just now.
const PAUSE: Duration = Duration::from_millis(10);

/// In the last byte of an identity: whether the endpoint is built in.
const BUILT_IN: u8 = 0xc0;

/// The readers of requests, and the writers that they have been matched with just now.
#[derive(Debug, Default)]
pub(super) struct FirstSamples(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    servers: BTreeSet<GUID>,
    matched: VecDeque<Matched>,
}

#[derive(Debug)]
struct Matched {
    reader: GUID,
    writer: GUID,
    since: Instant,
}

impl FirstSamples {
    /// Takes note of a reader of requests. The writers that it is matched with already are told afterwards.
    pub(super) fn serve(&self, reader: GUID) {
        lock(&self.0).servers.insert(reader);
    }

    /// Forgets a reader.
    pub(super) fn forget(&self, reader: GUID) {
        lock(&self.0).servers.remove(&reader);
    }

    /// Takes note of a match, if the reader is one of requests.
    pub(super) fn expect(&self, reader: GUID, writer: GUID) {
        let mut state = lock(&self.0);
        let identity = writer.to_bytes();
        let is_fast_dds = identity.starts_with(&FAST_DDS) && identity[15] & BUILT_IN == 0;
        if is_fast_dds && state.servers.contains(&reader) {
            let since = Instant::now();
            state.matched.push_back(Matched {
                reader,
                writer,
                since,
            });
        }
    }

    /// Has readers ask for what is due; returns when there will be more to do.
    pub(super) fn ask(&self, laggards: &Laggards) -> Option<Duration> {
        let mut state = lock(&self.0);
        while let Some(Matched {
            reader,
            writer,
            since,
        }) = state.matched.front()
        {
            let waited = since.elapsed();
            if waited < PAUSE {
                return Some(PAUSE - waited);
            }
            laggards.send_home(&rtps::first_sample(*writer, *reader));
            state.matched.pop_front();
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guid(vendor: u8, kind: u8) -> GUID {
        let mut bytes = [0; 16];
        (bytes[..2]).copy_from_slice(&[1, vendor]);
        bytes[15] = kind;
        GUID::from_bytes(bytes)
    }

    #[test]
    fn only_readers_of_requests_ask_and_only_fast_dds() {
        let (server, topic) = (guid(18, 4), guid(18, 7));
        let client = guid(15, 3);
        let first_samples = FirstSamples::default();
        let expected = |reader, writer| {
            first_samples.expect(reader, writer);
            lock(&first_samples.0).matched.pop_front().is_some()
        };
        assert!(!expected(server, client));
        first_samples.serve(server);
        assert!(expected(server, client));
        assert!(!expected(topic, client));
        assert!(!expected(server, guid(16, 3)), "Cyclone DDS");
        assert!(!expected(server, guid(15, 0xc2)), "built in");
        first_samples.forget(server);
        assert!(!expected(server, client));
    }
}
