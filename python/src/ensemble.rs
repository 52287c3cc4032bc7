//! Monte Carlo ensembles in memory.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use lgvi_dynamics::lanes::Width;
use lgvi_ensemble::{Campaign, EnsembleError, FlownBy, Guidance, Row, Settings};
use lgvi_review::guidance;
use lgvi_scene::Scene;
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::error;
use crate::plan::Plan;
use crate::watch::Watch;

/// Samples that a thread flies at a time: a few registers of lanes.
const UNIT: u64 = 32;

/// How often it is looked whether the flights are to end.
const LOOK: Duration = Duration::from_millis(20);

/// What is flown.
pub(crate) struct Wanted {
    pub(crate) settings: Settings,
    /// Samples, or all.
    pub(crate) range: Option<Range<u64>>,
    /// Threads, or 0 for one a core.
    pub(crate) threads: usize,
}

/// Flies samples and returns their columns, and what the ensemble is.
pub(crate) fn fly<'py>(
    py: Python<'py>,
    scene: &Scene,
    wanted: &Wanted,
    plan: Option<&Plan>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    error::threads(wanted.threads)?;
    if let Some(plan) = plan
        && plan.nominal().first_step() != 0
    {
        return Err(error::ensemble(
            py,
            format!(
                "`plan` begins at step {}, expected one from the start",
                plan.nominal().first_step()
            ),
        ));
    }
    if plan.is_some_and(|plan| !plan.fits(scene)) {
        let message = "`plan` is in other units, steps or for another body or other actuators than the scene's";
        return Err(error::ensemble(py, message));
    }
    let guidance = plan.map_or(Guidance::None, |plan| guidance(plan.nominal().clone()));
    let campaign = py.detach(|| Campaign::new(scene, wanted.settings, guidance));
    let campaign = campaign.map_err(|error| error::ensemble(py, error))?;
    let samples = campaign.samples();
    let range = wanted.range.clone().unwrap_or(0..samples);
    if range.is_empty() || range.end > samples {
        return Err(error::ensemble(py, EnsembleError::Range { range, samples }));
    }
    let mut watch = Watch::new(progress);
    let rows = py.detach(|| rows(&campaign, range, wanted.threads, &mut watch));
    watch.end(py)?;
    columns(py, &campaign, &rows)
}

/// Flies the samples side by side. Their order, and their numbers, do not depend on the threads.
fn rows(campaign: &Campaign<'_>, range: Range<u64>, threads: usize, watch: &mut Watch) -> Vec<Row> {
    let threads = match threads {
        0 => thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    let next = AtomicU64::new(range.start);
    let stop = AtomicBool::new(false);
    let steps = AtomicU64::new(0);
    let rows = Mutex::new(Vec::new());
    thread::scope(|scope| {
        let work = || {
            while !stop.load(Ordering::Relaxed) {
                let start = next.fetch_add(UNIT, Ordering::Relaxed);
                if start >= range.end {
                    return;
                }
                let unit = start..range.end.min(start + UNIT);
                let flown = campaign.fly_counted(unit, Width::default(), &steps);
                let mut rows = rows.lock().unwrap_or_else(PoisonError::into_inner);
                rows.extend(flown);
            }
        };
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let wanted = (range.end - range.start) as f64 * campaign.steps() as f64;
        while !workers.iter().all(thread::ScopedJoinHandle::is_finished) {
            let made = steps.load(Ordering::Relaxed) as f64;
            if !watch.go_on(made / wanted) {
                stop.store(true, Ordering::Relaxed);
            }
            thread::park_timeout(LOOK);
        }
    });
    let mut rows = rows.into_inner().unwrap_or_else(PoisonError::into_inner);
    rows.sort_by_key(|row| row.index);
    rows
}

fn columns<'py>(
    py: Python<'py>,
    campaign: &Campaign<'_>,
    rows: &[Row],
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let columns = PyDict::new(py);
    let indices: Vec<_> = rows.iter().map(|row| row.index).collect();
    columns.set_item("index", indices.into_pyarray(py))?;
    let steps: Vec<_> = rows.iter().map(|row| row.steps).collect();
    columns.set_item("steps", steps.into_pyarray(py))?;
    let failures = rows.iter().map(|row| {
        let failure = row.failure.as_ref();
        failure.map_or("", |failure| failure.kind.name())
    });
    columns.set_item("failure", PyList::new(py, failures.collect::<Vec<_>>())?)?;
    let messages = rows.iter().map(|row| {
        let failure = row.failure.as_ref();
        failure.map_or("", |failure| &failure.message)
    });
    columns.set_item("message", PyList::new(py, messages.collect::<Vec<_>>())?)?;
    for (index, name) in campaign.columns().iter().enumerate() {
        let column: Vec<_> = rows.iter().map(|row| row.numbers[index]).collect();
        columns.set_item(name, column.into_pyarray(py))?;
    }
    let identity = campaign.identity();
    let about = PyDict::new(py);
    about.set_item("identity", &identity.hash)?;
    about.set_item("scene", &identity.scene)?;
    about.set_item("seed", identity.seed)?;
    about.set_item("samples", identity.samples)?;
    about.set_item("integrator", &identity.scheme)?;
    about.set_item("part", identity.part)?;
    if let FlownBy::Simulation { reason } = campaign.flown_by() {
        about.set_item("one_by_one", reason)?;
    }
    Ok((columns, about))
}
