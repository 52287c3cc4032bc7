/// The way down to the shortest final time `T*` at which a plan exists.
///
/// The least cost `J(T)` is bounded, but its slope tends to `−∞` as `T → T*`: with commands at their limits but for a
/// part `O(ε)` of the time around each switch, `ε = −1/J'`, the time that is lost is `T − T* = c ε²`. Two plans determine
/// `c` and `T*`. In steps of a fixed size the slope stays finite, as at most one step per switch is not at its limit, and
/// `T*` is bracketed.
pub(super) struct Approach {
    shortest: f64,
    tolerance: f64,
    /// The greatest cost per unit of time.
    rate: f64,
    /// Final times with a plan and their slopes, the shortest last.
    found: Vec<[f64; 2]>,
    /// The greatest lower bound of `T*`.
    bound: f64,
    /// The longest final time, shorter than that of all plans, at which none was found.
    missed: Option<f64>,
    /// The gap before the last plan.
    gap: f64,
}

/// Part of the estimated distance to `T*` that is kept as a margin.
const MARGIN: f64 = 0.2;
/// Least part of the final time that is kept in one step.
const LEAST: f64 = 0.7;
/// Part of the tolerance by which the final time is lowered at least.
const LOWERED: f64 = 0.9;

impl Approach {
    /// The way down to `shortest` at most, until the bracket of `T*` is as narrow as a relative `tolerance`.
    pub(super) fn new(shortest: f64, tolerance: f64, rate: f64) -> Self {
        Self {
            shortest,
            tolerance,
            rate,
            found: Vec::new(),
            bound: 0.0,
            missed: None,
            gap: f64::INFINITY,
        }
    }

    /// Takes a plan's final time, shorter than those before, its cost and its slope.
    ///
    /// Where `J` is convex, it lies above its tangent, and `J(T) ≤ rate T`. Both lines meet at a lower bound of `T*`.
    pub(super) fn take(&mut self, final_time: f64, cost: f64, slope: f64) {
        self.gap = self
            .found
            .last()
            .map_or(f64::INFINITY, |[last, _]| last - self.low());
        self.found.push([final_time, slope]);
        if final_time < self.bound {
            // `J` is not convex.
            self.bound = 0.0;
        }
        if slope < 0.0 {
            let meet = (cost - slope * final_time) / (self.rate - slope);
            self.prove(meet.min(final_time));
        }
        self.missed = self.missed.filter(|missed| *missed < final_time);
    }

    /// Takes a lower bound of `T*`.
    pub(super) fn prove(&mut self, bound: f64) {
        self.bound = self.bound.max(bound);
    }

    /// Notes that no plan was found at a final time.
    pub(super) fn miss(&mut self, final_time: f64) {
        self.missed = Some(final_time);
    }

    /// The greatest lower bound of `T*`, or 0.
    pub(super) fn bound(&self) -> f64 {
        self.bound
    }

    /// The longest final time, shorter than that of all plans, at which none was found.
    pub(super) fn missed(&self) -> Option<f64> {
        self.missed
    }

    /// The next final time to try; `None` if the bracket is narrow enough.
    pub(super) fn next(&self) -> Option<f64> {
        let [last, _] = *self.found.last()?;
        let low = self.low();
        let gap = last - low;
        let width = self.tolerance * last;
        if last <= self.shortest || gap <= width {
            return None;
        }
        let halved = gap <= 0.5 * self.gap;
        let next = match self.estimate() {
            Some(estimate) if halved && estimate > low => estimate + MARGIN * (last - estimate),
            _ => 0.5 * (low + last),
        };
        let next = next.min(last - LOWERED * width).max(LEAST * last);
        Some(next.max(self.shortest))
    }

    /// The lower end of the bracket.
    fn low(&self) -> f64 {
        self.missed.unwrap_or(0.0).max(self.bound)
    }

    /// `T*` by extrapolation from the last two plans.
    fn estimate(&self) -> Option<f64> {
        let [.., [longer, before], [last, slope]] = self.found[..] else {
            return None;
        };
        let square = |slope: f64| 1.0 / (slope * slope);
        let fell = square(before) - square(slope);
        let usable = before < 0.0 && slope < before && fell > 0.0;
        usable.then(|| last - square(slope) * (longer - last) / fell)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Approaches `T* = 2` with `J = rate T − 2 √(c (T − 2))`, so that `T − 2 = c/J'²` near it, where no plan is found
    /// below `least`. Returns the last final time with a plan, the bracket, and the number of tries.
    fn approached(start: f64, shortest: f64, least: f64) -> (f64, Approach, usize) {
        let (rate, c) = (1.0, 0.3_f64);
        let mut approach = Approach::new(shortest, 1e-6, rate);
        let mut tries = 0;
        let mut place = start;
        let mut last = start;
        loop {
            tries += 1;
            if place >= least {
                let root = (c * (place - 2.0)).sqrt();
                approach.take(place, rate * place - 2.0 * root, rate - c / root);
                last = place;
            } else {
                approach.miss(place);
            }
            match approach.next() {
                Some(next) if tries < 200 => place = next,
                _ => return (last, approach, tries),
            }
        }
    }

    #[test]
    fn the_slope_leads_to_the_shortest_time_with_a_proof() {
        for start in [2.001, 2.05, 2.25] {
            let (last, approach, tries) = approached(start, 0.1, 2.0);
            assert!((2.0..2.0 + 3e-6).contains(&last), "{last}");
            assert!(approach.bound() <= 2.0 && last - approach.bound() <= 2.1e-6);
            assert!(tries <= 20, "{tries} from {start}");
        }
    }

    #[test]
    fn where_plans_end_before_the_slope_is_steep_the_time_is_bracketed() {
        let (last, approach, tries) = approached(2.25, 0.1, 2.1);
        assert!((2.1..2.1 + 3e-6).contains(&last), "{last}");
        let missed = approach.missed().expect("a time without a plan");
        assert!(missed < 2.1 && last - missed <= 2.2e-6);
        assert!(approach.bound() < 2.0 && tries <= 40, "{tries}");
    }

    #[test]
    fn the_shortest_time_of_the_range_is_the_last() {
        assert_eq!(approached(2.25, 2.2, 2.0).0, 2.2);
    }
}
