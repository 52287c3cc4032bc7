//! How receiving goes on and ends.

use std::thread;
use std::time::{Duration, Instant};

use lgvi_middleware::Shutdown;
use lgvi_middleware::node::NodeError;

/// How often a source that is to end looks for messages.
const IDLE: Duration = Duration::from_micros(500);

/// How long a source must be silent before it is taken to be drained.
const SILENCE: Duration = Duration::from_millis(100);

/// How long it is waited for after the shutdown. What is left of a second is for closing the bag and the node.
const DEADLINE: Duration = Duration::from_millis(400);

/// What a look at a source has come to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Looked {
    /// Whether there was anything.
    pub(crate) found: bool,
    /// How long to wait before the next look. Where nothing was found, unparking the thread ends it.
    pub(crate) pause: Duration,
    /// Whether nobody takes anything any more: the last look was this.
    pub(crate) over: bool,
}

/// Calls `look` until the shutdown and after it until it has found nothing for a while, but not for long. Who raises the
/// shutdown unparks the thread.
///
/// `look` takes what has arrived, within limits.
pub(crate) fn drain(
    shutdown: &Shutdown,
    mut look: impl FnMut() -> Result<Looked, NodeError>,
) -> Result<(), NodeError> {
    let mut heard = Instant::now();
    let mut requested = None;
    loop {
        if requested.is_none() && shutdown.requested() {
            requested = Some(Instant::now());
        }
        // Decided before the last look, which takes all that has arrived by then.
        let last = requested.is_some_and(|requested| requested.elapsed() >= DEADLINE);
        let Looked { found, pause, over } = look()?;
        if over {
            return Ok(());
        }
        if found {
            heard = Instant::now();
        } else if requested.is_some() && heard.elapsed() >= SILENCE {
            return Ok(());
        }
        if last {
            return Ok(());
        }
        match requested {
            Some(_) if found => {}
            Some(_) => thread::sleep(IDLE),
            None if found => thread::sleep(pause),
            None => thread::park_timeout(pause),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looked(found: bool) -> Result<Looked, NodeError> {
        Ok(Looked {
            found,
            pause: IDLE,
            over: false,
        })
    }

    #[test]
    fn who_has_nobody_to_hand_over_to_ends_by_itself() {
        let mut looks = 0;
        drain(&Shutdown::new(), || {
            looks += 1;
            looked(true).map(|looked| Looked {
                over: looks == 3,
                ..looked
            })
        })
        .unwrap();
        assert_eq!(looks, 3);
    }

    #[test]
    fn a_source_that_never_falls_silent_is_left() {
        let shutdown = Shutdown::new();
        shutdown.request();
        let start = Instant::now();
        drain(&shutdown, || {
            thread::sleep(IDLE);
            looked(true)
        })
        .unwrap();
        let took = start.elapsed();
        assert!((DEADLINE..5 * DEADLINE).contains(&took), "{took:?}");
    }

    #[test]
    fn what_comes_soon_after_the_request_is_taken() {
        let shutdown = Shutdown::new();
        shutdown.request();
        let start = Instant::now();
        let mut found = 0;
        drain(&shutdown, || {
            let due = start.elapsed() >= found * SILENCE / 2;
            found += u32::from(due && found < 4);
            looked(due && found < 4)
        })
        .unwrap();
        assert_eq!(found, 4);
    }
}
