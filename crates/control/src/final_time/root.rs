/// A search for the minimum of a function in a range by its slope, downhill from a start.
///
/// While the slope has one sign, the steps follow the secant. Then secants between both signs are used, with bisection
/// whenever two of them have not halved the slope. The search converges superlinearly.
pub(super) struct Root {
    range: [f64; 2],
    tolerance: f64,
    /// Points tried so far: argument and slope.
    tried: Vec<[f64; 2]>,
    /// The nearest arguments at which the function falls and rises.
    falls: Option<f64>,
    rises: Option<f64>,
}

/// The next action of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Next {
    /// Evaluate the slope at this argument.
    Try(f64),
    /// Stop: the last argument is the minimum.
    Minimum,
    /// Stop: the function falls to the lower end of the range.
    Lower,
    /// Stop: the function falls to the upper end of the range.
    Upper,
}

/// Largest factor by which the argument changes, and the factor of the first step.
const LONGEST: f64 = 1.2;
const FIRST: f64 = 1.05;

impl Root {
    /// A search in `range` (positive), to a relative `tolerance` of the argument.
    pub(super) fn new(range: [f64; 2], tolerance: f64) -> Self {
        Self {
            range,
            tolerance,
            tried: Vec::new(),
            falls: None,
            rises: None,
        }
    }

    /// Takes the slope at an argument and returns the next action.
    pub(super) fn next(&mut self, place: f64, slope: f64) -> Next {
        let [low, high] = self.range;
        self.tried.push([place, slope]);
        if slope < 0.0 {
            self.falls = Some(place);
            if place >= high {
                return Next::Upper;
            }
        } else if slope > 0.0 {
            self.rises = Some(place);
            if place <= low {
                return Next::Lower;
            }
        } else {
            return Next::Minimum;
        }
        let secant = self.secant();
        let (Some(falls), Some(rises)) = (self.falls, self.rises) else {
            return Next::Try(self.onward(place, slope, secant));
        };
        if secant.is_some_and(|next| (next - place).abs() <= self.tolerance * place)
            || (rises - falls).abs() <= self.tolerance * place
        {
            return Next::Minimum;
        }
        let inside = |next: &f64| *next > falls.min(rises) && *next < falls.max(rises);
        let middle = 0.5 * (falls + rises);
        Next::Try(match secant.filter(inside) {
            Some(next) if self.quick() => next,
            _ => middle,
        })
    }

    /// The zero of the line through the last two slopes.
    fn secant(&self) -> Option<f64> {
        let [.., [a, f], [b, g]] = self.tried[..] else {
            return None;
        };
        let next = b - g * (b - a) / (g - f);
        next.is_finite().then_some(next)
    }

    /// The next argument downhill, while only one sign of the slope is known.
    fn onward(&self, place: f64, slope: f64, secant: Option<f64>) -> f64 {
        let up = slope < 0.0;
        let ratio = secant.map(|next| if up { next / place } else { place / next });
        // A little beyond the secant's zero, to find the other sign.
        let factor = match ratio {
            Some(ratio) if ratio > 1.0 => (1.0 + 1.2 * (ratio - 1.0)).min(LONGEST),
            Some(_) => LONGEST,
            None => FIRST,
        };
        let next = if up { place * factor } else { place / factor };
        next.clamp(self.range[0], self.range[1])
    }

    /// True if the last two evaluations halved the slope.
    fn quick(&self) -> bool {
        let [.., [_, before], _, [_, now]] = self.tried[..] else {
            return true;
        };
        now.abs() <= 0.5 * before.abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a search. Returns its end, the last argument and the number of evaluations.
    fn search(range: [f64; 2], start: f64, slope: impl Fn(f64) -> f64) -> (Next, f64, usize) {
        let mut root = Root::new(range, 1e-12);
        let mut place = start;
        for tries in 1..200 {
            match root.next(place, slope(place)) {
                Next::Try(next) => place = next,
                end => return (end, place, tries),
            }
        }
        panic!("no end");
    }

    #[test]
    fn minima_are_found_from_both_sides_in_few_tries() {
        let slope = |t: f64| 1.0 - 8.0 / (t * t * t);
        for start in [0.5, 1.9, 2.0, 2.5, 10.0] {
            let (end, place, tries) = search([0.1, 100.0], start, slope);
            assert_eq!(end, Next::Minimum);
            assert!((place / 2.0 - 1.0).abs() < 1e-11, "{place}");
            assert!(tries <= 30, "{tries} from {start}");
        }
    }

    #[test]
    fn slopes_that_mislead_secants_are_bisected() {
        let steep = |t: f64| (t - 2.0).signum() * (t - 2.0).abs().cbrt();
        let flat = |t: f64| (40.0 * (t - 2.0)).tanh() - 0.9;
        for (slope, root) in [
            (&steep as &dyn Fn(f64) -> f64, 2.0),
            (&flat, 2.0 + 0.9_f64.atanh() / 40.0),
        ] {
            let (end, place, tries) = search([0.1, 100.0], 1.0, slope);
            assert_eq!(end, Next::Minimum);
            assert!((place - root).abs() < 1e-11, "{place} for {root}");
            assert!(tries < 100, "{tries}");
        }
    }

    #[test]
    fn a_slope_of_one_sign_ends_at_the_end_of_the_range() {
        assert_eq!(search([1.0, 9.0], 3.0, |_| -1.0).0, Next::Upper);
        let (end, place, _) = search([1.0, 9.0], 3.0, |t| 1.0 / t);
        assert_eq!((end, place), (Next::Lower, 1.0));
        assert_eq!(search([2.0, 2.0], 2.0, |_| 1.0).0, Next::Lower);
    }
}
