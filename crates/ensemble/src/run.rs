use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use lgvi_dynamics::lanes::Width;

use crate::{Campaign, EnsembleError, Row, Store};

/// How samples are flown; what they come to does not depend on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Which samples; all without.
    pub range: Option<Range<u64>>,
    /// Threads, 0 for one a core.
    pub threads: usize,
    /// How many samples fly side by side.
    pub width: Width,
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples that are there, flown now or before; some of them in parts that are not whole yet.
    pub done: u64,
    /// Samples that are asked for.
    pub wanted: u64,
}

/// What a run has done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Samples that were there already.
    pub kept: u64,
    /// Samples that were flown.
    pub flown: u64,
    /// Samples that are asked for.
    pub wanted: u64,
}

impl Report {
    /// Whether all are there.
    pub fn is_complete(&self) -> bool {
        self.kept + self.flown == self.wanted
    }
}

/// Samples that a thread flies at a time: a few registers of lanes.
const UNIT: u64 = 32;

/// How often it is looked whether to stop.
const LOOK: Duration = Duration::from_millis(50);

/// A unit's samples, and the number of the part that they belong to.
struct Unit {
    part: usize,
    samples: Range<u64>,
}

/// Flies the samples that are not in `store` yet, and writes their parts. Once `stop` says so, it ends with the parts that
/// have been begun.
///
/// # Errors
/// Samples that are not there; parts in the store that do not belong to the campaign; what cannot be written.
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

/// What the threads of a run share.
struct Shared<'a> {
    campaign: &'a Campaign<'a>,
    width: Width,
    units: &'a [Unit],
    /// The unit that is flown next.
    next: AtomicUsize,
    /// The part after which it ends.
    last_part: AtomicUsize,
}

impl Shared<'_> {
    /// Flies unit after unit until none is left.
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
            // Nobody listens any more where a part could not be written.
            if rows.send((unit.part, flown)).is_err() {
                return;
            }
        }
    }

    /// Writes each part once all of its samples are there; says of each unit that it is. Returns how many samples are written.
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
