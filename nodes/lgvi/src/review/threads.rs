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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_threads_than_there_may_be_are_named() {
        assert_eq!(check_threads(0), Ok(()));
        assert_eq!(check_threads(MOST), Ok(()));
        let refused = check_threads(MOST + 1).unwrap_err();
        assert_eq!(refused.to_string(), "1025 threads, expected at most 1024");
    }
}
