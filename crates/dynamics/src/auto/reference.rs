use super::flight::{BUDGET, Course, End, Flights};
use super::{ChoiceError, Outlook};
use crate::BodyState;

/// Tolerances of Dormand and Prince's method by which references are flown: coarse and fine. Rounding dominates the fine.
const TOLERANCES: [f64; 2] = [1e-12, 1e-17];

/// Tolerances of the flights that a reference is compared with, in multiples of its own.
const LOOSER: [f64; 2] = [10.0, 3.162_277_660_168_379_5];

/// Part of the budget that a flight may cost.
const SHARE: f64 = 0.125;

/// How much dearer than the coarse reference the fine one may be: 4.2 times, by its order, if rounding lets it.
const DEARER: f64 = 12.0;

/// Error beyond which nothing is learnt from a state.
const RESOLVED: f64 = 0.03;

/// The error of a reference in multiples of what it differs from looser flights by: a margin for differences that are small
/// by chance.
const MARGIN: f64 = 2.0;

/// Part of the tolerance that a reference's own error may be.
const PART: f64 = 0.25;

/// Error of a state, in multiples of the tolerance, from which a flight does not come back.
const HOPELESS: f64 = 1e3;

/// Where a run goes, and how well that is known.
pub(super) struct Reference {
    course: Course,
    /// The tolerance that it was flown with.
    pub(super) tolerance: f64,
    /// Its own error at the instants that are known, and what part of the run is over then.
    floor: Vec<f64>,
    parts: Vec<f64>,
    /// What errors are multiplied by between the last of them and the end of the run.
    growth: f64,
    pub(super) outlook: Outlook,
}

impl Reference {
    /// The finest that the budget allows; a coarser one of more of the run rather than a finer one of less, where that is
    /// fine enough.
    pub(super) fn new(flights: &mut Flights<'_>, tolerance: f64) -> Result<Self, ChoiceError> {
        let [coarse, fine] = TOLERANCES;
        let share = SHARE * BUDGET;
        let mut chosen = Self::fly(flights, coarse, share)?;
        let cost = chosen.course.cost;
        let is_whole = chosen.course.end == End::Whole;
        if is_whole {
            flights.expect(cost);
        }
        let suffices = chosen.known(tolerance) == Some(chosen.floor.len() - 1);
        if !suffices || is_whole && DEARER * cost <= share {
            match Self::fly(flights, fine, share.min(DEARER * cost)) {
                Ok(finer) if finer.knows_more(&chosen, tolerance) => chosen = finer,
                Err(ChoiceError::Interrupted) => return Err(ChoiceError::Interrupted),
                Ok(_) | Err(_) => {}
            }
        }
        chosen.judge(flights, tolerance)?;
        Ok(chosen)
    }

    /// A reference and its floor.
    fn fly(flights: &mut Flights<'_>, tolerance: f64, most: f64) -> Result<Self, ChoiceError> {
        let course = flights.adaptive(tolerance, most, |_, _| true)?;
        if let End::Failed(error) = course.end {
            return Err(ChoiceError::Flight(error));
        }
        let mut floor = vec![0.0_f64; course.states.len()];
        let accuracy = flights.accuracy;
        for factor in LOOSER {
            let other = flights.adaptive(factor * tolerance, most, |instant, states| {
                let error = course
                    .states
                    .get(instant)
                    .map_or(f64::INFINITY, |truth| accuracy.error(states, truth));
                if let Some(floor) = floor.get_mut(instant) {
                    *floor = floor.max(MARGIN * error);
                }
                error <= RESOLVED
            })?;
            floor.truncate(other.states.len());
        }
        if floor.is_empty() {
            return Err(ChoiceError::Costly {
                horizon: flights.time(0),
                evaluations: flights.evaluations(),
            });
        }
        let end = flights.time(flights.instants() - 1);
        Ok(Self {
            parts: (0..floor.len()).map(|i| flights.time(i) / end).collect(),
            course,
            tolerance,
            floor,
            growth: 1.0,
            outlook: Outlook::Met,
        })
    }

