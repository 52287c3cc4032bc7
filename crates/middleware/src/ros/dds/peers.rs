//! Static peers: hosts that are told of a participant though multicast does not reach them.
//!
//! RustDDS 0.15 cannot be given initial peers. It announces a participant by multicast, and to the first discovery
//! ports of the loopback interface. One of these ports is taken here, and what arrives there of the own participant
//! goes on to the same ports of the peers as it is. They answer the participant itself.

use std::{
    io,
    net::{Ipv4Addr, SocketAddr, SocketAddrV4, ToSocketAddrs, UdpSocket},
    sync::{Arc, Weak},
    thread,
    time::{Duration, Instant},
};

use rustdds::{DomainParticipant, RTPSEntity};
use tracing::debug;

/// How many participants a host RustDDS announces to on the loopback interface.
const LOOPBACK_PLACES: u16 = 12;

/// How many participants a peer may have, as with Fast DDS in ROS 2.
const PEER_PLACES: u16 = 32;

/// How often an announcement is repeated: RustDDS makes one in 10 s, and one can be lost or find nobody yet.
const REPETITION: Duration = Duration::from_secs(1);

/// The longest datagram of UDP.
const DATAGRAM: usize = 65_536;

/// Has a participant announced to peers until it is dropped, or a little longer.
#[derive(Debug)]
pub(super) struct StaticPeers {
    _alive: Arc<()>,
}

impl StaticPeers {
    /// Begins to announce the participant, which must have been created just now.
    pub(super) fn start(
        participant: &DomainParticipant,
        addresses: &[Ipv4Addr],
    ) -> io::Result<Self> {
        let domain = participant.domain_id();
        let inlet = inlet(domain)?;
        inlet.set_read_timeout(Some(REPETITION))?;
        let relay = Relay {
            inlet,
            outlet: UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?,
            participant: participant.guid().to_bytes(),
            peers: addresses
                .iter()
                .flat_map(|address| {
                    (0..PEER_PLACES)
                        .map(|place| SocketAddrV4::new(*address, discovery_port(domain, place)))
                })
                .collect(),
        };
        let alive = Arc::new(());
        let watched = Arc::downgrade(&alive);
        thread::Builder::new()
            .name("static-peers".into())
            .spawn(move || relay.run(&watched))?;
        Ok(Self { _alive: alive })
    }
}

/// The IPv4 addresses of peers, given by address or by host name.
///
/// # Errors
/// The first peer that has none, and why.
pub(super) fn addresses(peers: &[String]) -> Result<Vec<Ipv4Addr>, String> {
    let mut addresses = Vec::new();
    for peer in peers {
        let found: Vec<_> = (peer.as_str(), 0)
            .to_socket_addrs()
            .map_err(|error| format!("static peer {peer:?}: {error}"))?
            .filter_map(|address| match address {
                SocketAddr::V4(address) => Some(*address.ip()),
                SocketAddr::V6(_) => None,
            })
            .collect();
        if found.is_empty() {
            return Err(format!("static peer {peer:?} has no IPv4 address"));
        }
        addresses.extend(found);
    }
    addresses.sort_unstable();
    addresses.dedup();
    Ok(addresses)
}

/// This host's address in the network by which a peer is reached.
pub(super) fn own_address(peer: Ipv4Addr) -> io::Result<Ipv4Addr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    // Connecting sends nothing, but chooses the route.
    socket.connect((peer, discovery_port(0, 0)))?;
    match socket.local_addr()? {
        SocketAddr::V4(address) => Ok(*address.ip()),
        SocketAddr::V6(_) => Err(io::ErrorKind::Unsupported.into()),
    }
}

/// RTPS 2.5, 9.6.2.3: where the participant in a place listens for announcements.
pub(super) fn discovery_port(domain: u16, place: u16) -> u16 {
    7400 + 250 * domain + 10 + 2 * place
}

/// Where a participant listens for announcements that listens for data at `data`, if its ports are those of RTPS 2.5,
/// 9.6.2.3.
pub(super) fn discovery_address(domain: u16, data: SocketAddr) -> Option<SocketAddr> {
    let port = data.port().checked_sub(1)?;
    let above = port.checked_sub(discovery_port(domain, 0))?;
    let usual = above.is_multiple_of(2) && above < 240;
    usual.then(|| SocketAddr::new(data.ip(), port))
}

/// The last free one of the ports that RustDDS announces to: participants take the first.
fn inlet(domain: u16) -> io::Result<UdpSocket> {
    let ports = (0..LOOPBACK_PLACES).rev();
    ports
        .map(|place| UdpSocket::bind((Ipv4Addr::LOCALHOST, discovery_port(domain, place))))
        .find(Result::is_ok)
        .unwrap_or_else(|| {
            Err(io::Error::other(format!(
                "all {LOOPBACK_PLACES} discovery ports of domain {domain} are in use"
            )))
        })
}

struct Relay {
    inlet: UdpSocket,
    outlet: UdpSocket,
    participant: [u8; 16],
    peers: Vec<SocketAddrV4>,
}

