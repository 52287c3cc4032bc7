//! Endpoints are made one at a time, each once RustDDS is done with the one before.
//!
//! RustDDS 0.15 may come to a standstill otherwise. When its discovery thread hears of a new endpoint, it holds the
//! database of endpoints while it tells the event loop of the counterparts, in a queue of 32. The event loop cannot take
//! them as soon as it wants to look into the database itself while somebody waits to write to it, who waits for the
//! discovery thread. Only making an endpoint writes to it from outside.
//!
//! When the discovery thread is done shows by a participant that has never been there: the node is told of its
//! departure, and the discovery thread reports that. The event loop may pass on the first departure before it has taken
//! the new endpoint, but not the second one. The discovery thread may read that before it hears of the new endpoint, as it
//! reads departures one after the other as they come. So one that it cannot read comes before: then it looks for what
//! else it has been told, before it reads on.

use std::{
    sync::{Arc, Condvar, Mutex},
    time::Duration,
};

use rustdds::{
    DomainParticipantStatusEvent as Event, GUID,
    dds::result::{CreateError, CreateResult},
};

use super::{
    descriptors::{self, TooFew},
    laggards::Laggards,
    rtps,
};
use crate::{
    block::Deadline,
    sync::{lock, wait_while},
};

/// How many departures prove that what came before the first of them is done.
const ROUNDS: usize = 2;

/// When a departure is told again, and after twice as long each time up to the last: it may be lost or passed over.
const REPETITIONS: [Duration; 2] = [Duration::from_millis(2), Duration::from_millis(50)];

/// How long RustDDS may take. It has much to do while many participants start at once.
const PATIENCE: Duration = Duration::from_secs(20);

/// What the identities of the participants that have never been there begin with. No vendor has this number.
const NOBODY: [u8; 4] = [0xff; 4];

/// RustDDS does not get on with what it has been told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "DDS discovery has not answered for {waited:?}: its threads have ended or hang, the node must be started again"
)]
pub(super) struct Standstill {
    waited: Duration,
}

