//! The steps of a transfer in which a constraint holds.

use std::ops::Range;

use super::Constraint;
use crate::problem::ParameterError;

/// A constraint that holds in some steps of a transfer only, see [`Constraint::during`].
#[derive(Clone, Debug, PartialEq)]
pub struct During {
    pub(super) constraint: Constraint,
    pub(super) steps: Range<usize>,
}

impl Constraint {
    /// The constraint in some steps of a transfer: on the commands of `steps`, and on the states from the start of the first of
    /// them to the end of the last, both included. Of a constraint that holds in some steps only, those among them.
    ///
    /// Steps that the transfer does not have are left out.
    ///
    /// # Errors
    /// Returns an error if no step is left.
    pub fn during(self, steps: Range<usize>) -> Result<Self, ParameterError> {
        let (constraint, price) = match self {
            Self::Priced(priced) => (priced.constraint, Some(priced.price)),
            constraint => (constraint, None),
        };
        let (constraint, steps) = match constraint {
            Self::During(during) => {
                let own = during.steps;
                let both = steps.start.max(own.start)..steps.end.min(own.end);
                (during.constraint, both)
            }
            constraint => (constraint, steps),
        };
        if steps.is_empty() {
            let expected = "a range of one or more steps";
            return Err(ParameterError::new("steps", steps, expected));
        }
        let during = Self::During(Box::new(During { constraint, steps }));
        match price {
            Some(price) => during.priced(price),
            None => Ok(during),
        }
    }

    /// The steps in which it holds, or `None` if it holds in all.
    pub fn steps(&self) -> Option<Range<usize>> {
        match self {
            Self::Priced(priced) => priced.constraint.steps(),
            Self::During(during) => Some(during.steps.clone()),
            _ => None,
        }
    }
}

/// Steps of a transfer with a number of steps. At other resolutions they are the same part of its duration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    from: usize,
    to: usize,
    of: usize,
}

impl Window {
    /// The steps of a transfer of `intervals`, or `None` if it has none of them.
    pub(super) fn new(steps: &Range<usize>, intervals: usize) -> Option<Self> {
        let to = steps.end.min(intervals);
        (steps.start < to).then_some(Self {
            from: steps.start,
            to,
            of: intervals,
        })
    }

    /// Whether the middle of one of `intervals` steps is inside.
    pub(crate) fn holds_in(&self, step: usize, intervals: usize) -> bool {
        let middle = (2 * step + 1) * self.of;
        (2 * self.from * intervals..2 * self.to * intervals).contains(&middle)
    }

    /// Whether state `end` of `0 … intervals` is inside or at a bound.
    pub(super) fn holds_at(&self, end: usize, intervals: usize) -> bool {
        (self.from * intervals..=self.to * intervals).contains(&(end * self.of))
    }

    /// The part of one of `intervals` steps that is inside, between numbers from 0 to 1; without length if none is.
    pub(super) fn within(&self, step: usize, intervals: usize) -> [f64; 2] {
        [self.from, self.to].map(|bound| {
            let before = step * self.of;
            let past = (bound * intervals).saturating_sub(before).min(self.of);
            past as f64 / self.of as f64
        })
    }

    /// The steps of the transfer that starts so many steps later, or `None` if they are over.
    pub(super) fn later(&self, steps: usize) -> Option<Self> {
        let rest = self.from.saturating_sub(steps)..self.to.saturating_sub(steps);
        Self::new(&rest, self.of.saturating_sub(steps))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_exact_at_any_number_and_ends_belong_to_both_sides() {
        for of in 2..60 {
            for from in 0..of {
                for to in from + 1..=of {
                    let window = Window::new(&(from..to), of).unwrap();
                    for step in 0..of {
                        let inside = (from..to).contains(&step);
                        assert_eq!(window.holds_in(step, of), inside);
                        let part = if inside { [0.0, 1.0] } else { [0.0; 2] };
                        let found = window.within(step, of);
                        assert!(found == part || !inside && found == [1.0; 2]);
                        let ends = window.holds_at(step + 1, of);
                        assert_eq!(ends, (from..=to).contains(&(step + 1)));
                    }
                }
            }
        }
    }

    #[test]
    fn at_another_resolution_they_are_the_same_part_of_the_duration() {
        let window = Window::new(&(15..40), 50).unwrap();
        let steps: Vec<_> = (0..10).filter(|&step| window.holds_in(step, 10)).collect();
        assert_eq!(steps, [3, 4, 5, 6, 7]);
        let ends: Vec<_> = (0..=10).filter(|&end| window.holds_at(end, 10)).collect();
        assert_eq!(ends, [3, 4, 5, 6, 7, 8]);
        assert_eq!(window.within(3, 10), [0.0, 1.0]);
        assert_eq!(window.within(2, 8), [0.4, 1.0]);
        assert_eq!(window.within(6, 8), [0.0, 0.4]);
    }

    #[test]
    fn later_they_are_fewer_and_then_over() {
        let window = Window::new(&(15..40), 50).unwrap();
        assert_eq!(window.later(10), Window::new(&(5..30), 40));
        assert_eq!(window.later(20), Window::new(&(0..20), 30));
        assert_eq!(window.later(40), None);
        assert_eq!(Window::new(&(60..70), 50), None);
        assert_eq!(Window::new(&(45..70), 50).unwrap().to, 50);
    }
}
