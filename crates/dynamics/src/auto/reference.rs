use super::flight::{BUDGET, Course, End, Flights, Tuned};
use super::{ChoiceError, Outlook};
use crate::BodyState;

/// Tolerances of the Dormand–Prince method for the coarse and the fine reference. Rounding dominates the fine one.
const TOLERANCES: [f64; 2] = [1e-12, 1e-17];

/// Tolerances of the flights against which a reference is compared, in multiples of its own tolerance.
const LOOSER: [f64; 2] = [10.0, 3.162_277_660_168_379_5];

/// Fraction of the budget that one flight may cost.
const SHARE: f64 = 0.125;

/// Largest cost of the fine reference in multiples of the coarse one. The order of the method predicts 4.2, unless
/// rounding increases it.
const DEARER: f64 = 12.0;

/// Error beyond which a state provides no information.
const RESOLVED: f64 = 0.03;

/// Ratio of the estimated error of a reference to its difference from looser flights: a margin for differences that are
/// small by chance.
const MARGIN: f64 = 2.0;

/// Largest error of a reference, as a fraction of the tolerance.
const PART: f64 = 0.25;

/// Error of a state, in multiples of the tolerance, beyond which a flight is abandoned.
const HOPELESS: f64 = 1e3;

/// The reference trajectory of a run and its accuracy.
pub(super) struct Reference {
    course: Course,
    /// The tolerance used for its integration.
    pub(super) tolerance: f64,
    /// The reference's own error at the known instants, and the fraction of the run completed at each.
    floor: Vec<f64>,
    parts: Vec<f64>,
    /// Growth factor of errors from the last known instant to the end of the run.
    growth: f64,
    pub(super) outlook: Outlook,
}

impl Reference {
    /// Computes the finest reference that the budget allows. A coarser reference that covers more of the run is
    /// preferred to a finer one that covers less, if it is accurate enough.
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

    /// The motion of bodies without loads, which is known to `error`.
    pub(super) fn closed_form(flights: &mut Flights<'_>, error: f64) -> Result<Self, ChoiceError> {
        let course = flights.closed_form()?;
        let floor = vec![error; course.states.len()];
        Ok(Self::of(flights, course, TOLERANCES[1], floor))
    }

    fn of(flights: &Flights<'_>, course: Course, tolerance: f64, floor: Vec<f64>) -> Self {
        let end = flights.time(flights.instants() - 1);
        Self {
            parts: (0..floor.len()).map(|i| flights.time(i) / end).collect(),
            course,
            tolerance,
            floor,
            growth: 1.0,
            outlook: Outlook::Met,
        }
    }

    /// Integrates a reference and estimates its floor.
    fn fly(flights: &mut Flights<'_>, tolerance: f64, most: f64) -> Result<Self, ChoiceError> {
        let course = flights.adaptive(Tuned::DormandPrince, tolerance, most, |_, _| true)?;
        if let End::Failed(error) = course.end {
            return Err(ChoiceError::Flight(error));
        }
        let mut floor = vec![0.0_f64; course.states.len()];
        let accuracy = flights.accuracy;
        for factor in LOOSER {
            let other = flights.adaptive(
                Tuned::DormandPrince,
                factor * tolerance,
                most,
                |instant, states| {
                    let error = course
                        .states
                        .get(instant)
                        .map_or(f64::INFINITY, |truth| accuracy.error(states, truth));
                    if let Some(floor) = floor.get_mut(instant) {
                        *floor = floor.max(MARGIN * error);
                    }
                    error <= RESOLVED
                },
            )?;
            floor.truncate(other.states.len());
        }
        if floor.is_empty() {
            return Err(ChoiceError::Costly {
                horizon: flights.time(0),
                evaluations: flights.evaluations(),
            });
        }
        Ok(Self::of(flights, course, tolerance, floor))
    }

    /// Returns true if this reference is accurate to the tolerance over more of the run than `other`, or over the same
    /// part with a smaller error.
    fn knows_more(&self, other: &Self, tolerance: f64) -> bool {
        let known = |reference: &Self| reference.known(tolerance).map(|last| reference.parts[last]);
        known(self) > known(other) || known(self) == known(other) && self.end() <= other.end()
    }

    /// Returns true if it ended because the budget was spent, and not because its error became too large.
    fn is_costly(&self) -> bool {
        self.course.end == End::Costly && self.end() <= RESOLVED
    }

    /// The growth factor of errors from an instant to the end of the run.
    fn growth_from(&self, instant: usize) -> f64 {
        if self.is_costly() {
            self.parts[instant].powi(-2)
        } else {
            1.0
        }
    }

    /// The last instant at which the reference's own error is a small enough fraction of the tolerance.
    fn known(&self, tolerance: f64) -> Option<usize> {
        let own = |instant: &usize| self.floor[*instant] * self.growth_from(*instant);
        (0..self.floor.len())
            .rev()
            .find(|instant| own(instant) <= PART * tolerance)
    }

    /// The reference's own error at the last instant.
    fn end(&self) -> f64 {
        self.floor.last().copied().unwrap_or(f64::INFINITY)
    }

    /// Determines the outlook for the end of the run.
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

    /// The reference's own error, extrapolated to the end of the run.
    pub(super) fn floor(&self) -> f64 {
        self.growth * self.end()
    }

    /// The cost of the reference flight.
    pub(super) fn cost(&self) -> f64 {
        self.course.cost
    }

    /// Starts a comparison of a flight with this reference.
    pub(super) fn comparison(&self, flights: &Flights<'_>, tolerance: f64) -> Comparison<'_> {
        Comparison {
            reference: self,
            accuracy: flights.accuracy,
            hopeless: HOPELESS * tolerance / self.growth,
            greatest: 0.0,
            error: f64::INFINITY,
        }
    }

    /// The last instant at which flights are compared.
    pub(super) fn last(&self) -> usize {
        self.floor.len() - 1
    }

    /// The fraction of the run over which flights are compared.
    pub(super) fn part(&self) -> f64 {
        self.parts[self.last()]
    }
}

/// Compares a flight with a reference during the flight.
pub(super) struct Comparison<'a> {
    reference: &'a Reference,
    accuracy: super::Accuracy,
    hopeless: f64,
    greatest: f64,
    /// Error at the end of the run, or infinity if the flight did not get there.
    pub(super) error: f64,
}

impl Comparison<'_> {
    /// Compares the states at an instant. Returns true if the flight should continue.
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
