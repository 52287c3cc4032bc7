use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use lgvi_dynamics::lanes::Width;

use crate::queue::{Queue, Unit};
use crate::{Campaign, EnsembleError, Store};

/// Options of a run. They do not affect the results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Samples to fly, or `None` for all.
    pub range: Option<Range<u64>>,
    /// Number of threads, or 0 for one per core.
    pub threads: usize,
    /// Number of samples that fly side by side.
    pub width: Width,
}

/// Progress of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Number of samples that have been flown now or before. Some may belong to parts that are not complete yet.
    pub done: u64,
    /// Number of samples requested.
    pub wanted: u64,
    /// Number of steps of these samples that have been made, including those of samples in flight. A sample that failed
    /// counts like a complete one.
    pub steps: u64,
    /// Number of steps of the requested samples.
    pub wanted_steps: u64,
}

/// Result of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Number of samples that the store already held.
    pub kept: u64,
    /// Number of samples flown by this run.
    pub flown: u64,
    /// Number of samples requested.
    pub wanted: u64,
}

impl Report {
    /// Returns true if all requested samples are present.
    pub fn is_complete(&self) -> bool {
        self.kept + self.flown == self.wanted
    }
}

/// Interval between checks of the stop condition, and between reports of progress.
const LOOK: Duration = Duration::from_millis(50);

/// Flies the samples that `store` lacks and writes their parts. After `stop` returns true, the run completes the parts
/// that have been started and ends.
///
/// # Errors
/// Returns an error if samples outside the ensemble are requested, if parts in the store do not belong to the campaign,
/// or if writing fails.
pub fn run(
    campaign: &Campaign<'_>,
    store: &Store,
    options: &Options,
    stop: &dyn Fn() -> bool,
    progress: &mut dyn FnMut(Progress),
) -> Result<Report, EnsembleError> {
    let samples = campaign.samples();
    let range = options.range.clone().unwrap_or(0..samples);
    if range.is_empty() || range.end > samples {
        return Err(EnsembleError::Range { range, samples });
    }
    let missing = store.missing(range.clone())?;
    store.place().prepare()?;
    let wanted = range.end - range.start;
    let open: u64 = missing.iter().map(|part| part.end - part.start).sum();
    let mut report = Report {
        kept: wanted - open,
        flown: 0,
        wanted,
    };
    let shared = Shared {
        campaign,
        store,
        width: options.width,
        queue: Mutex::new(Queue::new(&missing, store.identity().part)),
        steps: AtomicU64::new(report.kept.saturating_mul(campaign.steps())),
    };
    let threads = match options.threads {
        0 => thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    thread::scope(|scope| {
        let (sender, receiver) = sync_channel(2 * threads);
        for _ in 0..threads {
            let (shared, sender) = (&shared, sender.clone());
            scope.spawn(move || shared.work(&sender));
        }
        drop(sender);
        let kept = report.kept;
        let mut told = |flown| {
            progress(Progress {
                done: kept + flown,
                wanted,
                steps: shared.steps.load(Ordering::Relaxed),
                wanted_steps: wanted.saturating_mul(campaign.steps()),
            });
        };
        report.flown = shared.watch(&receiver, stop, &mut told)?;
        Ok(report)
    })
}

/// State shared by the threads of a run.
struct Shared<'a> {
    campaign: &'a Campaign<'a>,
    store: &'a Store,
    width: Width,
    queue: Mutex<Queue<'a>>,
    /// Number of steps made.
    steps: AtomicU64,
}

/// Numbers of samples that a thread has flown and written since it last told of them.
#[derive(Default)]
struct Done {
    flown: u64,
    written: u64,
}

impl<'a> Shared<'a> {
    /// Flies units until none is left, and writes the parts that become complete.
    fn work(&self, done: &SyncSender<Result<Done, EnsembleError>>) {
        // A statement of its own, so that the queue is free while the unit is flown.
        let take = || self.queue().take();
        while let Some(unit) = take() {
            let worked = self.work_on(unit);
            // The receiver is gone if another part could not be written.
            if done.send(worked).is_err() {
                return;
            }
        }
    }

    fn work_on(&self, unit: Unit) -> Result<Done, EnsembleError> {
        let flown = unit.samples.end - unit.samples.start;
        let rows = (self.campaign).fly_counted(unit.samples, self.width, &self.steps);
        let whole = self.queue().add(unit.part, rows);
        let written = match whole {
            Some(rows) => {
                self.store.write(&rows)?;
                rows.len() as u64
            }
            None => 0,
        };
        Ok(Done { flown, written })
    }

    fn queue(&self) -> MutexGuard<'_, Queue<'a>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reports progress until all threads are done, and ends the queue when `stop` returns true. Returns the number of samples
    /// written.
    fn watch(
        &self,
        done: &Receiver<Result<Done, EnsembleError>>,
        stop: &dyn Fn() -> bool,
        told: &mut dyn FnMut(u64),
    ) -> Result<u64, EnsembleError> {
        let mut all = Done::default();
        loop {
            told(all.flown);
            if stop() {
                self.queue().end();
            }
            match done.recv_timeout(LOOK) {
                Ok(done) => {
                    let Done { flown, written } = done?;
                    all.flown += flown;
                    all.written += written;
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(all.written),
            }
        }
    }
}
