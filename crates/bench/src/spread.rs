//! Median and quartiles of repeated measurements.

use serde::Serialize;

/// Median and quartiles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Spread {
    pub median: f64,
    pub quartiles: [f64; 2],
}

impl Spread {
    /// Quantiles are interpolated between neighbors. None without measurements.
    pub(crate) fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<_> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        let at = |part: f64| {
            let place = part * last as f64;
            let below = place as usize;
            let above = (below + 1).min(last);
            sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
        };
        Some(Self {
            median: at(0.5),
            quartiles: [at(0.25), at(0.75)],
        })
    }

    /// Of the ratios of measurements that were taken in turns.
    pub(crate) fn of_ratios(above: &[f64], below: &[f64]) -> Option<Self> {
        Self::of(above.iter().zip(below).map(|(above, below)| above / below))
    }
}

/// As a ratio with its quartiles, to two or three digits.
impl std::fmt::Display for Spread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, high] = self.quartiles.map(short);
        write!(f, "{} ({low}–{high})", short(self.median))
    }
}

/// A positive number with two or three digits.
pub(crate) fn short(value: f64) -> String {
    match value {
        value if value >= 99.5 => format!("{value:.0}"),
        value if value >= 9.95 => format!("{value:.1}"),
        value if value >= 0.0995 => format!("{value:.2}"),
        value if value >= 0.001 => format!("{value:.3}"),
        value => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Spread, short};

    #[test]
    fn quartiles_lie_between_neighbors_and_ratios_are_taken_pair_by_pair() {
        let spread = Spread::of([4.0, 1.0, 3.0, 2.0]);
        let expected = Spread {
            median: 2.5,
            quartiles: [1.75, 3.25],
        };
        assert_eq!(spread, Some(expected));
        assert_eq!(Spread::of([]), None);
        let drifting = Spread::of_ratios(&[2.0, 4.0, 8.0], &[1.0, 2.0, 4.0]);
        assert_eq!(drifting.map(|spread| spread.quartiles), Some([2.0, 2.0]));
        assert_eq!(
            [1234.4, 12.34, 1.234, 0.1234, 0.01234, 1.2e-5].map(short),
            ["1234", "12.3", "1.23", "0.12", "0.012", "1e-5"]
        );
    }
}
