use thiserror::Error;

/// Most threads.
const MOST: usize = 1024;

/// More threads than a sweep or an ensemble is flown by.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("{0} threads, expected at most {MOST}")]
pub struct TooManyThreads(usize);

/// Checks the number of threads that a sweep or an ensemble is to be flown by.
///
/// # Errors
/// More than 1024.
pub fn check_threads(threads: usize) -> Result<(), TooManyThreads> {
    match threads {
        ..=MOST => Ok(()),
        threads => Err(TooManyThreads(threads)),
    }
}
