use std::cmp::Ordering;

use zw_fast_quantile::FixedSizeEpsilonSummary;

/// Maximum number of values with exact quantiles.
pub(crate) const EXACT: u64 = 1 << 16;

/// Bound of the error of the other quantiles, as a fraction of the number of values by which their rank is off.
pub(crate) const RANK_ERROR: f64 = 1e-3;

/// Quantiles of values that are given one by one.
///
/// Few values are kept. More are summarized after Zhang and Wang, *An Efficient Quantile Computation Technique for
/// Approximate Query Processing* (SSDBM 2007), whose error has a bound for all values in all orders.
pub(crate) struct Quantiles {
    most: usize,
    kept: Vec<f64>,
    sketch: Option<FixedSizeEpsilonSummary<Ordered>>,
}

/// A number in the order of [`f64::total_cmp`].
#[derive(Clone, Copy)]
struct Ordered(f64);

impl Ord for Ordered {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for Ordered {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ordered {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Ordered {}

impl Quantiles {
    /// Creates the quantiles of at most so many values.
    pub(crate) fn new(most: u64) -> Self {
        Self {
            most: usize::try_from(most).unwrap_or(usize::MAX),
            kept: Vec::new(),
            sketch: None,
        }
    }

    pub(crate) fn add(&mut self, value: f64) {
        if self.kept.len() as u64 == EXACT
            && let Ok(mut sketch) = FixedSizeEpsilonSummary::new(self.most, RANK_ERROR)
        {
            let kept = std::mem::take(&mut self.kept);
            kept.into_iter()
                .for_each(|kept| sketch.update(Ordered(kept)));
            self.sketch = Some(sketch);
        }
        match &mut self.sketch {
            Some(sketch) => sketch.update(Ordered(value)),
            None => self.kept.push(value),
        }
    }

    /// Returns the quantiles at these levels.
    pub(crate) fn at<const N: usize>(mut self, levels: [f64; N]) -> [f64; N] {
        if let Some(sketch) = &self.sketch {
            return levels.map(|level| sketch.query(level).map_or(f64::NAN, |value| value.0));
        }
        self.kept.sort_by(f64::total_cmp);
        levels.map(|level| quantile(&self.kept, level))
    }
}

/// Returns a quantile of values in ascending order, by linear interpolation between the two nearest values.
fn quantile(sorted: &[f64], level: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let place = level * last as f64;
    let below = place.floor();
    let (low, high) = (below as usize, (below as usize + 1).min(last));
    let part = place - below;
    // Equal values, including infinite ones, need no interpolation.
    if part == 0.0 || sorted[low] == sorted[high] {
        sorted[low]
    } else {
        sorted[low] + part * (sorted[high] - sorted[low])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::values;

    const LEVELS: [f64; 7] = [0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0];

    fn of(values: &[f64]) -> [f64; LEVELS.len()] {
        // The number of failed samples is not known beforehand.
        let mut quantiles = Quantiles::new(3 * values.len() as u64 / 2);
        values.iter().for_each(|value| quantiles.add(*value));
        quantiles.at(LEVELS)
    }

    /// Expected values from numpy: `quantile`.
    #[test]
    fn few_values_have_the_quantiles_of_textbooks() {
        let expected = [1.0, 1.2, 2.0, 3.0, 4.0, 8.8, 10.0];
        for (found, expected) in of(&[4.0, 1.0, 3.0, 2.0, 10.0]).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-14, "{found} for {expected}");
        }
        assert!(of(&[]).iter().all(|quantile| quantile.is_nan()));
        assert_eq!(of(&[f64::INFINITY; 4]), [f64::INFINITY; 7]);
    }

    #[test]
    fn quantiles_are_exact_up_to_their_limit() {
        let mut random = fastrand::Rng::with_seed(2);
        let mut values: Vec<_> = (0..EXACT).map(|_| random.f64()).collect();
        let found = of(&values);
        values.sort_by(f64::total_cmp);
        assert_eq!(found, LEVELS.map(|level| quantile(&values, level)));
    }

    /// The rank of each quantile among sorted values is off by at most the stated error, whatever the values.
    #[test]
    fn ranks_are_off_by_at_most_the_stated_error() {
        let mut random = fastrand::Rng::with_seed(3);
        let mut summarized = 0;
        for _ in 0..60 {
            let mut values = values(&mut random, 1 << 20);
            let found = of(&values);
            let same = of(&values).map(f64::to_bits) == found.map(f64::to_bits);
            assert!(same, "the same values have other quantiles");
            values.sort_by(f64::total_cmp);
            let count = values.len() as f64;
            if values.len() as u64 <= EXACT {
                continue;
            }
            summarized += 1;
            for (found, level) in found.into_iter().zip(LEVELS) {
                let below = values.partition_point(|value| value.total_cmp(&found).is_lt());
                let above = values.partition_point(|value| value.total_cmp(&found).is_le());
                assert!(below < above, "{found} is one of the values");
                let [low, high] = [below, above].map(|rank| rank as f64 / count);
                // Ranks are whole numbers.
                let error = RANK_ERROR + 1.0 / count;
                assert!(
                    low - error <= level && level <= high + error,
                    "{found}: ranks {low} to {high} of {count}, expected {level}"
                );
            }
        }
        assert!(summarized >= 10, "{summarized}");
    }
}
