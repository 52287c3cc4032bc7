//! Samples that a reliable publisher overwrites although a subscription has not received them.
//!
//! A reliable RustDDS 0.15 writer keeps what any matched reader has not acknowledged and takes no more once its window is
//! full: one reader that is stopped holds up all. ROS 2 expects of a writer that keeps the last samples that it overwrites
//! the oldest instead. So the writer is told, by an ACKNACK in the reader's name, that the reader has them; and the
//! reader, once it is back, is told by GAPs that it will not get them, and asks for those that follow.

use std::{
    collections::{BTreeMap, BTreeSet},
    io,
    net::{Ipv4Addr, SocketAddr, UdpSocket},
    sync::{
        Mutex,
        atomic::{AtomicBool, AtomicI32, Ordering},
    },
    time::{Duration, Instant},
};

use rustdds::{DomainParticipant, GUID};

use super::{matches::Matches, peers::discovery_port, rtps};
use crate::sync::lock;

/// How often a reader that samples were overwritten for is told so, until it has caught up.
pub(super) const REMINDER: Duration = Duration::from_millis(100);

/// The prefix that all endpoints of a participant have.
type Participant = [u8; 12];

/// A matched reliable reader.
#[derive(Debug, Clone)]
pub(super) struct RemoteReader {
    pub(super) guid: GUID,
    pub(super) locators: Vec<SocketAddr>,
}

/// Who does not keep up, and what has been overwritten for them.
#[derive(Debug)]
pub(super) struct Laggards {
    socket: UdpSocket,
    /// Where the participant itself listens.
    own: SocketAddr,
    /// Of acknowledgments, as RTPS wants to tell them apart.
    count: AtomicI32,
    suspects: Mutex<BTreeSet<Participant>>,
    gaps: Mutex<Gaps>,
    any_gaps: AtomicBool,
    /// Whether messages to the participant itself, which are not encrypted, would be refused, but for those about
    /// participants.
    secured: bool,
}

/// By local writer, and by reader: before which sample there will be none.
#[derive(Debug, Default)]
struct Gaps {
    of: BTreeMap<GUID, BTreeMap<GUID, (i64, Vec<SocketAddr>)>>,
    reminded: Option<Instant>,
}

impl Laggards {
    /// `secured`: the participant has DDS security.
    pub(super) fn new(
        participant: &DomainParticipant,
        loopback_only: bool,
        secured: bool,
    ) -> io::Result<Self> {
        let from = if loopback_only {
            Ipv4Addr::LOCALHOST
        } else {
            Ipv4Addr::UNSPECIFIED
        };
        let socket = UdpSocket::bind((from, 0))?;
        // The one that RustDDS takes without exception.
        let port = discovery_port(participant.domain_id(), participant.participant_id());
        socket.set_nonblocking(true)?;
        Ok(Self {
            socket,
            own: (Ipv4Addr::LOCALHOST, port).into(),
            count: AtomicI32::new(i32::MIN),
            suspects: Mutex::default(),
            gaps: Mutex::default(),
            any_gaps: AtomicBool::new(false),
            secured,
        })
    }

    /// Whether nothing can be overwritten.
    pub(super) fn is_secured(&self) -> bool {
        self.secured
    }

    /// Has a writer forget what it keeps for a reader before a sample, and tells the reader.
    pub(super) fn overwrite(&self, writer: GUID, reader: &RemoteReader, before: i64) {
        let count = self.count.fetch_add(1, Ordering::Relaxed);
        let message = rtps::acknowledgment(writer, reader.guid, before, count);
        // What is lost is sent again with the next sample that finds no room.
        self.send_home(&message);
        let mut gaps = lock(&self.gaps);
        let gap = (before, reader.locators.clone());
        self.tell(writer, reader.guid, &gap);
        gaps.of.entry(writer).or_default().insert(reader.guid, gap);
        gaps.reminded = Some(Instant::now());
        self.any_gaps.store(true, Ordering::Release);
    }

    /// Whether samples of a writer were overwritten and not all its readers have caught up since.
    pub(super) fn has_gaps(&self, writer: GUID) -> bool {
        self.any_gaps.load(Ordering::Acquire) && lock(&self.gaps).of.contains_key(&writer)
    }

    /// Takes note that all readers of a writer have caught up, or that it is gone.
    pub(super) fn close_gaps(&self, writer: GUID) {
        if self.any_gaps.load(Ordering::Acquire) {
            let mut gaps = lock(&self.gaps);
            gaps.of.remove(&writer);
            self.any_gaps.store(!gaps.of.is_empty(), Ordering::Release);
        }
    }

    /// Tells the readers again of what was overwritten; to be called often. Returns when to call it at the latest.
    pub(super) fn remind(&self, matches: &Matches) -> Option<Duration> {
        if !self.any_gaps.load(Ordering::Acquire) {
            return None;
        }
        let mut gaps = lock(&self.gaps);
        let elapsed = gaps.reminded.map_or(REMINDER, |last| last.elapsed());
        if elapsed < REMINDER {
            return Some(REMINDER - elapsed);
        }
        gaps.reminded = Some(Instant::now());
        gaps.of.retain(|writer, readers| {
            let matched = matches.of(*writer);
            readers.retain(|reader, gap| {
                let listens = matched.contains(reader);
                if listens {
                    self.tell(*writer, *reader, gap);
                }
                listens
            });
            !readers.is_empty()
        });
        self.any_gaps.store(!gaps.of.is_empty(), Ordering::Release);
        Some(REMINDER)
    }

    /// Whether a reader's participant has not kept up before.
    pub(super) fn suspects(&self, reader: GUID) -> bool {
        lock(&self.suspects).contains(&participant(reader))
    }

    /// Whether any of these readers' participants has not kept up before.
    pub(super) fn suspects_any(&self, readers: &BTreeSet<GUID>) -> bool {
        let suspects = lock(&self.suspects);
        !suspects.is_empty()
            && readers
                .iter()
                .any(|reader| suspects.contains(&participant(*reader)))
    }

    /// Waits no longer than needed for a reader's participant from now on; returns whether that is new.
    pub(super) fn suspect(&self, reader: GUID) -> bool {
        lock(&self.suspects).insert(participant(reader))
    }

    /// Waits for a reader's participant again.
    pub(super) fn pardon(&self, reader: GUID) {
        lock(&self.suspects).remove(&participant(reader));
    }

    /// Forgets the participants for which this is not so.
    pub(super) fn retain(&self, stays: impl Fn(GUID) -> bool) {
        lock(&self.suspects).retain(|suspect| {
            let mut bytes = [0; 16];
            bytes[..12].copy_from_slice(suspect);
            stays(GUID::from_bytes(bytes))
        });
    }

    /// Sends a message of the participant's.
    pub(super) fn send(&self, message: &[u8], to: impl IntoIterator<Item = SocketAddr>) {
        for address in to {
            // UDP: it may be lost on any way.
            let _ = self.socket.send_to(message, address);
        }
    }

    /// Sends a message to the participant itself.
    pub(super) fn send_home(&self, message: &[u8]) {
        self.send(message, [self.own]);
    }

    fn tell(&self, writer: GUID, reader: GUID, (before, locators): &(i64, Vec<SocketAddr>)) {
        let message = rtps::gap(writer, reader, *before);
        // It is sent again until it has an effect.
        self.send(&message, locators.iter().copied());
    }
}

/// The prefix of an endpoint's participant.
pub(super) fn participant(endpoint: GUID) -> Participant {
    let mut prefix = Participant::default();
    prefix.copy_from_slice(&endpoint.to_bytes()[..12]);
    prefix
}
