//! The machine-readable channel from a node to the process that started it: one JSON object a line.

use std::{
    fmt,
    io::{self, BufRead, Write},
    marker::PhantomData,
    sync::{Mutex, PoisonError},
};

use serde::{Serialize, de::DeserializeOwned};

/// Writes reports of one type, each flushed at once; cheap when disabled.
pub struct Reporter<T> {
    sink: Option<Mutex<Box<dyn Write + Send>>>,
    reports: PhantomData<fn(&T)>,
}

/// A line that is not a report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The line cannot be read.
    #[error("cannot read a report")]
    Read(#[from] io::Error),
    /// The line is not JSON of the expected form.
    #[error("not a report: {line:?}")]
    Parse {
        /// The line.
        line: String,
        /// What is wrong with it.
        source: serde_json::Error,
    },
}

impl<T: Serialize> Reporter<T> {
    /// Reports to standard output, which must carry nothing else.
    pub fn stdout() -> Self {
        Self::to_writer(io::stdout())
    }

    /// Reports to any writer.
    pub fn to_writer(writer: impl Write + Send + 'static) -> Self {
        Self {
            sink: Some(Mutex::new(Box::new(writer))),
            reports: PhantomData,
        }
    }

    /// Discards all reports: nobody asked for them.
    pub fn disabled() -> Self {
        Self {
            sink: None,
            reports: PhantomData,
        }
    }

    /// Writes one report; fails if the reader has gone.
    pub fn report(&self, report: &T) -> io::Result<()> {
        let Some(sink) = &self.sink else {
            return Ok(());
        };
        let mut line = serde_json::to_vec(report)?;
        line.push(b'\n');
        let mut sink = sink.lock().unwrap_or_else(PoisonError::into_inner);
        sink.write_all(&line)?;
        sink.flush()
    }
}

impl<T> fmt::Debug for Reporter<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reporter")
            .field("enabled", &self.sink.is_some())
            .finish_non_exhaustive()
    }
}

/// Reads reports line by line until the end; blank lines are skipped, a bad line does not end the reading.
pub fn read_reports<T: DeserializeOwned>(
    reader: impl BufRead,
) -> impl Iterator<Item = Result<T, ReportError>> {
    reader
        .lines()
        .filter(|line| !line.as_ref().is_ok_and(|line| line.trim().is_empty()))
        .map(|line| {
            let line = line?;
            serde_json::from_str(&line).map_err(|source| ReportError::Parse { line, source })
        })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use serde::Deserialize;

    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(tag = "event", rename_all = "snake_case")]
    enum Report {
        Ready { node: String },
        Progress { done: u64, total: u64 },
    }

    #[derive(Clone, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn reports_survive_the_channel() {
        let written = Shared::default();
        let reporter = Reporter::to_writer(written.clone());
        let ready = Report::Ready {
            node: "/lgvi\n".into(),
        };
        let progress = Report::Progress { done: 1, total: 2 };
        reporter.report(&ready).unwrap();
        reporter.report(&progress).unwrap();
        let text = String::from_utf8(written.0.lock().unwrap().clone()).unwrap();
        assert_eq!(
            text,
            "{\"event\":\"ready\",\"node\":\"/lgvi\\n\"}\n{\"event\":\"progress\",\"done\":1,\"total\":2}\n"
        );
        let read: Vec<Report> = read_reports(text.as_bytes()).map(Result::unwrap).collect();
        assert_eq!(read, [ready, progress]);
    }

    #[test]
    fn a_bad_line_is_reported_and_skipped() {
        let text = "nonsense\n\n{\"event\":\"progress\",\"done\":1,\"total\":2}\n";
        let read: Vec<_> = read_reports::<Report>(text.as_bytes()).collect();
        assert!(matches!(&read[0], Err(ReportError::Parse { line, .. }) if line == "nonsense"));
        assert!(matches!(
            read[1],
            Ok(Report::Progress { done: 1, total: 2 })
        ));
        assert_eq!(read.len(), 2);
    }
}
