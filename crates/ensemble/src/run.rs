use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
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

/// Number of samples that a thread flies at a time: a few registers of lanes.
const UNIT: u64 = 32;

/// Interval between checks of the stop condition.
const LOOK: Duration = Duration::from_millis(50);

/// The samples of a unit, and the index of their part.
struct Unit {
    part: usize,
    samples: Range<u64>,
}

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
    store.tidy()?;
    let wanted = range.end - range.start;
    let open: u64 = missing.iter().map(|part| part.end - part.start).sum();
    let mut report = Report {
        kept: wanted - open,
        flown: 0,
        wanted,
    };
    let units = units(&missing);
    let shared = Shared {
        campaign,
        width: options.width,
        units: &units,
        next: AtomicUsize::new(0),
        last_part: AtomicUsize::new(usize::MAX),
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
            });
        };
        report.flown = shared.collect(&receiver, store, &missing, stop, &mut told)?;
        Ok(report)
    })
}

fn units(missing: &[Range<u64>]) -> Vec<Unit> {
    let mut units = Vec::new();
    for (part, samples) in missing.iter().enumerate() {
        let starts = samples.clone().step_by(UNIT as usize);
        units.extend(starts.map(|start| Unit {
            part,
            samples: start..(start + UNIT).min(samples.end),
        }));
    }
    units
}

/// State shared by the threads of a run.
struct Shared<'a> {
    campaign: &'a Campaign<'a>,
    width: Width,
    units: &'a [Unit],
    /// Index of the next unit to fly.
    next: AtomicUsize,
    /// Index of the last part to fly.
    last_part: AtomicUsize,
}

impl Shared<'_> {
    /// Flies units until none is left.
    fn work(&self, rows: &SyncSender<(usize, Vec<Row>)>) {
        loop {
            let next = self.next.fetch_add(1, Ordering::SeqCst);
            let Some(unit) = self.units.get(next) else {
                return;
            };
            if unit.part > self.last_part.load(Ordering::SeqCst) {
                return;
            }
            let flown = self.campaign.fly(unit.samples.clone(), self.width);
            // The receiver is gone if a part could not be written.
            if rows.send((unit.part, flown)).is_err() {
                return;
            }
        }
    }

    /// Writes each part when all its samples have been flown, and reports progress after each unit. Returns the number
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
                let taken = self.next.load(Ordering::SeqCst).min(self.units.len());
                let last = taken.checked_sub(1).map_or(0, |unit| self.units[unit].part);
                self.last_part.fetch_min(last, Ordering::SeqCst);
            }
            let (part, unit) = match rows.recv_timeout(LOOK) {
                Ok(unit) => unit,
                Err(RecvTimeoutError::Timeout) => continue,
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
