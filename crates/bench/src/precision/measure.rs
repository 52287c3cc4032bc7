//! Which settings of a method are worth flying, and their times in turns with those of all others.

use serde::Serialize;

use super::cases::{ErrorsAt, Judge, Setting};
use super::contestant::{Contestant, Flight};
use crate::error::BenchError;
use crate::peer::Tuning;

/// Longest flight (s) after which a method is not tuned finer.
const PATIENCE: f64 = 0.1;

/// The same of peers; those with a tolerance have few settings.
const PATIENCE_WITH_STEPS: f64 = 0.4;
const PATIENCE_WITH_TOLERANCE: f64 = 3.0;

/// Errors below this are rounding.
const FLOOR: f64 = 1e-13;

/// An error that rises below this has met rounding.
const RISES: f64 = 1e-6;

/// How often a finer step may be tried after one that could not be made.
const FAILURES: u32 = 16;

const TOLERANCES: [f64; 11] = [
    1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14,
];

/// Some peers are compiled for each tolerance, or take long to set up.
const PEER_TOLERANCES: [f64; 8] = [1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-12, 1e-13];

/// One way to fly.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Point {
    /// Steps or tolerance.
    pub setting: f64,
    /// At the reference times at which a step ends.
    pub errors: Vec<ErrorsAt>,
    /// Time (s) of each repetition, on the processor.
    pub seconds: Vec<f64>,
}

/// A method with all ways to fly that were measured.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Measured {
    pub method: String,
    pub peer: bool,
    pub tuning: Option<Tuning>,
    pub points: Vec<Point>,
}

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    pub repeats: u32,
    /// Only the coarsest flights.
    pub quick: bool,
}

/// Errors of all methods, then their times, in turns.
pub(crate) fn measure(
    contestants: &mut [Box<dyn Contestant + '_>],
    setting: &Setting,
    judge: &Judge<'_>,
    effort: Effort,
) -> Result<Vec<Measured>, BenchError> {
    let mut all = Vec::new();
    for contestant in contestants.iter_mut() {
        let points = sweep(contestant.as_mut(), setting, judge, effort);
        all.push(Measured {
            method: contestant.label().into(),
            peer: contestant.is_peer(),
            tuning: contestant.tuning(),
            points: forgiven(contestant.as_ref(), points)?.unwrap_or_default(),
        });
    }
    for _ in 0..effort.repeats {
        for (contestant, measured) in contestants.iter_mut().zip(&mut all) {
            let times = measured.points.iter();
            let times = times.map(|point| contestant.time(point.setting));
            let times = times.collect::<Result<Vec<_>, _>>();
            let Some(times) = forgiven(contestant.as_ref(), times)? else {
                measured.points.clear();
                continue;
            };
            for (point, time) in measured.points.iter_mut().zip(times) {
                point.seconds.push(time);
            }
        }
    }
    all.retain(|measured| !measured.points.is_empty());
    Ok(all)
}

/// A peer that fails is left out and named.
fn forgiven<T>(
    contestant: &dyn Contestant,
    result: Result<T, BenchError>,
) -> Result<Option<T>, BenchError> {
    match result {
        Err(error) if contestant.is_peer() => {
            println!("left out: {}: {error}", contestant.label());
            Ok(None)
        }
        result => result.map(Some),
    }
}

/// Finer and finer flights until rounding or patience ends it.
fn sweep(
    contestant: &mut dyn Contestant,
    setting: &Setting,
    judge: &Judge<'_>,
    effort: Effort,
) -> Result<Vec<Point>, BenchError> {
    let tolerances: &[f64] = match contestant.is_peer() {
        true => &PEER_TOLERANCES,
        false => &TOLERANCES,
    };
    let settings: Box<dyn Iterator<Item = f64>> = match contestant.tuning() {
        None => Box::new(std::iter::once(1.0)),
        Some(Tuning::Tolerance) => Box::new(tolerances.iter().copied()),
        Some(Tuning::Steps) if contestant.is_peer() => Box::new(steps(setting.steps).step_by(2)),
        Some(Tuning::Steps) => Box::new(steps(setting.steps)),
    };
    let by_steps = contestant.tuning() == Some(Tuning::Steps);
    let patience = match (effort.quick, contestant.is_peer(), by_steps) {
        (true, ..) => 0.0,
        (_, false, _) => PATIENCE,
        (_, true, true) => PATIENCE_WITH_STEPS,
        (_, true, false) => PATIENCE_WITH_TOLERANCE,
    };
    let (mut points, mut failures, mut least) = (Vec::new(), 0, f64::INFINITY);
    for tuned in settings {
        let Some(flight) = contestant.fly(tuned)? else {
            failures += 1;
            if failures > FAILURES {
                break;
            }
            continue;
        };
        let seconds = flight.seconds;
        let errors = errors(flight, setting, judge)?;
        let Some(last) = errors.last() else { continue };
        let error = setting.error(last);
        if !error.is_finite() || (by_steps && error > least && least < RISES) {
            break;
        }
        least = least.min(error);
        if effort.quick || error <= setting.coarse {
            points.push(Point {
                setting: tuned,
                errors,
                seconds: Vec::new(),
            });
        }
        if seconds > patience || (by_steps && error < FLOOR) {
            break;
        }
    }
    Ok(points)
}

/// Growing numbers of steps, two in an octave, so that the reference times are ends of steps.
fn steps(fewest: u64) -> impl Iterator<Item = f64> {
    let octaves = (0..24).map(move |octave| (fewest << octave) as f64);
    octaves.flat_map(|steps| [steps, 1.5 * steps])
}

fn errors(
    flight: Flight,
    setting: &Setting,
    judge: &Judge<'_>,
) -> Result<Vec<ErrorsAt>, BenchError> {
    let times = setting.times(judge.case());
    let reached = times.into_iter().zip(flight.states);
    let reached = reached.filter_map(|(t, states)| Some((t, states?)));
    reached
        .map(|(t, states)| judge.errors(t, &states))
        .collect()
}
