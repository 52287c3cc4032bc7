//! DDS domains that no other test has.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::net::{Ipv4Addr, UdpSocket};
use std::panic::Location;

use crate::eventually;

/// The domains of these tests. Below are those that people and the middleware's own tests use, and from 102 on those
/// whose ports Linux gives to any socket (32 768 to 60 999).
const FIRST: u16 = 215;
const COUNT: u16 = lgvi_middleware::MAX_DOMAIN_ID - FIRST + 1;

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
        let preferred = (hasher.finish() % u64::from(COUNT)) as u16;
        eventually("a DDS domain that no other test holds", || {
            let mut ids = (0..COUNT).map(|further| FIRST + (preferred + further) % COUNT);
            ids.find_map(|id| {
                Some(Self {
                    id,
                    _held: UdpSocket::bind(marker(id)).ok()?,
                })
            })
        })
    }
}

/// A port of the domain that DDS leaves unused: it takes 0, 1, and from 10 on two a participant.
fn marker(id: u16) -> (Ipv4Addr, u16) {
    (Ipv4Addr::LOCALHOST, 7400 + 250 * id + 2)
}
