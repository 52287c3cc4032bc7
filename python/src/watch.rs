//! Progress and signals while the interpreter is released.

use std::time::{Duration, Instant};

use pyo3::prelude::*;

/// How often it is looked at most.
const EVERY: Duration = Duration::from_millis(50);

/// Tells a callback of progress, and notices signals such as that of Ctrl-C.
pub(crate) struct Watch {
    progress: Option<Py<PyAny>>,
    last: Instant,
    error: Option<PyErr>,
}

impl Watch {
    /// Begins. `progress` is called with the completed fraction, 0 to 1.
    pub(crate) fn new(progress: Option<Py<PyAny>>) -> Self {
        Self {
            progress,
            last: Instant::now(),
            error: None,
        }
    }

    /// Looks, unless that was done a moment ago, and returns true if the work is to go on.
    #[inline]
    pub(crate) fn go_on(&mut self, fraction: f64) -> bool {
        if self.error.is_none() && self.last.elapsed() >= EVERY {
            self.look(fraction);
        }
        self.error.is_none()
    }

    #[cold]
    fn look(&mut self, fraction: f64) {
        let looked = Python::attach(|py| {
            py.check_signals()?;
            match &self.progress {
                Some(progress) => progress.call1(py, (fraction,)).map(drop),
                None => Ok(()),
            }
        });
        self.error = looked.err();
        self.last = Instant::now();
    }

    /// Ends: returns the exception of a signal or of the callback, or tells the callback that all is done.
    pub(crate) fn end(self, py: Python<'_>) -> PyResult<()> {
        match (self.error, self.progress) {
            (Some(error), _) => Err(error),
            (None, Some(progress)) => progress.call1(py, (1.0,)).map(drop),
            (None, None) => Ok(()),
        }
    }

    /// The exception of a signal or of the callback, if one has ended the work.
    pub(crate) fn interrupted(&mut self) -> Option<PyErr> {
        self.error.take()
    }
}
