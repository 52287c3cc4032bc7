use super::Task;
use super::family::{Extent, Family, Kind};
use super::flight::{Failure, Flights};
use super::pilot::{Pilot, RESOLVED};

/// How near to the resolution that is needed one must be measured.
const NEAR: f64 = 1.2;

/// Factor by which resolutions grow at most from one flight to the next.
const FINER: f64 = 3.0;

/// Substeps up to which each number of them is flown, and how many times fewer than seem to be needed may be enough.
const MANY: u32 = 5;
const PERHAPS: f64 = 1.4;

/// Error at the end of a pilot that can be told from rounding.
const TOLD: f64 = 1e-12;

/// Steps of an adaptive method in a radian of the fastest motion for each unit of resolution: a guess that is low.
const ADAPTIVE: f64 = 0.05;

/// Flights of one method in a race.
const FLIGHTS: u32 = 10;

/// A method in the race.
pub(super) struct Contender {
    pub(super) family: Family,
    /// In ascending order of resolution.
    points: Vec<Point>,
    /// Resolution that an earlier pilot let expect.
    pub(super) expected: f64,
    /// Steps of an adaptive method for each unit of resolution, as an earlier pilot let expect.
    rate: f64,
    /// Resolutions below cannot be flown.
    least: f64,
    flights: u32,
    pub(super) closed: bool,
}

/// What a pilot flight has told.
#[derive(Clone, Copy, Debug)]
struct Point {
    resolution: f64,
    /// At the end of the pilot.
    now: f64,
    /// Expected at the end of the run.
    end: f64,
    /// Steps that the method would make in the run.
    steps: f64,
}

impl Contender {
    pub(super) fn new(family: Family, radians: f64) -> Self {
        Self {
            family,
            points: Vec::new(),
            expected: family.coarse(radians),
            rate: ADAPTIVE * radians,
            least: 0.0,
            flights: 0,
            closed: false,
        }
    }

    /// Forgets the flights but for what they let expect of those of a longer pilot.
    pub(super) fn expect(&mut self, target: f64) {
        self.expected = self.needed(target, 1.0);
        self.rate = self.steps(self.expected) / self.expected;
        self.closed = !self.is_known();
        self.points.clear();
        self.flights = 0;
    }

    /// Makes one flight towards the resolution that is needed.
    pub(super) fn fly(
        &mut self,
        flights: &mut Flights<'_>,
        task: &Task,
        pilot: &Pilot,
        correction: f64,
    ) {
        let extent = pilot.extent(task);
        let steps = task.run.steps as f64;
        let finest = self.points.last();
        let finest = finest.map_or(f64::INFINITY, |point| FINER * point.resolution);
        let wanted = self.wanted(pilot.target, correction).min(finest);
        let wanted = self
            .few(pilot.target, extent, steps)
            .flatten()
            .unwrap_or(wanted);
        let (plan, resolution) = self.family.plan(wanted, extent);
        let again = self
            .points
            .iter()
            .any(|point| point.resolution == resolution);
        self.flights += 1;
        self.closed = again || self.flights == FLIGHTS;
        if again {
            return;
        }
        let flown = flights.fly(plan, u64::MAX);
        match flown {
            Ok(flight) => {
                let [now, end] = pilot.error(&flight, task);
                let point = Point {
                    resolution,
                    now,
                    end: end.max(f64::MIN_POSITIVE),
                    steps: flight.steps as f64 / extent.part,
                };
                let at = self.points.partition_point(|p| p.resolution < resolution);
                self.points.insert(at, point);
            }
            Err(Failure::Step(_)) => self.least = self.least.max(1.5 * resolution),
            Err(Failure::Method(_) | Failure::Allowance) => self.closed = true,
        }
    }

    /// Steps that the method makes in the run at a resolution.
    pub(super) fn steps(&self, resolution: f64) -> f64 {
        match self.family.kind {
            Kind::Equal(_) | Kind::Closed(_) => resolution,
            Kind::Adaptive(_) => {
                let per = self
                    .nearest(resolution)
                    .map(|point| point.steps / point.resolution);
                resolution * per.unwrap_or(self.rate)
            }
        }
    }

