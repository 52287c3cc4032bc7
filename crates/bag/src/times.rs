//! Spans of time.

/// First and last log time (ns), if there are messages.
pub(crate) type Times = Option<(u64, u64)>;

/// The span from the earliest start to the latest end.
pub(crate) fn around(spans: impl IntoIterator<Item = (u64, u64)>) -> Times {
    let spans = spans.into_iter();
    spans.reduce(|(first, last), (start, end)| (first.min(start), last.max(end)))
}

/// Widens a span to a time.
pub(crate) fn widen(times: &mut Times, time: u64) {
    *times = around(times.iter().copied().chain([(time, time)]));
}

/// The sum of counts that a file tells, which may be anything.
pub(crate) fn sum(counts: impl IntoIterator<Item = u64>) -> u64 {
    counts.into_iter().fold(0, u64::saturating_add)
}
