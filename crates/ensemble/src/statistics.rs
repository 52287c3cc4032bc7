use serde::Serialize;

use crate::histogram::Histogram;
use crate::quantiles::Quantiles;

/// Statistics of a column. All are NaN if there are no samples, and the standard deviation is NaN for a single sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// Sample standard deviation, with the divisor n − 1.
    pub standard_deviation: f64,
    /// Minimum.
    pub least: f64,
    /// Quantiles at 5, 25, 50, 75 and 95 %: by linear interpolation between the two nearest values, or within
    /// [`Summary::quantile_error`](crate::Summary::quantile_error).
    pub quantiles: [f64; 5],
    /// Maximum.
    pub greatest: f64,
}

/// Levels of the quantiles.
const LEVELS: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// The values of a column, given one by one.
pub(crate) struct Column {
    moments: Moments,
    /// Minimum and maximum.
    range: Option<(f64, f64)>,
    quantiles: Quantiles,
    histogram: Histogram,
}

impl Column {
    /// Creates a column of at most so many values.
    pub(crate) fn new(most: u64) -> Self {
        Self {
            moments: Moments::default(),
            range: None,
            quantiles: Quantiles::new(most),
            histogram: Histogram::new(),
        }
    }

    pub(crate) fn add(&mut self, value: f64) {
        self.moments.add(value);
        self.range = match self.range {
            Some((least, greatest)) if value.total_cmp(&least).is_lt() => Some((value, greatest)),
            Some((least, greatest)) if value.total_cmp(&greatest).is_gt() => Some((least, value)),
            range => range.or(Some((value, value))),
        };
        self.quantiles.add(value);
        self.histogram.add(value);
    }

    pub(crate) fn finish(self) -> (Statistics, Histogram) {
        let (least, greatest) = self.range.unwrap_or((f64::NAN, f64::NAN));
        let statistics = Statistics {
            mean: within(self.moments.mean(), least, greatest),
            standard_deviation: self.moments.standard_deviation(),
            least,
            quantiles: self.quantiles.at(LEVELS),
            greatest,
        };
        (statistics, self.histogram)
    }
}

/// Mean and variance after Welford, *Note on a method for calculating corrected sums of squares and products*
/// (Technometrics 4, 1962), of the differences from the first value. Small deviations of large values keep their digits.
#[derive(Default)]
struct Moments {
    count: f64,
    first: f64,
    /// Mean of the differences.
    mean: f64,
    /// Sum of the squares of the deviations from the mean.
    squares: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        if self.count == 0.0 {
            self.first = value;
        }
        self.count += 1.0;
        let difference = value - self.first;
        let deviation = difference - self.mean;
        self.mean += deviation / self.count;
        self.squares += deviation * (difference - self.mean);
    }

    fn mean(&self) -> f64 {
        if self.count == 0.0 {
            return f64::NAN;
        }
        self.first + self.mean
    }

    fn standard_deviation(&self) -> f64 {
        if self.count == 0.0 {
            return f64::NAN;
        }
        (self.squares / (self.count - 1.0)).sqrt()
    }
}

/// Clamps a mean to the range of its values, in case of rounding errors. NaN stays NaN.
fn within(mean: f64, least: f64, greatest: f64) -> f64 {
    if mean < least {
        least
    } else if mean > greatest {
        greatest
    } else {
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::values;

    fn of(values: &[f64]) -> Statistics {
        let mut column = Column::new(values.len() as u64);
        values.iter().for_each(|value| column.add(*value));
        column.finish().0
    }

    /// Expected values from numpy: `mean`, `std(ddof=1)`, `quantile`.
    #[test]
    fn statistics_are_those_of_textbooks() {
        let found = of(&[4.0, 1.0, 3.0, 2.0, 10.0]);
        assert!((found.mean - 4.0).abs() < 1e-15);
        assert!((found.standard_deviation - 3.535_533_905_932_737_8).abs() < 1e-15);
        assert_eq!((found.least, found.greatest), (1.0, 10.0));
        assert_eq!(found.quantiles[1..4], [2.0, 3.0, 4.0]);
    }

    #[test]
    fn nothing_has_no_statistics() {
        let found = of(&[]);
        assert!(found.mean.is_nan() && found.least.is_nan() && found.quantiles[2].is_nan());
        let one = of(&[7.0]);
        assert_eq!((one.mean, one.quantiles[0], one.greatest), (7.0, 7.0, 7.0));
        assert!(one.standard_deviation.is_nan());
    }

    #[test]
    fn the_mean_of_equal_values_is_their_value() {
        let found = of(&[0.1; 10]);
        assert_eq!((found.mean, found.standard_deviation), (0.1, 0.0));
    }

    /// Beside two passes over the differences from the first value, in sums that are exact but for the last digit.
    #[test]
    fn one_pass_gives_the_moments_of_two() {
        let mut random = fastrand::Rng::with_seed(4);
        for _ in 0..200 {
            let mut values = values(&mut random, 100_000);
            values.retain(|value| value.abs() < 1e100);
            if values.len() < 2 {
                continue;
            }
            let found = of(&values);
            let count = values.len() as f64;
            let differences = || values.iter().map(|value| value - values[0]);
            let center = sum(differences()) / count;
            let mean = values[0] + center;
            let squares = sum(differences().map(|difference| (difference - center).powi(2)));
            let deviation = (squares / (count - 1.0)).sqrt();
            let scale = found.greatest - found.least;
            assert!(
                (found.mean - mean).abs() <= 1e-12 * scale + 1e-15 * mean.abs(),
                "{} for {mean} of {count}",
                found.mean
            );
            let error = (found.standard_deviation - deviation).abs();
            assert!(
                error <= 1e-9 * deviation + 1e-12 * scale,
                "{} for {deviation} of {count}",
                found.standard_deviation
            );
        }
    }

    /// Returns a sum after Neumaier.
    fn sum(values: impl Iterator<Item = f64>) -> f64 {
        let (mut sum, mut rest) = (0.0_f64, 0.0);
        for value in values {
            let next = sum + value;
            rest += if sum.abs() >= value.abs() {
                (sum - next) + value
            } else {
                (value - next) + sum
            };
            sum = next;
        }
        sum + rest
    }
}
