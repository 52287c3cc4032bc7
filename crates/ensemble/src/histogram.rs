/// Maximum number of bars.
const BARS: usize = 64;

/// Largest number of a bar, so that a value divided by the width is exact.
const MOST: f64 = (1_u64 << 53) as f64;

/// Exact counts of values whose range is not known beforehand.
///
/// The bars are 2ᵉ wide and begin at its multiples, with the least `e` that needs at most [`BARS`] bars. A wider range
/// joins neighboring bars. The counts do not depend on the order of the values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Histogram {
    range: Option<(f64, f64)>,
    exponent: i32,
    /// Number of the first bar, which begins at `first · 2ᵉ`.
    first: i64,
    counts: [u64; BARS],
}

impl Histogram {
    pub(crate) fn new() -> Self {
        Self {
            range: None,
            // The spacing of the smallest numbers.
            exponent: -1074,
            first: 0,
            counts: [0; BARS],
        }
    }

    /// Counts a value. Infinity and NaN have no bar.
    pub(crate) fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        let (low, high) = match self.range {
            Some((low, high)) => (low.min(value), high.max(value)),
            None => (value, value),
        };
        if self.range != Some((low, high)) {
            self.widen(low, high);
        }
        let bar = number(value, self.exponent) as i64 - self.first;
        self.counts[bar as usize] += 1;
    }

    fn widen(&mut self, low: f64, high: f64) {
        let mut exponent = self.exponent;
        while !fits(low, high, exponent) {
            exponent += 1;
        }
        let first = number(low, exponent) as i64;
        let joined = (exponent - self.exponent).min(63);
        let mut counts = [0; BARS];
        for (count, bar) in self.counts.into_iter().zip(self.first..) {
            if count > 0 {
                counts[((bar >> joined) - first) as usize] += count;
            }
        }
        *self = Self {
            range: Some((low, high)),
            exponent,
            first,
            counts,
        };
    }

    /// Returns the edges and counts of the bars from the least to the greatest value. The outer bars end at these.
    pub(crate) fn bars(&self) -> impl Iterator<Item = ([f64; 2], u64)> {
        let bars = self.range.map(|(low, high)| {
            let last = number(high, self.exponent) as i64;
            let edge = move |bar: i64| scaled(bar as f64, self.exponent).clamp(low, high);
            let bars = (self.first..=last).zip(self.counts);
            bars.map(move |(bar, count)| ([edge(bar), edge(bar + 1)], count))
        });
        bars.into_iter().flatten()
    }
}

/// Returns the number of the bar of a value.
fn number(value: f64, exponent: i32) -> f64 {
    let bars = scaled(value, -exponent);
    // A negative quotient may be so small that it is rounded to 0.
    if bars == 0.0 && value < 0.0 {
        -1.0
    } else {
        bars.floor()
    }
}

/// Returns value · 2ᵉ. The power itself may be no number.
fn scaled(value: f64, exponent: i32) -> f64 {
    let half = exponent / 2;
    value * 2_f64.powi(half) * 2_f64.powi(exponent - half)
}

fn fits(low: f64, high: f64, exponent: i32) -> bool {
    let (first, last) = (number(low, exponent), number(high, exponent));
    first.abs() < MOST && last.abs() < MOST && last - first < BARS as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::values;

    fn of(values: &[f64]) -> Histogram {
        let mut histogram = Histogram::new();
        values.iter().for_each(|value| histogram.add(*value));
        histogram
    }

    #[test]
    fn each_value_is_counted_in_its_bar_whatever_the_order() {
        let mut random = fastrand::Rng::with_seed(1);
        for _ in 0..400 {
            let mut values = values(&mut random, 1000);
            let histogram = of(&values);
            random.shuffle(&mut values);
            assert_eq!(histogram, of(&values));
            values.sort_by(f64::total_cmp);
            assert!(of(&values) == histogram, "{values:?}");
            values.retain(|value| value.is_finite());
            let bars: Vec<_> = histogram.bars().collect();
            assert!(bars.len() <= BARS);
            for (bar, ([left, right], count)) in bars.iter().enumerate() {
                let last = bar + 1 == bars.len();
                let within = |value: &&f64| *left <= **value && (**value < *right || last);
                assert_eq!(values.iter().filter(within).count() as u64, *count);
            }
            // A range of many numbers has at least half as many bars.
            if let [low, .., high] = values[..]
                && high - low > 1e-12 * low.abs().max(high.abs()).max(1e-290)
            {
                assert!(bars.len() > BARS / 2, "{} bars, {low}..{high}", bars.len());
            }
        }
    }

    #[test]
    fn extreme_values_have_bars() {
        let tiny = f64::from_bits(1);
        for values in [
            vec![],
            vec![0.0, -0.0],
            vec![tiny, -tiny, 0.0],
            vec![f64::MAX, f64::MIN, tiny],
            vec![f64::INFINITY, f64::NAN, 1.0, 1.0 + f64::EPSILON],
        ] {
            let finite = values.iter().filter(|value| value.is_finite()).count();
            let histogram = of(&values);
            let counted: u64 = histogram.bars().map(|(_, count)| count).sum();
            assert_eq!(counted, finite as u64, "{values:?}");
        }
    }
}