/// An endpoint that cannot be made.
#[derive(Debug, thiserror::Error)]
pub(super) enum MakeError {
    #[error(transparent)]
    Dds(#[from] CreateError),
    #[error(transparent)]
    Standstill(#[from] Standstill),
    #[error(transparent)]
    Files(#[from] TooFew),
}

/// Lets one thread at a time make an endpoint.
#[derive(Debug)]
pub(super) struct Fence {
    participant: GUID,
    laggards: Arc<Laggards>,
    turn: Mutex<Turn>,
    awaited: Mutex<Option<GUID>>,
    reported: Condvar,
}

#[derive(Debug, Default)]
struct Turn {
    departures: u64,
    standstill: Option<Standstill>,
}

impl Fence {
    pub(super) fn new(participant: GUID, laggards: Arc<Laggards>) -> Self {
        Self {
            participant,
            laggards,
            turn: Mutex::default(),
            awaited: Mutex::default(),
            reported: Condvar::new(),
        }
    }

    /// Makes an endpoint, and waits until RustDDS is done with it.
    pub(super) fn make<E>(&self, create: impl FnOnce() -> CreateResult<E>) -> Result<E, MakeError> {
        let mut turn = lock(&self.turn);
        if let Some(standstill) = turn.standstill {
            return Err(standstill.into());
        }
        descriptors::spare(descriptors::ENDPOINT)?;
        let endpoint = create()?;
        self.wait(&mut turn)?;
        Ok(endpoint)
    }

    /// Waits until RustDDS is done with the endpoints that there are, among them its own.
    pub(super) fn settle(&self) -> Result<(), Standstill> {
        self.wait(&mut lock(&self.turn))
    }

    fn wait(&self, turn: &mut Turn) -> Result<(), Standstill> {
        for _ in 0..ROUNDS {
            turn.departures += 1;
            if let Err(standstill) = self.pass(turn.departures, PATIENCE) {
                turn.standstill = Some(standstill);
                return Err(standstill);
            }
        }
        Ok(())
    }

    /// Takes note of what DDS reports; returns whether it was for the fence alone.
    pub(super) fn apply(&self, event: &Event) -> bool {
        let Event::ParticipantLost { id, .. } = event else {
            return false;
        };
        let mut lost = self.participant;
        lost.prefix = *id;
        let mut awaited = lock(&self.awaited);
        if awaited.is_some_and(|awaited| awaited.prefix == *id) {
            *awaited = None;
            self.reported.notify_all();
        }
        lost.to_bytes().starts_with(&NOBODY)
    }

    fn pass(&self, departure: u64, patience: Duration) -> Result<(), Standstill> {
        let nobody = nobody(departure);
        let message = rtps::departures(self.participant, nobody);
        let deadline = Deadline::after(patience);
        let [mut repetition, longest] = REPETITIONS;
        let mut awaited = lock(&self.awaited);
        *awaited = Some(nobody);
        while awaited.is_some() {
            if deadline.left().is_zero() {
                *awaited = None;
                return Err(Standstill { waited: patience });
            }
            self.laggards.send_home(&message);
            let limit = repetition.min(deadline.left());
            repetition = longest.min(2 * repetition);
            drop(awaited);
            awaited = wait_while(&self.reported, &self.awaited, limit, |awaited| {
                awaited.is_some()
            });
        }
        Ok(())
    }
}

/// The identity of a participant that has never been there.
fn nobody(number: u64) -> GUID {
    let mut bytes = [0; 16];
    bytes[..4].copy_from_slice(&NOBODY);
    bytes[4..12].copy_from_slice(&number.to_be_bytes());
    // The participant itself among its entities: RTPS 2.5, 9.3.1.2.
    bytes[12..].copy_from_slice(&[0, 0, 1, 0xc1]);
    GUID::from_bytes(bytes)
}

#[cfg(test)]
mod tests {
    use std::{
        net::{IpAddr, Ipv4Addr},
        process,
        sync::atomic::{AtomicBool, Ordering},
        thread,
    };

    use rustdds::{
        DomainParticipant, DomainParticipantBuilder, DomainParticipantStatusListener, RTPSEntity,
        StatusEvented, dds::statusevents::LostReason,
    };

    use super::*;

    fn participant() -> DomainParticipant {
        let builder = DomainParticipantBuilder::new(1 + (process::id() % 101) as u16);
        let networks = [IpAddr::V4(Ipv4Addr::LOCALHOST)];
        builder.with_only_networks(networks).build().unwrap()
    }

    fn fence(participant: &DomainParticipant) -> Fence {
        let laggards = Arc::new(Laggards::new(participant, true, false).unwrap());
        Fence::new(participant.guid(), laggards)
    }

    /// Has a fence hear what RustDDS reports while something is done.
    fn hearing<T>(
        fence: &Fence,
        listener: &DomainParticipantStatusListener,
        act: impl FnOnce() -> T,
    ) -> T {
        let done = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| {
                while !done.load(Ordering::Acquire) {
                    match listener.try_recv_status() {
                        Some(event) => drop(fence.apply(&event)),
                        None => thread::yield_now(),
                    }
                }
            });
            let result = act();
            done.store(true, Ordering::Release);
            result
        })
    }

    #[test]
    fn rustdds_reports_departures_of_those_who_have_never_been_there() {
        let participant = participant();
        let (fence, listener) = (fence(&participant), participant.status_listener());
        hearing(&fence, &listener, || {
            for number in 0..20 {
                assert_eq!(fence.make(|| Ok(number)).unwrap(), number);
            }
        });
    }

    #[test]
    fn what_cannot_be_made_is_not_waited_for() {
        let participant = participant();
        let fence = fence(&participant);
        let refused = || CreateError::BadParameter {
            reason: "a test".into(),
        };
        let error = fence.make(|| Err::<(), _>(refused())).unwrap_err();
        assert!(matches!(error, MakeError::Dds(_)), "{error}");
    }

    #[test]
    fn who_gets_no_answer_says_so() {
        let participant = participant();
        let fence = fence(&participant);
        let waited = Duration::from_millis(200);
        assert_eq!(fence.pass(1, waited), Err(Standstill { waited }));
    }

    #[test]
    fn only_departures_of_nobody_are_for_the_fence_alone() {
        let participant = participant();
        let fence = fence(&participant);
        let lost = |guid: GUID| Event::ParticipantLost {
            id: guid.prefix,
            reason: LostReason::Disposed,
        };
        assert!(fence.apply(&lost(nobody(7))));
        assert!(!fence.apply(&lost(participant.guid())));
    }
}
