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

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;
    use std::thread::ThreadId;

    use super::*;
    use crate::sweep::{Variation, combinations};

    fn of(count: usize) -> Vec<Combination> {
        combinations(&[Variation {
            key: "run.steps".into(),
            values: (0..count).map(|index| index.to_string()).collect(),
        }])
        .unwrap()
    }

    fn number(combination: &Combination) -> usize {
        combination.settings()[0].1.parse().unwrap()
    }

    #[test]
    fn flights_come_in_the_order_of_the_combinations_and_are_counted_by_the_caller() {
        for threads in [0, 1, 3, 50] {
            let mut told: Vec<(usize, ThreadId)> = Vec::new();
            let flown = fly_all::<_, ()>(
                &of(20),
                threads,
                |index, combination, _| {
                    assert_eq!(index, number(combination));
                    Ok(Some(index * index))
                },
                |count| {
                    told.push((count, thread::current().id()));
                    true
                },
            );
            let squares: Vec<_> = (0..20).map(|index| index * index).collect();
            assert_eq!(flown, Ok(Some(squares)));
            assert!(told.is_sorted_by_key(|(count, _)| *count));
            assert_eq!(told.last(), Some(&(20, thread::current().id())));
        }
        let none = fly_all::<(), ()>(&[], 2, |_, _, _| Ok(None), |_| true);
        assert_eq!(none, Ok(Some(vec![])));
    }

    #[test]
    fn the_error_is_the_first_in_the_order_of_the_combinations_whichever_came_first() {
        let (sender, receiver) = sync_channel(1);
        let receiver = Mutex::new(receiver);
        let flown = fly_all::<(), _>(
            &of(8),
            2,
            |index, _, _| match index {
                // The error of 3 comes after that of 5.
                3 => {
                    receiver.lock().unwrap().recv().unwrap();
                    Err(index)
                }
                5 => {
                    sender.send(()).unwrap();
                    Err(index)
                }
                _ => Ok(Some(())),
            },
            |_| true,
        );
        assert_eq!(flown, Err(3));
    }

    #[test]
    fn a_sweep_that_is_ended_ends_the_flights_on_their_way() {
        let flown = fly_all::<_, ()>(
            &of(1000),
            2,
            |index, _, go_on| {
                if index < 4 {
                    return Ok(Some(index));
                }
                while go_on() {
                    thread::yield_now();
                }
                Ok(None)
            },
            |count| count < 4,
        );
        assert_eq!(flown, Ok(None));
    }
}
