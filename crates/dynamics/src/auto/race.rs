use super::cost::Cost;
use super::family::Family;
use super::flight::{Failure, Flights, Plan};
use super::pilot::{Pilot, RESOLVED};
use super::{Candidate, Task};

/// How near to the resolution that is needed one must be measured.
const NEAR: f64 = 1.2;

/// Predicted costs, in multiples of the least, up to which a method is measured.
const CONTENDING: f64 = 1.3;

/// Factor by which resolutions grow at most from one flight to the next.
const FINER: f64 = 3.0;

/// Error at the end of a pilot that can be told from rounding.
const TOLD: f64 = 1e-12;

/// Flights of one method in a race.
const FLIGHTS: u32 = 10;

/// Which method reaches the tolerance at the least cost: each is measured as long as it looks as if it could win.
pub(super) struct Race {
    contenders: Vec<Contender>,
    steps: f64,
    cost: Cost,
    /// Errors in multiples of what an earlier pilot let expect, once there was one.
    correction: Option<f64>,
}

/// A method in the race.
struct Contender {
    family: Family,
    /// In ascending order of resolution.
    points: Vec<Point>,
    /// Resolution that an earlier pilot let expect.
    expected: f64,
    /// Resolutions below cannot be flown.
    least: f64,
    flights: u32,
    closed: bool,
}

/// What a pilot flight has told.
#[derive(Clone, Copy, Debug)]
struct Point {
    resolution: f64,
    /// At the end of the pilot.
    now: f64,
    /// Expected at the end of the run.
    end: f64,
}

impl Race {
    pub(super) fn new(task: &Task, cost: Cost) -> Self {
        let radians = task.rate * task.run.duration;
        let contender = |family: &Family| Contender {
            family: *family,
            points: Vec::new(),
            expected: family.coarse(radians),
            least: 0.0,
            flights: 0,
            closed: false,
        };
        Self {
            contenders: task.families.iter().map(contender).collect(),
            steps: task.run.steps as f64,
            cost,
            correction: None,
        }
    }

    /// Races for the target of `pilot`.
    pub(super) fn run(&mut self, flights: &mut Flights<'_>, task: &Task, pilot: &Pilot) {
        while let Some(index) = self.next(pilot) {
            let again = self.correction;
            let contender = &mut self.contenders[index];
            contender.fly(flights, task, pilot, again.unwrap_or(1.0));
            if again.is_some() && contender.is_settled(pilot, self.steps) {
                let ratio = contender.needed(pilot.target, 1.0) / contender.expected;
                self.correction = Some(libm::pow(ratio, contender.family.order.into()));
            }
        }
    }

    /// Forgets the flights but for what they let expect of those of a longer pilot, for the target of the last one.
    pub(super) fn expect(&mut self, target: f64) {
        self.correction = Some(1.0);
        for contender in &mut self.contenders {
            contender.expected = contender.needed(target, 1.0);
            contender.closed = contender.points.is_empty();
            contender.points.clear();
            contender.flights = 0;
        }
    }

    /// Evaluations of gravity in the flight that looks cheapest.
    pub(super) fn evaluations(&self, pilot: &Pilot) -> Option<f64> {
        let measured = self.contenders.iter().filter(|c| c.is_known());
        let cheapest = measured.min_by(|a, b| {
            self.predicted(a, pilot)
                .total_cmp(&self.predicted(b, pilot))
        })?;
        let needed = cheapest.needed(pilot.target, 1.0);
        let evaluations = needed.max(self.steps) * f64::from(cheapest.family.stages);
        Some(evaluations)
    }

    /// All that were measured, the cheapest first.
    pub(super) fn candidates(&self, pilot: &Pilot) -> Vec<Candidate> {
        let measured = self.contenders.iter().filter(|c| c.is_known());
        let mut candidates: Vec<_> = measured
            .filter_map(|contender| {
                let needed = contender.needed(pilot.target, self.correction.unwrap_or(1.0));
                let (substeps, resolution) = contender.family.substeps(needed, self.steps);
                Some(Candidate {
                    method: contender.family.method(resolution),
                    substeps,
                    error: contender.error(resolution),
                    cost: self.cost.flight(&contender.family, resolution, self.steps),
                    measured: contender.is_settled(pilot, self.steps),
                })
            })
            .collect();
        candidates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        candidates
    }

    fn predicted(&self, contender: &Contender, pilot: &Pilot) -> f64 {
        let needed = contender.needed(pilot.target, self.correction.unwrap_or(1.0));
        let (_, resolution) = contender.family.substeps(needed, self.steps);
        self.cost.flight(&contender.family, resolution, self.steps)
    }

