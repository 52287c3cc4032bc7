use super::family::{Extent, Family};
use super::flight::{Failure, Flight, Flights, SAMPLES};
use super::growth::Growth;
use super::{ChoiceError, Outlook, Task};

/// Error beyond which nothing is learnt from a state.
pub(super) const RESOLVED: f64 = 0.03;

/// What the reference's own error may be, in multiples of the error to be measured.
pub(super) const REFERENCE: f64 = 0.03;

/// Factor for what is not seen of a run that a pilot covers a part of.
const MARGIN: f64 = 2.0;

/// Factors between resolutions of the reference, the least and the greatest.
const FINER: [f64; 2] = [1.2, 1.6];

/// Resolutions of the reference that are tried.
const TRIALS: u32 = 32;

/// What the reference may take of the evaluations that are left: one in so many.
const SHARE: u64 = 2;

/// By how much less than its order a method is taken to converge.
const CAUTION: f64 = 2.0;

/// Change from one resolution to the next that, at a method of high order, can only be rounding if it stays as it is.
const SMALL: f64 = 1e-6;

/// Rounding of a state, and the exponent of time with which it grows in regular motion (Brouwer's law).
const UNIT: [f64; 2] = [1e-15, 1.5];

/// A reference flight over the first part of a run, and what it tells about the run.
pub(super) struct Pilot {
    reference: Flight,
    /// Number of samples that are known.
    known: usize,
    /// Time of the last of them.
    horizon: f64,
    duration: f64,
    /// How the error of the reference grows, by what nearby trajectories part; none where errors are taken to grow linearly.
    parting: Option<Growth>,
    /// What to reach at the end of the run.
    pub(super) target: f64,
    pub(super) outlook: Outlook,
}

impl Pilot {
    /// Flies references for `horizon`, finer and finer from the given resolution, until they agree to a part of the
    /// tolerance, or no better.
    pub(super) fn new(
        flights: &mut Flights<'_>,
        task: &Task,
        horizon: f64,
        (family, first): (Family, f64),
    ) -> Result<Self, ChoiceError> {
        let duration = task.run.duration;
        let part = horizon / duration;
        let extent = Extent {
            horizon,
            part,
            radians: task.rate * duration,
            whole: false,
        };
        let aim = REFERENCE * task.tolerance * part;
        let most = flights.left() / SHARE;
        let mut wanted = first;
        let mut failed = None;
        let mut coarser: Option<(Flight, f64)> = None;
        let mut before: Option<[f64; SAMPLES]> = None;
        for _ in 0..TRIALS {
            let (plan, resolution) = family.plan(wanted, extent);
            wanted = FINER[1] * resolution;
            let flight = match flights.fly(plan, most) {
                Ok(flight) => flight,
                Err(Failure::Step(error)) => {
                    failed = Some(error);
                    continue;
                }
                Err(Failure::Method(error)) => return Err(error.into()),
                Err(Failure::Allowance) => break,
            };
            if let Some((coarser, last)) = &coarser {
                let change = coarser.errors(&flight, &task.accuracy);
                let ratio = resolution / last;
                let order = f64::from(family.order) - CAUTION;
                let converged = change.map(|change| change * libm::pow(ratio, -order));
                let finest = resolution == *last;
                let rounding = before.is_some_and(|before| finest || is_rounding(&change, &before));
                let known = greatest(&converged) <= aim && greatest(&change) <= RESOLVED;
                if known || rounding {
                    let floor = before
                        .filter(|_| rounding && !known)
                        .map_or(converged, |before| {
                            std::array::from_fn(|i| before[i].max(change[i]))
                        });
                    let mut pilot = Self {
                        reference: flight,
                        known: SAMPLES,
                        horizon,
                        duration,
                        parting: None,
                        target: task.tolerance,
                        outlook: Outlook::Met,
                    };
                    pilot.look(&floor, aim, task.tolerance);
                    return Ok(pilot);
                }
                let lacking = libm::pow(greatest(&converged) / aim, order.recip());
                wanted = resolution * lacking.clamp(FINER[0], FINER[1]);
                before = Some(change);
            }
            coarser = Some((flight, resolution));
        }
        Err(match failed {
            Some(error) if coarser.is_none() => ChoiceError::Flight(error),
            _ => ChoiceError::Costly {
                horizon,
                evaluations: flights.allowed(),
            },
        })
    }

    /// What the errors of the reference tell about the end of the run.
    fn look(&mut self, floor: &[f64; SAMPLES], aim: f64, tolerance: f64) {
        let growth = Growth::fit(floor, self.horizon);
        self.parting = Some(growth);
        let [unit, exponent] = UNIT;
        let end = floor[SAMPLES - 1];
        let (rounding, factor) = match growth {
            Growth::Power(_) => {
                let factor = Growth::Power(exponent).factor(self.horizon, self.duration);
                (if end > aim { end } else { unit }, factor)
            }
            Growth::Exponential(_) => {
                let factor = growth.factor(self.horizon, self.duration);
                (end.max(unit), factor)
            }
        };
        let limit = rounding * factor;
        if 3.0 * limit <= tolerance {
            return;
        }
        if limit <= RESOLVED {
            self.target = 3.0 * limit;
            self.outlook = Outlook::Limited { floor: limit };
            return;
        }
        let interval = self.horizon / SAMPLES as f64;
        let known = |&sample: &usize| {
            let part = sample as f64 * interval / self.duration;
            floor[sample - 1] <= REFERENCE.sqrt() * tolerance * part
        };
        self.known = (1..=SAMPLES).rev().find(known).unwrap_or(1);
        self.horizon = self.known as f64 * interval;
        self.parting = None;
        self.outlook = Outlook::Chaotic {
            known: self.horizon,
        };
    }

    /// How far flights go that are to be compared with the reference.
    pub(super) fn extent(&self, task: &Task) -> Extent {
        let horizon = self.horizon * (SAMPLES as f64 / self.known as f64);
        Extent {
            horizon,
            part: horizon / self.duration,
            radians: task.rate * self.duration,
            whole: self.is_whole(),
        }
    }

    /// Duration of the reference.
    pub(super) fn horizon(&self, task: &Task) -> f64 {
        self.extent(task).horizon
    }

    /// Whether the run's end is known.
    fn is_whole(&self) -> bool {
        self.horizon >= self.duration
    }

    /// The error of a flight, now and as expected at the end of the run.
    pub(super) fn error(&self, flight: &Flight, task: &Task) -> [f64; 2] {
        let errors = flight.errors(&self.reference, &task.accuracy);
        let errors = &errors[..self.known];
        let greatest = greatest(errors);
        let last = errors[self.known - 1];
        let now = if self.is_whole() { last } else { greatest };
        let growth = match self.parting {
            Some(Growth::Power(_)) => Growth::power(errors),
            Some(exponential) => exponential,
            None => Growth::Power(1.0),
        };
        let margin = if self.is_whole() { 1.0 } else { MARGIN };
        [
            now,
            now * margin * growth.factor(self.horizon, self.duration),
        ]
    }
}

fn greatest(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(0.0, f64::max)
}

/// Whether references do not come nearer to each other where they are near.
fn is_rounding(change: &[f64; SAMPLES], before: &[f64; SAMPLES]) -> bool {
    let resolved = change
        .iter()
        .zip(before)
        .filter(|(change, _)| **change <= RESOLVED);
    let most = |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].max(b[1])];
    let [now, before] = resolved
        .map(|(now, before)| [*now, *before])
        .fold([0.0; 2], most);
    change[0] <= SMALL && 3.0 * now > before
}
