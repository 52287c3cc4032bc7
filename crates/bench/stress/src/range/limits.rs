//! What must fly, by the limits of numbers, and what came of it.

use crate::Report;

/// What has limits.
pub(super) struct Numbers {
    pub(super) h: f64,
    pub(super) mass: f64,
    /// Of the inertia.
    pub(super) trace: f64,
    /// Greatest distance of a body from the origin, or of a point from its body's.
    pub(super) farthest: f64,
}

impl Numbers {
    /// Whether they are within the limits of numbers of `docs/stability.md`.
    pub(super) fn are_within(&self) -> bool {
        (1e-30..=1e30).contains(&self.h)
            && (1e-60..=1e60).contains(&self.mass)
            && (1e-100..=1e100).contains(&self.trace)
            && (1e-60..=1e60).contains(&(self.trace / self.mass))
            && self.farthest <= 1e30
    }
}

/// What has become of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    Refused,
    Right,
    Wrong,
}

/// How many flights came to what.
#[derive(Default)]
pub(super) struct Tally {
    /// Right ones of those that must fly.
    flown: u32,
    /// Those that must.
    must: u32,
    right: u32,
    refused: u32,
    pub(super) wrong: u32,
}

impl Tally {
    pub(super) fn add(&mut self, must: bool, outcome: Outcome) {
        self.must += u32::from(must);
        self.flown += u32::from(must && outcome == Outcome::Right);
        match outcome {
            Outcome::Refused => self.refused += 1,
            Outcome::Right => self.right += 1,
            Outcome::Wrong => self.wrong += 1,
        }
    }

    /// Tells of those that must fly, with the first that was refused, and how many others there are. None that must is too few.
    pub(super) fn tell(&self, report: &mut Report, of: &str, refused: Option<String>) {
        let first = refused.map_or_else(String::new, |first| format!(", first refused {first}"));
        report.within(
            format!("{of}right of those within the limits{first}"),
            f64::from(self.flown),
            [f64::from(self.must.max(1)); 2],
        );
        report.shows("right of the others", f64::from(self.right - self.flown));
        report.shows("refused", f64::from(self.refused));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tally_without_flights_does_not_pass() {
        for (outcomes, passes) in [
            (vec![], false),
            (
                vec![(true, Outcome::Right), (false, Outcome::Refused)],
                true,
            ),
            (
                vec![(true, Outcome::Right), (true, Outcome::Refused)],
                false,
            ),
            (vec![(false, Outcome::Refused)], false),
        ] {
            let mut tally = Tally::default();
            for (must, outcome) in outcomes {
                tally.add(must, outcome);
            }
            let mut report = Report::default();
            tally.tell(&mut report, "", None);
            assert_eq!(report.passes(), passes, "{report:?}");
        }
    }
}