    /// The cheapest of those that are to be measured yet.
    fn next(&self, pilot: &Pilot) -> Option<usize> {
        let running = || {
            let all = self.contenders.iter().enumerate();
            all.filter(|(_, c)| !(c.closed && c.points.is_empty()))
        };
        let cost = |c: &Contender| self.predicted(c, pilot);
        let least = running()
            .map(|(_, c)| cost(c))
            .fold(f64::INFINITY, f64::min);
        running()
            .filter(|(_, c)| !c.closed && !c.is_settled(pilot, self.steps))
            .map(|(index, c)| (index, cost(c)))
            .filter(|(_, cost)| *cost <= CONTENDING * least)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(index, _)| index)
    }
}

impl Contender {
    /// Makes one flight towards the resolution that is needed.
    fn fly(&mut self, flights: &mut Flights<'_>, task: &Task, pilot: &Pilot, correction: f64) {
        let finest = self
            .points
            .last()
            .map_or(f64::INFINITY, |point| FINER * point.resolution);
        let wanted = self.wanted(pilot.target, correction).min(finest);
        let (steps, resolution) = self.family.steps(wanted, pilot.part());
        let again = self
            .points
            .iter()
            .any(|point| point.resolution == resolution);
        self.flights += 1;
        self.closed = again || self.flights == FLIGHTS;
        if again {
            return;
        }
        let flown = flights.fly(Plan {
            method: self.family.method(resolution),
            horizon: pilot.flown(),
            steps,
            evaluations: self.family.stages.into(),
        });
        match flown {
            Ok(flight) => {
                let [now, end] = pilot.error(&flight, task);
                let point = Point {
                    resolution,
                    now,
                    end: end.max(f64::MIN_POSITIVE),
                };
                let at = self.points.partition_point(|p| p.resolution < resolution);
                self.points.insert(at, point);
            }
            Err(Failure::Step(_)) => self.least = self.least.max(1.5 * resolution),
            Err(Failure::Method(_) | Failure::Allowance) => self.closed = true,
        }
    }

    /// Whether a flight has told anything.
    fn is_known(&self) -> bool {
        self.points.iter().any(|point| point.now < RESOLVED)
    }

    /// The resolution that `target` seems to need.
    fn needed(&self, target: f64, correction: f64) -> f64 {
        let order = f64::from(self.family.order);
        let along = |from: &Point, order: f64| {
            from.resolution * libm::pow(from.end / target, order.recip())
        };
        let resolved = self.points.iter().position(|point| point.now < RESOLVED);
        let needed = match resolved {
            None => match self.points.last() {
                None => self.expected * libm::pow(correction, order.recip()),
                Some(unresolved) => 2.0 * unresolved.resolution,
            },
            Some(first) => {
                let points = &self.points[first..];
                match points.iter().position(|point| point.end <= target) {
                    None => along(&points[points.len() - 1], order),
                    Some(0) => along(&points[0], order),
                    Some(fine) => {
                        let [a, b] = [points[fine - 1], points[fine]];
                        let slope =
                            libm::log(a.end / b.end) / libm::log(b.resolution / a.resolution);
                        along(&a, slope).clamp(a.resolution, b.resolution)
                    }
                }
            }
        };
        needed.max(self.least)
    }

    /// The resolution to be flown: the one that is needed, as far as its error can be told.
    fn wanted(&self, target: f64, correction: f64) -> f64 {
        let order = f64::from(self.family.order);
        let told = self
            .points
            .iter()
            .rfind(|point| point.now < RESOLVED && point.now > TOLD);
        let finest = told.map_or(f64::INFINITY, |point| {
            point.resolution * libm::pow(point.now / TOLD, order.recip())
        });
        self.needed(target, correction).min(finest)
    }

    /// The error at the end of the run to be expected with a resolution.
    fn error(&self, resolution: f64) -> f64 {
        let distance = |point: &&Point| libm::fabs(libm::log(point.resolution / resolution));
        let nearest = self
            .points
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(f64::INFINITY, |point| {
            point.end * libm::pow(point.resolution / resolution, self.family.order.into())
        })
    }

    /// Whether more flights would tell nothing more of the cost.
    fn is_settled(&self, pilot: &Pilot, steps: f64) -> bool {
        let target = pilot.target;
        let wanted = self.wanted(target, 1.0);
        let (_, coarsest) = self.family.steps(0.0, pilot.part());
        self.points
            .iter()
            .filter(|point| point.now < RESOLVED)
            .any(|point| {
                let ratio = point.resolution / wanted;
                let enough = point.end <= target;
                let cheapest = enough && point.resolution <= coarsest.max(steps * NEAR);
                cheapest || (ratio < NEAR && ratio > NEAR.recip())
            })
    }
}
