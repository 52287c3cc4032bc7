//! DDS domains that no other test has.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::net::{Ipv4Addr, UdpSocket};
use std::panic::Location;

/// The domains of these tests: off those that people use, and those of the middleware's own tests.
const FIRST: u16 = 100;
const COUNT: u16 = 101;

/// A DDS domain, held until this is dropped.
#[derive(Debug)]
pub(crate) struct Domain {
    pub(crate) id: u16,
    _held: UdpSocket,
}

impl Domain {
    /// The domain of a place in the source, or the next one that no test on this host holds.
    pub(crate) fn hold(place: &Location<'_>) -> Self {
        let mut hasher = DefaultHasher::new();
        place.hash(&mut hasher);
        let preferred = hasher.finish() % u64::from(COUNT);
        (0..COUNT)
            .map(|further| FIRST + (preferred as u16 + further) % COUNT)
            .find_map(|id| {
                Some(Self {
                    id,
                    _held: UdpSocket::bind(marker(id)).ok()?,
                })
            })
            .expect("a DDS domain from 100 to 200 that no other test holds")
    }
}

/// A port of the domain that DDS leaves unused: it takes 0, 1, and from 10 on two a participant.
fn marker(id: u16) -> (Ipv4Addr, u16) {
    (Ipv4Addr::LOCALHOST, 7400 + 250 * id + 2)
}
