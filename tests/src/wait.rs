//! Waiting, never for ever.

use std::thread;
use std::time::{Duration, Instant};

/// How long anything may take, unless a test says otherwise.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// How often is looked.
const CYCLE: Duration = Duration::from_millis(10);

/// Looks until there is what is awaited, and panics after [`PATIENCE`].
#[track_caller]
pub fn eventually<T>(awaited: &str, look: impl FnMut() -> Option<T>) -> T {
    within(PATIENCE, awaited, look)
}

/// Looks until there is what is awaited, and panics when the time has passed.
///
/// What the processes of the test have printed follows the panic: their [`World`](crate::World) prints it.
#[track_caller]
pub fn within<T>(time: Duration, awaited: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(
            start.elapsed() < time,
            "waited {time:?} in vain for {awaited}"
        );
        thread::sleep(CYCLE);
    }
}

/// What something is once it has not changed for a while: what was under way has arrived.
#[track_caller]
pub fn settled<T: PartialEq>(mut look: impl FnMut() -> T) -> T {
    const QUIET: Duration = Duration::from_millis(500);
    let (mut latest, mut since) = (look(), Instant::now());
    eventually("an end of what is under way", || {
        let now = look();
        if now != latest {
            (latest, since) = (now, Instant::now());
        }
        (since.elapsed() >= QUIET).then_some(())
    });
    latest
}
