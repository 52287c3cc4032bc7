//! The first samples of Fast DDS writers, which may be sent before their reader knows the writer.
//!
//! A client of Fast DDS sends its request as soon as it has found the server, which may not have found the client by then.
//! The request is lost, and RustDDS 0.15 asks for a heartbeat in a way that Fast DDS 2 answers after its period of 3 s. So the
//! reader hears of the sample from here, and asks for it. If there is none, nobody minds.

use std::{
    collections::VecDeque,
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

/// The readers and writers that have been matched just now.
#[derive(Debug, Default)]
pub(super) struct FirstSamples {
    matched: Mutex<VecDeque<Matched>>,
}

#[derive(Debug)]
struct Matched {
    reader: GUID,
    writer: GUID,
    since: Instant,
}

impl FirstSamples {
    /// Takes note of a match.
    pub(super) fn expect(&self, reader: GUID, writer: GUID) {
        let identity = writer.to_bytes();
        if identity.starts_with(&FAST_DDS) && identity[15] & BUILT_IN == 0 {
            let since = Instant::now();
            lock(&self.matched).push_back(Matched {
                reader,
                writer,
                since,
            });
        }
    }

    /// Has readers ask for what is due; returns when there will be more to do.
    pub(super) fn ask(&self, laggards: &Laggards) -> Option<Duration> {
        let mut matched = lock(&self.matched);
        while let Some(Matched {
            reader,
            writer,
            since,
        }) = matched.front()
        {
            let waited = since.elapsed();
            if waited < PAUSE {
                return Some(PAUSE - waited);
            }
            laggards.send_home(&rtps::first_sample(*writer, *reader));
            matched.pop_front();
        }
        None
    }
}
