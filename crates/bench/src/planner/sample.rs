//! Repeated measurements.

use serde::Serialize;

/// Median and range of some measurements.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Sample {
    pub median: f64,
    pub least: f64,
    pub most: f64,
}

impl Sample {
    /// Not a number without measurements.
    pub(crate) fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |index: usize| sorted.get(index).copied().unwrap_or(f64::NAN);
        let half = sorted.len() / 2;
        let median = match sorted.len() % 2 {
            0 => 0.5 * (at(half.wrapping_sub(1)) + at(half)),
            _ => at(half),
        };
        Self {
            median,
            least: at(0),
            most: at(sorted.len().wrapping_sub(1)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Sample;

    #[test]
    fn the_median_lies_in_the_middle_of_odd_and_even_numbers_of_values() {
        let odd = Sample::of(&[5.0, 1.0, 3.0]);
        assert_eq!([odd.least, odd.median, odd.most], [1.0, 3.0, 5.0]);
        let even = Sample::of(&[4.0, 1.0, 2.0, 10.0]);
        assert_eq!([even.least, even.median, even.most], [1.0, 3.0, 10.0]);
        assert!(Sample::of(&[]).median.is_nan());
    }
}
