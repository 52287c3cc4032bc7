//! The machine-readable channel from a node to the process that started it: one JSON object a line.

use std::{
    collections::VecDeque,
    io::{self, BufRead, Write},
    sync::{Arc, Condvar, Mutex},
    thread,
    time::Duration,
};

use lgvi_msgs::excerpt;
use serde::{Serialize, de::DeserializeOwned};

use crate::sync::{lock, wait_while};

/// Writes reports, each flushed at once, from a thread of its own: reporting never waits for the reader.
pub struct Reporter {
    queue: Option<Arc<Queue>>,
}

/// A report, to be rendered by the thread that writes it.
type Report = Box<dyn FnOnce() -> serde_json::Result<Vec<u8>> + Send>;

fn boxed(report: impl Serialize + Send + 'static) -> Report {
    Box::new(move || serde_json::to_vec(&report))
}

/// Reports on their way to the thread.
struct Queue {
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

struct Waiting {
    /// In their order.
    reports: VecDeque<Report>,
    /// The last report of progress, later than those.
    progress: Option<Report>,
    /// A report is being written.
    writing: bool,
    /// Nobody reports any more, or the reader has gone.
    closed: bool,
}

/// A line that is not a report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The line cannot be read.
    #[error("cannot read a report: {0}")]
    Read(#[from] io::Error),
    /// The line is not JSON of the expected form.
    #[error("not a report: {:?}: {source}", excerpt(line))]
    Parse {
        /// The line.
        line: String,
        /// What is wrong with it.
        source: serde_json::Error,
    },
}

impl Reporter {
    /// Reports to a writer, which must carry nothing else.
    pub fn to_writer(writer: impl Write + Send + 'static) -> io::Result<Self> {
        let queue = Arc::new(Queue {
            waiting: Mutex::new(Waiting {
                reports: VecDeque::with_capacity(64),
                progress: None,
                writing: false,
                closed: false,
            }),
            changed: Condvar::new(),
        });
        let written = Arc::clone(&queue);
        thread::Builder::new()
            .name("report".into())
            .spawn(move || written.write(writer))?;
        Ok(Self { queue: Some(queue) })
    }

    /// Discards all reports: nobody asked for them.
    pub fn disabled() -> Self {
        Self { queue: None }
    }

    /// Reports. Every report is written, in order, unless the reader has gone.
    pub fn report(&self, report: impl Serialize + Send + 'static) {
        if let Some(queue) = &self.queue {
            let mut waiting = lock(&queue.waiting);
            if !waiting.closed {
                let progress = waiting.progress.take();
                waiting.reports.extend(progress);
                waiting.reports.push_back(boxed(report));
                queue.changed.notify_all();
            }
        }
    }

    /// Reports progress: where the reader does not keep up, only the last is written. Never waits.
    pub fn progress(&self, report: impl Serialize + Send + 'static) {
        if let Some(queue) = &self.queue
            && let Ok(mut waiting) = queue.waiting.try_lock()
            && !waiting.closed
        {
            waiting.progress = Some(boxed(report));
            queue.changed.notify_all();
        }
    }

    /// Waits until all is written, or given up after `patience`.
    pub fn flush(&self, patience: Duration) {
        if let Some(queue) = &self.queue {
            let under_way =
                |waiting: &mut Waiting| !waiting.closed && (waiting.writing || !waiting.is_empty());
            // Whether it was in vain makes no difference any more.
            drop(wait_while(
                &queue.changed,
                &queue.waiting,
                patience,
                under_way,
            ));
        }
    }
}

impl Waiting {
    fn is_empty(&self) -> bool {
        self.reports.is_empty() && self.progress.is_none()
    }
}

impl Queue {
    /// The next report; none once all are written and no more come.
    fn next(&self) -> Option<Report> {
        lock(&self.waiting).writing = false;
        self.changed.notify_all();
        let idle = |waiting: &mut Waiting| !waiting.closed && waiting.is_empty();
        let mut waiting = wait_while(&self.changed, &self.waiting, Duration::MAX, idle);
        let next = waiting.reports.pop_front();
        let next = next.or_else(|| waiting.progress.take());
        waiting.writing = next.is_some();
        next
    }

    fn close(&self) {
        lock(&self.waiting).closed = true;
        self.changed.notify_all();
    }

    fn write(&self, mut writer: impl Write) {
        while let Some(report) = self.next() {
            if write(&mut writer, report).is_err() {
                break;
            }
        }
        self.close();
    }
}

fn write(writer: &mut impl Write, report: Report) -> io::Result<()> {
    let mut line = report()?;
    line.push(b'\n');
    writer.write_all(&line)?;
    writer.flush()
}

impl Drop for Reporter {
    fn drop(&mut self) {
        if let Some(queue) = &self.queue {
            queue.close();
        }
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
    use std::sync::mpsc::{Receiver, Sender, channel};

    use serde::Deserialize;

    use super::*;

    /// More than any of these tests takes.
    const PATIENCE: Duration = Duration::from_secs(60);

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
        let reporter = Reporter::to_writer(written.clone()).unwrap();
        let ready = Report::Ready {
            node: "/lgvi\n".into(),
        };
        let progress = Report::Progress { done: 1, total: 2 };
        reporter.report(ready.clone());
        reporter.report(progress.clone());
        reporter.flush(PATIENCE);
        let text = String::from_utf8(written.0.lock().unwrap().clone()).unwrap();
        assert_eq!(
            text,
            "{\"event\":\"ready\",\"node\":\"/lgvi\\n\"}\n{\"event\":\"progress\",\"done\":1,\"total\":2}\n"
        );
        let read: Vec<Report> = read_reports(text.as_bytes()).map(Result::unwrap).collect();
        assert_eq!(read, [ready, progress]);
    }

    /// A pipe that takes a write when it is told to.
    struct Full {
        began: Sender<()>,
        room: Receiver<()>,
        written: Shared,
    }

    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let _ = self.began.send(());
            let _ = self.room.recv();
            self.written.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn who_reports_does_not_wait_for_a_reader_that_does_not_read() {
        let (began, beginning) = channel();
        let (make_room, room) = channel();
        let written = Shared::default();
        let pipe = Full {
            began,
            room,
            written: written.clone(),
        };
        let reporter = Reporter::to_writer(pipe).unwrap();
        let ready = Report::Ready { node: "n".into() };
        reporter.report(ready.clone());
        beginning.recv().unwrap();
        // Who waits here waits for ever.
        for done in 0..100_000 {
            reporter.progress(Report::Progress { done, total: 0 });
        }
        let last = Report::Ready { node: "end".into() };
        reporter.report(last.clone());
        drop(make_room);
        reporter.flush(PATIENCE);
        let written = written.0.lock().unwrap().clone();
        let read: Vec<Report> = read_reports(&*written).map(Result::unwrap).collect();
        let progress = Report::Progress {
            done: 99_999,
            total: 0,
        };
        assert_eq!(read, [ready, progress, last]);
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
