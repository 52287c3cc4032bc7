//! The part of a bag that is played.

use lgvi_bag::BagReader;
use lgvi_middleware::node::NodeError;
use lgvi_middleware::{ParameterSpec, Parameters};

const NANOSECONDS_PER_SECOND: f64 = 1e9;

/// Recorded times (ns) from the first to the last that is played, both of which belong to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Range {
    pub(crate) start: u64,
    pub(crate) end: u64,
}

/// What is asked for, in seconds.
#[derive(Clone, Copy, Debug, Default)]
struct Asked {
    start_offset: f64,
    duration: Option<f64>,
    until: Option<f64>,
}

impl Range {
    pub(crate) fn specifications() -> [ParameterSpec; 3] {
        let end = |name, description| {
            ParameterSpec::optional::<f64>(name, description).range(0.0, f64::MAX)
        };
        [
            ParameterSpec::new(
                "start_offset",
                0.0,
                "time of the start after the bag's first message (s)",
            )
            .range(0.0, f64::MAX),
            end("duration", "recorded time to play (s); not set: to the end"),
            end(
                "until",
                "time of the end after the bag's first message (s); not set: at the end",
            ),
        ]
    }

    /// The part of a bag to play. A file of the bag may not tell its times.
    pub(crate) fn read(parameters: &Parameters, bag: &BagReader) -> Result<Self, NodeError> {
        let asked = Asked {
            start_offset: parameters.get("start_offset")?,
            duration: parameters.get_optional("duration")?,
            until: parameters.get_optional("until")?,
        };
        let (first, last) = match bag.times() {
            Some(times) => times,
            None => match bag.messages().next() {
                Some(message) => (message.map_err(NodeError::input)?.log_time, u64::MAX),
                None => (0, 0),
            },
        };
        asked.of(first, last)
    }
}

impl Asked {
    /// The range of a bag whose messages are from `first` to `last` (ns).
    fn of(self, first: u64, last: u64) -> Result<Range, NodeError> {
        let Self {
            start_offset,
            duration,
            until,
        } = self;
        let start = first.saturating_add(nanoseconds(start_offset));
        let bounds = [
            duration.map(|duration| start.saturating_add(nanoseconds(duration))),
            until.map(|until| first.saturating_add(nanoseconds(until))),
        ];
        let end = bounds.into_iter().flatten().fold(last, u64::min);
        if start > end {
            let length = (last - first) as f64 / NANOSECONDS_PER_SECOND;
            let until = until.map_or(String::new(), |until| format!(", until {until} s"));
            return Err(NodeError::Input(format!(
                "start_offset is {start_offset} s{until}: nothing is to be played of the bag's {length} s"
            )));
        }
        Ok(Range { start, end })
    }
}

fn nanoseconds(seconds: f64) -> u64 {
    (seconds * NANOSECONDS_PER_SECOND).round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: u64 = 5_000_000_000;
    const LAST: u64 = 15_000_000_000;

    #[test]
    fn a_range_counts_from_the_first_message_and_has_both_its_ends() {
        for (start_offset, duration, until, start, end) in [
            (0.0, None, None, FIRST, LAST),
            (2.5, None, None, 7_500_000_000, LAST),
            (2.5, Some(1.0), None, 7_500_000_000, 8_500_000_000),
            (2.5, None, Some(4.0), 7_500_000_000, 9_000_000_000),
            (2.5, Some(9.0), Some(4.0), 7_500_000_000, 9_000_000_000),
            (0.1, Some(0.0), None, 5_100_000_000, 5_100_000_000),
            (10.0, Some(1e300), None, LAST, LAST),
        ] {
            let asked = Asked {
                start_offset,
                duration,
                until,
            };
            assert_eq!(asked.of(FIRST, LAST).unwrap(), Range { start, end });
        }
    }

    #[test]
    fn a_range_without_anything_is_refused() {
        for (start_offset, until, fragment) in [
            (10.1, None, "start_offset is 10.1 s: nothing"),
            (3.0, Some(2.0), "start_offset is 3 s, until 2 s"),
        ] {
            let asked = Asked {
                start_offset,
                duration: None,
                until,
            };
            let refusal = asked.of(FIRST, LAST).unwrap_err().to_string();
            assert!(refusal.contains(fragment), "{refusal}");
            assert!(refusal.contains("the bag's 10 s"), "{refusal}");
        }
    }
}
