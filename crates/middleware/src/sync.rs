//! Mutexes and condition variables that are used on after another thread has panicked, which has been reported by then.

use std::{
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

/// Locks a mutex.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Locks a mutex once `condition` does not hold or the time has passed; `changed` tells of changes.
pub fn wait_while<'m, T>(
    changed: &Condvar,
    mutex: &'m Mutex<T>,
    timeout: Duration,
    condition: impl FnMut(&mut T) -> bool,
) -> MutexGuard<'m, T> {
    let waited = changed.wait_timeout_while(lock(mutex), timeout, condition);
    waited.unwrap_or_else(PoisonError::into_inner).0
}
