//! Control sequences that came too late: one line of the log for many.

use std::time::Instant;

use crate::ControlError;
use crate::node::throttle::Throttle;

/// The late sequences of a flight.
#[derive(Debug, Default)]
pub(super) struct Late {
    throttle: Throttle,
    /// Since then.
    untold: u64,
}

impl Late {
    /// What is still to be told at the end.
    pub(super) fn rest(&mut self) -> Option<String> {
        let others = std::mem::take(&mut self.untold);
        (others > 0).then(|| format!("{others} more control sequences came too late"))
    }

    /// Counts a sequence that came too late, and says what is to be told `now`.
    pub(super) fn note(&mut self, error: &ControlError, now: Instant) -> Option<String> {
        if !self.throttle.lets(now) {
            self.untold += 1;
            return None;
        }
        let others = match std::mem::take(&mut self.untold) {
            0 => String::new(),
            others => format!("; {others} others came too late since the last such message"),
        };
        Some(format!(
            "control sequence refused, too late: {error}{others}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn many_late_sequences_are_one_line_a_second() {
        let error = ControlError::Late {
            first_step: 3,
            step: 10,
        };
        let (mut late, start) = (Late::default(), Instant::now());
        let mut at = |ms| late.note(&error, start + Duration::from_millis(ms));
        let first = at(0).unwrap();
        assert!(first.contains("too late: `first_step` is 3"), "{first}");
        assert!(!first.contains("others"), "{first}");
        assert_eq!((1..1000).find_map(&mut at), None);
        let next = at(1000).unwrap();
        assert!(next.contains("999 others"), "{next}");
        assert!(!at(2000).unwrap().contains("others"));
        assert_eq!(at(2001), None);
        let rest = late.rest().unwrap();
        assert!(rest.starts_with("1 more control sequences"), "{rest}");
        assert_eq!(late.rest(), None);
    }
}
