use std::cell::Cell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use lgvi_dynamics::lanes::Width;

use crate::{Campaign, EnsembleError, Row, Store};

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
        report.flown = shared.collect(&receiver, store, &missing, stop, &mut told)?;
        Ok(report)
    })
}

/// The samples that a thread flies at a time, and the index of their part.
struct Unit {
    part: usize,
    samples: Range<u64>,
}

/// What is to be flown.
struct Queue<'a> {
    parts: &'a [Range<u64>],
    /// Number of samples of a unit.
    unit: u64,
    /// Index of the part of the next unit.
    part: usize,
    /// Number of samples of this part that have been taken.
    taken: u64,
    /// True if no further parts shall be begun.
    ending: bool,
}

impl<'a> Queue<'a> {
    fn new(parts: &'a [Range<u64>], part: u64) -> Self {
        Self {
            parts,
            // A few registers of lanes; one where samples are dear, so that several threads share a part.
            unit: (part / 4).clamp(8, 32),
            part: 0,
            taken: 0,
            ending: false,
        }
    }
}

impl Iterator for Queue<'_> {
    type Item = Unit;

    fn next(&mut self) -> Option<Unit> {
        if self.ending && self.taken == 0 {
            return None;
        }
        let part = self.part;
        let Range { start, end } = self.parts.get(part)?.clone();
        let begun = start + self.taken;
        let samples = begun..end.min(begun + self.unit);
        self.taken = samples.end - start;
        if samples.end == end {
            (self.part, self.taken) = (part + 1, 0);
        }
        Some(Unit { part, samples })
    }
}

/// State shared by the threads of a run.
struct Shared<'a> {
    campaign: &'a Campaign<'a>,
    width: Width,
    queue: Mutex<Queue<'a>>,
    /// Number of steps made.
    steps: AtomicU64,
}

impl<'a> Shared<'a> {
    /// Flies units until none is left.
    fn work(&self, rows: &SyncSender<(usize, Vec<Row>)>) {
        loop {
            let unit = self.queue().next();
            let Some(Unit { part, samples }) = unit else {
                return;
            };
            let left =
                Cell::new((samples.end - samples.start).saturating_mul(self.campaign.steps()));
            let count = |steps: u64| {
                let steps = steps.min(left.get());
                left.set(left.get() - steps);
                self.steps.fetch_add(steps, Ordering::Relaxed);
            };
            let flown = self.campaign.fly_watched(samples, self.width, &count);
            // Samples that failed have not made all their steps.
            count(left.get());
            // The receiver is gone if a part could not be written.
            if rows.send((part, flown)).is_err() {
                return;
            }
        }
    }

    fn queue(&self) -> MutexGuard<'_, Queue<'a>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes each part when all its samples have been flown, and reports progress after each unit and
    /// in between. Returns the number
    /// of samples written.
    fn collect(
        &self,
        rows: &Receiver<(usize, Vec<Row>)>,
        store: &Store,
        parts: &[Range<u64>],
        stop: &dyn Fn() -> bool,
        told: &mut dyn FnMut(u64),
    ) -> Result<u64, EnsembleError> {
        let mut begun: BTreeMap<usize, Vec<Row>> = BTreeMap::new();
        let (mut flown, mut written) = (0, 0);
        told(flown);
        loop {
            if stop() {
                self.queue().ending = true;
            }
            let (part, unit) = match rows.recv_timeout(LOOK) {
                Ok(unit) => unit,
                Err(RecvTimeoutError::Timeout) => {
                    told(flown);
                    continue;
                }
                Err(RecvTimeoutError::Disconnected) => return Ok(written),
            };
            let of_part = begun.entry(part).or_default();
            flown += unit.len() as u64;
            told(flown);
            of_part.extend(unit);
            let wanted = parts[part].end - parts[part].start;
            if of_part.len() as u64 == wanted
                && let Some(mut rows) = begun.remove(&part)
            {
                rows.sort_by_key(|row| row.index);
                store.write(&rows)?;
                written += wanted;
            }
        }
    }
}
