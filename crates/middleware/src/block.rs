//! Waiting on the calling thread, for a bounded time.

use std::{
    pin::pin,
    sync::Arc,
    task::{Context, Poll, Wake, Waker},
    thread::{self, Thread},
    time::{Duration, Instant},
};

/// Wakes a parked thread.
struct Unpark(Thread);

impl Wake for Unpark {
    fn wake(self: Arc<Self>) {
        self.0.unpark();
    }
}

/// A waker that unparks the calling thread.
pub fn thread_waker() -> Waker {
    Arc::new(Unpark(thread::current())).into()
}

/// When waiting ends; never, if that is later than any time.
#[derive(Clone, Copy)]
pub(crate) struct Deadline(Option<Instant>);

impl Deadline {
    pub(crate) fn after(limit: Duration) -> Self {
        Self(Instant::now().checked_add(limit))
    }

    /// The time until then, zero once it has passed.
    pub(crate) fn left(self) -> Duration {
        self.0.map_or(Duration::MAX, |end| {
            end.saturating_duration_since(Instant::now())
        })
    }
}

/// Polls a future until it is ready or the limit has passed, at least once; `None` if it is not ready then.
pub(crate) fn block_on_for<F: Future>(future: F, limit: Duration) -> Option<F::Output> {
    let deadline = Deadline::after(limit);
    let mut future = pin!(future);
    let waker = thread_waker();
    let mut context = Context::from_waker(&waker);
    loop {
        if let Poll::Ready(output) = future.as_mut().poll(&mut context) {
            return Some(output);
        }
        match deadline.left() {
            Duration::ZERO => return None,
            left => thread::park_timeout(left),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::future;

    use super::*;

    #[test]
    fn a_ready_future_needs_no_time() {
        assert_eq!(block_on_for(future::ready(1), Duration::ZERO), Some(1));
    }

    #[test]
    fn the_longest_limit_is_no_limit() {
        assert_eq!(Deadline::after(Duration::MAX).left(), Duration::MAX);
        assert_eq!(Deadline::after(Duration::ZERO).left(), Duration::ZERO);
    }

    #[test]
    fn the_limit_is_kept() {
        let limit = Duration::from_millis(30);
        let start = Instant::now();
        assert_eq!(block_on_for(future::pending::<()>(), limit), None);
        assert!(start.elapsed() >= limit);
        assert!(start.elapsed() < Duration::from_secs(5));
    }
}
