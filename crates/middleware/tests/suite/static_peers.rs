//! Hosts that are told of a node without multicast.

use std::{
    io::ErrorKind,
    net::UdpSocket,
    time::{Duration, Instant},
};

use lgvi_middleware::{Environment, NodeArgs, ros::RosNode};

use crate::common::{isolated, node};

/// A place that RustDDS does not announce to by itself: it does so to the first twelve on 127.0.0.1.
const PLACE: u16 = 20;

/// Another host's participant, as far as discovery can tell.
fn peer(environment: &Environment) -> UdpSocket {
    let port = 7400 + 250 * environment.domain_id + 10 + 2 * PLACE;
    let peer = UdpSocket::bind(("127.0.0.2", port)).unwrap();
    peer.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
    peer
}

/// The prefix of the GUID in the next RTPS message.
fn announced(peer: &UdpSocket) -> Option<Vec<u8>> {
    let mut message = [0; 65_536];
    match peer.recv(&mut message) {
        Ok(length) => {
            assert!(message[..length].starts_with(b"RTPS"));
            Some(message[8..20].to_vec())
        }
        Err(error) if error.kind() == ErrorKind::WouldBlock => None,
        Err(error) => panic!("{error}"),
    }
}

fn with_peer() -> (Environment, UdpSocket) {
    let environment = Environment {
        static_peers: vec!["127.0.0.2".into()],
        ..isolated()
    };
    let peer = peer(&environment);
    (environment, peer)
}

#[test]
fn peers_are_told_of_a_node_again_and_again() {
    let (environment, peer) = with_peer();
    let begin = Instant::now();
    let _node = node("alone", &environment);
    let first = announced(&peer).expect("an announcement");
    for _ in 0..2 {
        assert_eq!(announced(&peer), Some(first.clone()), "a repetition");
    }
    // RustDDS itself repeats its announcement after 10 s.
    assert!(begin.elapsed() < Duration::from_secs(8));
}

#[test]
fn peers_are_told_of_no_other_node() {
    let (environment, peer) = with_peer();
    let _other = node("other", &Environment::localhost(environment.domain_id));
    let _own = node("own", &environment);
    let own = announced(&peer).expect("an announcement");
    peer.set_read_timeout(Some(Duration::from_millis(300)))
        .unwrap();
    while let Some(prefix) = announced(&peer) {
        assert_eq!(prefix, own);
    }
}

#[test]
fn without_peers_nobody_is_told() {
    let environment = isolated();
    let peer = peer(&environment);
    peer.set_read_timeout(Some(Duration::from_secs(1))).unwrap();
    let _node = node("alone", &environment);
    assert_eq!(announced(&peer), None);
}

#[test]
fn a_peer_without_an_address_is_refused_by_its_name() {
    let environment = Environment {
        static_peers: vec!["no-such-host.invalid".into()],
        ..isolated()
    };
    let (args, _) = NodeArgs::parse("node", []).unwrap();
    let error = RosNode::new(&args, &environment).unwrap_err().to_string();
    assert!(
        error.contains("static peer \"no-such-host.invalid\": "),
        "{error}"
    );
}