    fn nearest(&self, resolution: f64) -> Option<&Point> {
        let distance = |point: &&Point| libm::fabs(libm::log(point.resolution / resolution));
        self.points
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// 0 with steps of equal length, 1 otherwise: errors grow alike in a class.
    pub(super) fn class(&self) -> usize {
        usize::from(!self.is_equal())
    }

    fn is_equal(&self) -> bool {
        matches!(self.family.kind, Kind::Equal(_))
    }

    fn is_exact(&self) -> bool {
        matches!(self.family.kind, Kind::Closed(_))
    }

    /// Whether an earlier pilot has told something, and this one nothing.
    pub(super) fn is_expected(&self) -> bool {
        !self.closed && self.points.is_empty()
    }

    /// Whether a flight has told anything.
    pub(super) fn is_known(&self) -> bool {
        self.is_exact() || self.points.iter().any(|point| point.now < RESOLVED)
    }

    /// The resolution that `target` seems to need.
    pub(super) fn needed(&self, target: f64, correction: f64) -> f64 {
        if self.is_exact() {
            return 1.0;
        }
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
                    Some(0) => {
                        let unresolved = first
                            .checked_sub(1)
                            .map_or(0.0, |i| self.points[i].resolution);
                        along(&points[0], order).max(NEAR * unresolved)
                    }
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
    pub(super) fn error(&self, resolution: f64) -> Option<f64> {
        if self.is_exact() {
            return Some(f64::EPSILON);
        }
        let order = f64::from(self.family.order);
        let finer = self
            .points
            .iter()
            .position(|point| point.resolution >= resolution);
        let slope = match finer {
            Some(finer @ 1..) => {
                let [a, b] = [self.points[finer - 1], self.points[finer]];
                libm::log(a.end / b.end) / libm::log(b.resolution / a.resolution)
            }
            _ => order,
        };
        let nearest = self.nearest(resolution)?;
        Some(nearest.end * libm::pow(nearest.resolution / resolution, slope))
    }

    fn is_near(&self, wanted: f64) -> bool {
        let resolved = self.points.iter().filter(|point| point.now < RESOLVED);
        let mut ratios = resolved.map(|point| point.resolution / wanted);
        ratios.any(|ratio| ratio < NEAR && ratio > NEAR.recip())
    }

    /// Where few substeps are needed and the whole run is flown, each number of them is flown by itself: the resolution of
    /// the next, if any is left.
    fn few(&self, target: f64, extent: Extent, steps: f64) -> Option<Option<f64>> {
        let told = self.points.iter().any(|point| point.now < RESOLVED);
        let needed = self.needed(target, 1.0);
        let (substeps, enough) = self.family.substeps(needed, steps);
        if !(told && extent.whole && self.is_equal() && substeps <= MANY) {
            return None;
        }
        let flown = |n: f64| {
            self.points
                .iter()
                .any(|p| libm::fabs(p.resolution / n - 1.0) < 1e-9)
        };
        let fewer = enough - steps;
        let perhaps = fewer > 0.0 && needed < PERHAPS * fewer;
        Some(if !flown(enough) {
            Some(enough)
        } else {
            (perhaps && !flown(fewer)).then_some(fewer)
        })
    }

    /// Whether more flights would tell nothing more of the cost.
    pub(super) fn is_settled(&self, target: f64, extent: Extent, steps: f64) -> bool {
        let cheapest = self.family.cheapest(steps, extent.part);
        let needed = self.needed(target, 1.0);
        let is_cheapest = |point: &Point| {
            let enough = point.now < RESOLVED && point.end <= target;
            let surely = point.resolution <= cheapest
                || NEAR * needed <= cheapest && point.resolution <= FINER * cheapest;
            enough && surely
        };
        let near = || match self.few(target, extent, steps) {
            Some(next) => next.is_none(),
            None => self.is_near(self.wanted(target, 1.0)),
        };
        self.is_exact() || self.points.iter().any(is_cheapest) || near()
    }
}
