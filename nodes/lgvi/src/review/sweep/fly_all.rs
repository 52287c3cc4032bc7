use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::Combination;

/// How often `go_on` is asked.
const LOOK: Duration = Duration::from_millis(50);

/// Flies all combinations on so many threads, or one a core for 0, and returns the flights in their order.
///
/// `fly` flies the combination of an index; it asks what it is handed whether it is to go on. `go_on` is told how many are
/// flown, on the calling thread, and ends the sweep by false.
///
/// # Errors
/// The first error of `fly` in the order of the combinations. `Ok(None)` if the sweep was ended.
pub fn fly_all<T: Send, E: Send>(
    combinations: &[Combination],
    threads: usize,
    fly: impl Fn(usize, &Combination, &dyn Fn() -> bool) -> Result<Option<T>, E> + Sync,
    mut go_on: impl FnMut(usize) -> bool,
) -> Result<Option<Vec<T>>, E> {
    let threads = match threads {
        0 => thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    let next = AtomicUsize::new(0);
    let ended = AtomicBool::new(false);
    let goes_on = || !ended.load(Ordering::Relaxed);
    let places: Vec<_> = combinations.iter().map(|_| Mutex::new(None)).collect();
    thread::scope(|scope| {
        let (sender, receiver) = channel();
        for _ in 0..threads.min(combinations.len()) {
            let (fly, next, places, sender) = (&fly, &next, &places, sender.clone());
            scope.spawn(move || {
                while goes_on() {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(combination) = combinations.get(index) else {
                        return;
                    };
                    let flown = fly(index, combination, &goes_on);
                    *places[index].lock().unwrap_or_else(PoisonError::into_inner) = Some(flown);
                    // Nobody listens to a sweep that has been ended.
                    let _ = sender.send(());
                }
            });
        }
        drop(sender);
        let mut flown = 0;
        while go_on(flown) {
            match receiver.recv_timeout(LOOK) {
                Ok(()) => flown += 1 + receiver.try_iter().count(),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
        ended.store(true, Ordering::Relaxed);
    });
    let flown = places.into_iter().map(|place| {
        let place = place.into_inner().unwrap_or_else(PoisonError::into_inner);
        place.unwrap_or(Ok(None))
    });
    flown.collect()
}