    /// Whether it knows more of the run to a tolerance than another does, or the same better.
    fn knows_more(&self, other: &Self, tolerance: f64) -> bool {
        let known = |reference: &Self| reference.known(tolerance).map(|last| reference.parts[last]);
        known(self) > known(other) || known(self) == known(other) && self.end() <= other.end()
    }

    /// Whether it ends where the budget does, and not because nothing is known of the rest.
    fn is_costly(&self) -> bool {
        self.course.end == End::Costly && self.end() <= RESOLVED
    }

    /// What errors are multiplied by between an instant and that at which they are asked for.
    fn growth_from(&self, instant: usize) -> f64 {
        if self.is_costly() {
            self.parts[instant].powi(-2)
        } else {
            1.0
        }
    }

    /// The last instant up to which its own error is a part of the tolerance.
    fn known(&self, tolerance: f64) -> Option<usize> {
        let own = |instant: &usize| self.floor[*instant] * self.growth_from(*instant);
        (0..self.floor.len())
            .rev()
            .find(|instant| own(instant) <= PART * tolerance)
    }

    /// Its own error at the last instant.
    fn end(&self) -> f64 {
        self.floor.last().copied().unwrap_or(f64::INFINITY)
    }

    /// What it tells about the end of the run.
    fn judge(&mut self, flights: &Flights<'_>, tolerance: f64) -> Result<(), ChoiceError> {
        let (last, instants) = (self.floor.len() - 1, flights.instants());
        if self.is_costly() {
            let last = self.known(tolerance).unwrap_or(last);
            let horizon = flights.time(last);
            self.growth = self.growth_from(last);
            self.outlook = Outlook::Extrapolated { horizon };
            self.floor.truncate(last + 1);
        } else if self.floor.len() < instants || self.end() > RESOLVED {
            let Some(last) = self.known(tolerance) else {
                let least = self.floor.iter().copied().fold(f64::INFINITY, f64::min);
                return Err(ChoiceError::beyond(tolerance, least / PART));
            };
            let known = flights.time(last);
            self.outlook = Outlook::Chaotic { known };
            self.floor.truncate(last + 1);
        }
        Ok(())
    }

    /// Its own error at the end of the run.
    pub(super) fn floor(&self) -> f64 {
        self.growth * self.end()
    }

    /// What it cost.
    pub(super) fn cost(&self) -> f64 {
        self.course.cost
    }

    /// Who compares a flight with it on its way.
    pub(super) fn comparison(&self, flights: &Flights<'_>, tolerance: f64) -> Comparison<'_> {
        Comparison {
            reference: self,
            accuracy: flights.accuracy,
            hopeless: HOPELESS * tolerance / self.growth,
            greatest: 0.0,
            error: f64::INFINITY,
        }
    }

    /// The part of the run that flights are compared over.
    pub(super) fn part(&self) -> f64 {
        self.parts[self.floor.len() - 1]
    }
}

/// Compares a flight with a reference on its way.
pub(super) struct Comparison<'a> {
    reference: &'a Reference,
    accuracy: super::Accuracy,
    hopeless: f64,
    greatest: f64,
    /// At the end of the run; infinite where the flight did not get there.
    pub(super) error: f64,
}

impl Comparison<'_> {
    /// Looks at the states at an instant; whether the flight is to go on.
    pub(super) fn compare(&mut self, instant: usize, states: &[BodyState]) -> bool {
        let Reference {
            course,
            floor,
            growth,
            ..
        } = self.reference;
        let now = self.accuracy.error(states, &course.states[instant]);
        self.greatest = self.greatest.max(now);
        let last = instant + 1 == floor.len();
        if last {
            let seen = if *growth > 1.0 { self.greatest } else { now };
            self.error = growth * (seen + floor[instant]);
        }
        !last && now <= self.hopeless
    }
}