impl Relay {
    fn run(&self, alive: &Weak<()>) {
        let mut buffer = vec![0; DATAGRAM];
        let mut last = Vec::new();
        let mut sent = Instant::now();
        loop {
            let received = self.inlet.recv(&mut buffer);
            if alive.strong_count() == 0 {
                return;
            }
            match received {
                Ok(length) if announces(&buffer[..length], &self.participant[..12]) => {
                    last.clear();
                    last.extend_from_slice(&buffer[..length]);
                    self.send(&last);
                    sent = Instant::now();
                }
                // What others announce, and the timeout.
                Ok(_) | Err(_) => {}
            }
            if sent.elapsed() >= REPETITION && !last.is_empty() {
                self.send(&last);
                sent = Instant::now();
            }
        }
    }

    fn send(&self, message: &[u8]) {
        for peer in &self.peers {
            // A network may be down for a while.
            if let Err(error) = self.outlet.send_to(message, peer) {
                debug!(%peer, %error, "a static peer cannot be told of this node");
            }
        }
    }
}

/// Whether an RTPS message is of the participant (its GUID's prefix) and has data, by which it announces itself: RTPS
/// 2.5, 9.4.4 and 9.4.5.
fn announces(message: &[u8], participant: &[u8]) -> bool {
    const DATA: u8 = 0x15;
    const LITTLE_ENDIAN: u8 = 0x01;
    const WITH_DATA: u8 = 0x04;
    let Some((header, mut submessages)) = message.split_at_checked(20) else {
        return false;
    };
    if !header.starts_with(b"RTPS") || header[8..] != *participant {
        return false;
    }
    while let [id, flags, first, second, rest @ ..] = submessages {
        if *id == DATA && flags & WITH_DATA != 0 {
            return true;
        }
        let length = match flags & LITTLE_ENDIAN {
            0 => u16::from_be_bytes([*first, *second]),
            _ => u16::from_le_bytes([*first, *second]),
        };
        // The last submessage may have the length 0.
        let length = if length == 0 {
            rest.len()
        } else {
            length.into()
        };
        submessages = rest.get(length..).unwrap_or_default();
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_participant_with_the_usual_ports_listens_for_announcements_beside_its_data() {
        let of = |port| discovery_address(3, (Ipv4Addr::LOCALHOST, port).into());
        let address = |port| Some((Ipv4Addr::LOCALHOST, port).into());
        assert_eq!(of(7400 + 750 + 11), address(7400 + 750 + 10));
        assert_eq!(
            of(7400 + 750 + 11 + 2 * 7),
            address(7400 + 750 + 10 + 2 * 7)
        );
        assert_eq!(of(7400 + 750 + 10), None);
        assert_eq!(of(7400 + 11), None);
        assert_eq!(of(7400 + 1000 + 11), None);
        assert_eq!(of(0), None);
    }

    #[test]
    fn peers_are_addresses_or_host_names() {
        let peers =
            |names: &[&str]| addresses(&names.iter().map(|&name| name.into()).collect::<Vec<_>>());
        let localhost = Ipv4Addr::LOCALHOST;
        assert_eq!(peers(&["127.0.0.1", "localhost"]), Ok(vec![localhost]));
        assert_eq!(
            peers(&["127.0.0.2", "127.0.0.1"]),
            Ok(vec![localhost, Ipv4Addr::new(127, 0, 0, 2)])
        );
        for (peer, expected) in [
            ("::1", "static peer \"::1\" has no IPv4 address"),
            ("127.0.0.1:7400", "static peer \"127.0.0.1:7400\": "),
            ("no such host", "static peer \"no such host\": "),
        ] {
            let error = peers(&[peer]).unwrap_err();
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn only_announcements_of_the_own_participant_go_on() {
        let message = |prefix: u8, submessages: &[&[u8]]| {
            let mut message = b"RTPS\x02\x04\x01\x12".to_vec();
            message.extend([prefix; 12]);
            message.extend(submessages.concat());
            message
        };
        let timestamp: &[u8] = &[0x09, 0x01, 8, 0, 1, 2, 3, 4, 5, 6, 7, 8];
        let big_endian: &[u8] = &[0x09, 0x00, 0, 8, 1, 2, 3, 4, 5, 6, 7, 8];
        let data: &[u8] = &[0x15, 0x05, 0, 0, 1, 2, 3];
        let farewell: &[u8] = &[0x15, 0x09, 0, 0, 1, 2, 3];
        for (message, expected) in [
            (message(7, &[timestamp, data]), true),
            (message(7, &[big_endian, data]), true),
            (message(7, &[data]), true),
            (message(8, &[data]), false),
            (message(7, &[timestamp, farewell]), false),
            (message(7, &[timestamp]), false),
            (message(7, &[&[0x09, 0x01, 0xff, 0xff, 0]]), false),
            (message(7, &[]), false),
            (b"RTPS".to_vec(), false),
            (Vec::new(), false),
        ] {
            assert_eq!(announces(&message, &[7; 12]), expected, "{message:x?}");
        }
    }
}
