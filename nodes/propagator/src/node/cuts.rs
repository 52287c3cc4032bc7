//! Steps that could not be made as one and were cut: counted, and told of from time to time.

use std::fmt;
use std::time::Instant;

use crate::node::throttle::Throttle;

/// The cut steps of a flight.
#[derive(Debug, Default)]
pub(crate) struct Cuts {
    total: u64,
    untold: Option<Warning>,
    throttle: Throttle,
}

/// Cut steps since the last warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Warning {
    first: u64,
    last: u64,
    count: u64,
    most: u32,
}

impl Cuts {
    /// Counts the step from `step`, cut into `pieces`, and says what is to be told `now`.
    pub(crate) fn note(&mut self, step: u64, pieces: u32, now: Instant) -> Option<Warning> {
        self.total += 1;
        let untold = self.untold.get_or_insert(Warning {
            first: step,
            last: step,
            count: 0,
            most: 0,
        });
        untold.last = step;
        untold.count += 1;
        untold.most = untold.most.max(pieces);
        if self.throttle.lets(now) {
            self.rest()
        } else {
            None
        }
    }

    /// What has not been told yet.
    pub(crate) fn rest(&mut self) -> Option<Warning> {
        self.untold.take()
    }

    /// Steps that were cut so far.
    pub(crate) fn total(&self) -> u64 {
        self.total
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            first,
            last,
            count,
            most,
        } = self;
        if first == last {
            write!(f, "step {first} could not be made as one: cut into {most}")
        } else {
            write!(
                f,
                "{count} of steps {first} to {last} could not be made as one: cut into {most} at most"
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn cut_steps_are_told_of_once_a_second_and_none_is_left_out() {
        let mut cuts = Cuts::default();
        let start = Instant::now();
        let at = |milliseconds| start + Duration::from_millis(milliseconds);
        let first = cuts.note(7, 2, at(0)).map(|warning| warning.to_string());
        let expected = "step 7 could not be made as one: cut into 2";
        assert_eq!(first.as_deref(), Some(expected));
        assert_eq!(cuts.note(8, 4, at(1)), None);
        assert_eq!(cuts.note(12, 2, at(999)), None);
        let second = cuts
            .note(13, 2, at(1000))
            .map(|warning| warning.to_string());
        let expected = "3 of steps 8 to 13 could not be made as one: cut into 4 at most";
        assert_eq!(second.as_deref(), Some(expected));
        assert_eq!(cuts.rest(), None);
        assert_eq!(cuts.note(14, 2, at(1001)), None);
        assert_eq!(cuts.rest().map(|warning| warning.count), Some(1));
        assert_eq!(cuts.total(), 5);
    }
}
