//! How receiving ends.

use std::time::{Duration, Instant};

use lgvi_middleware::Shutdown;
use lgvi_node::NodeError;

/// How often a source looks for messages when there are none.
const IDLE: Duration = Duration::from_micros(500);

/// How long a source must be silent before it is taken to be drained.
const SILENCE: Duration = Duration::from_millis(100);

/// How long it is waited for after the shutdown. What is left of a second is for closing the bag and the node.
const DEADLINE: Duration = Duration::from_millis(400);

/// Runs `poll` until the shutdown and after it until it has been silent for a while, but not for long.
///
/// `poll` takes what has arrived, within limits, and says whether that was anything.
pub(crate) fn drain(
    shutdown: &Shutdown,
    mut poll: impl FnMut() -> Result<bool, NodeError>,
) -> Result<(), NodeError> {
    let mut heard = Instant::now();
    let mut requested = None;
    loop {
        if requested.is_none() && shutdown.requested() {
            requested = Some(Instant::now());
        }
        // Decided before the last poll, which takes all that has arrived by then.
        let last = requested.is_some_and(|requested| requested.elapsed() >= DEADLINE);
        if poll()? {
            heard = Instant::now();
        } else if requested.is_some() && heard.elapsed() >= SILENCE {
            return Ok(());
        } else {
            std::thread::sleep(IDLE);
        }
        if last {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_that_never_falls_silent_is_left() {
        let shutdown = Shutdown::new();
        shutdown.request();
        let start = Instant::now();
        drain(&shutdown, || {
            std::thread::sleep(IDLE);
            Ok(true)
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
            Ok(due && found < 4)
        })
        .unwrap();
        assert_eq!(found, 4);
    }
}
