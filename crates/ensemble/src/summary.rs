use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use crate::{EnsembleError, Identity, Store};

/// Statistics of the samples of an ensemble.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Name of the scene.
    pub scene: String,
    /// Hash of everything that determines the samples.
    pub identity: String,
    /// Seed of the samples.
    pub seed: u64,
    /// The integrator with its substeps.
    pub integrator: String,
    /// Number of samples of the ensemble.
    pub samples: u64,
    /// Number of samples present.
    pub present: u64,
    /// Number of samples that flew to the end. The statistics describe these samples.
    pub complete: u64,
    /// Number of failed samples by kind.
    pub failures: BTreeMap<&'static str, u64>,
    /// Statistics of each column, in order.
    #[serde(serialize_with = "as_map")]
    pub columns: Vec<(String, Statistics)>,
    /// The values of each column in ascending order.
    #[serde(skip)]
    pub(crate) sorted: Vec<Vec<f64>>,
}

/// Statistics of a column. All are NaN if there are no samples, and the standard deviation is NaN for a single sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// Sample standard deviation, with the divisor n − 1.
    pub standard_deviation: f64,
    /// Minimum.
    pub least: f64,
    /// Quantiles at 5, 25, 50, 75 and 95 %, by linear interpolation between the two nearest values.
    pub quantiles: [f64; 5],
    /// Maximum.
    pub greatest: f64,
}

/// Levels of the quantiles.
const LEVELS: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

fn as_map<S: Serializer>(
    columns: &[(String, Statistics)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(columns.len()))?;
    for (name, statistics) in columns {
        map.serialize_entry(name, statistics)?;
    }
    map.end()
}

impl Summary {
    /// Computes the statistics of the samples in a store.
    ///
    /// # Errors
    /// Returns an error if parts cannot be read.
    pub fn of(store: &Store) -> Result<Self, EnsembleError> {
        let Identity {
            hash,
            scene,
            seed,
            samples,
            scheme,
            ..
        } = store.identity().clone();
        let mut values = vec![Vec::new(); store.columns().len()];
        let (mut present, mut complete) = (0, 0);
        let mut failures = BTreeMap::new();
        store.for_each(|row| {
            present += 1;
            if let Some(failure) = row.failure {
                *failures.entry(failure.kind.name()).or_default() += 1;
                return;
            }
            complete += 1;
            for (values, number) in values.iter_mut().zip(row.numbers) {
                values.push(number);
            }
        })?;
        let statistics = values.iter_mut().map(|values| Statistics::of(values));
        let names = store.columns().iter().cloned();
        Ok(Self {
            scene,
            identity: hash,
            seed,
            integrator: scheme,
            samples,
            present,
            complete,
            failures,
            columns: names.zip(statistics).collect(),
            sorted: values,
        })
    }
}

impl Statistics {
    /// Computes the statistics of values given in the order of their indices, and sorts the values.
    fn of(values: &mut [f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        values.sort_by(f64::total_cmp);
        let (least, greatest) = (quantile(values, 0.0), quantile(values, 1.0));
        let mean = within(mean, least, greatest);
        let squares = values.iter().map(|value| (value - mean) * (value - mean));
        let standard_deviation = (squares.sum::<f64>() / (count - 1.0)).sqrt();
        Self {
            mean,
            standard_deviation,
            least,
            quantiles: LEVELS.map(|level| quantile(values, level)),
            greatest,
        }
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

/// Returns a quantile of values in ascending order.
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

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            scene,
            seed,
            samples,
            present,
            complete,
            ..
        } = self;
        writeln!(f, "{scene}, seed {seed}, by {}", self.integrator)?;
        write!(
            f,
            "{present} of {samples} samples, {complete} flew to the end"
        )?;
        for (kind, count) in &self.failures {
            write!(f, ", {count} failed ({kind})")?;
        }
        if *complete == 0 {
            // There is nothing to tell statistics of.
            return Ok(());
        }
        let width = self.columns.iter().map(|(name, _)| name.len()).max();
        let width = width.unwrap_or(0);
        write!(
            f,
            "\n{:width$} {:>12} {:>12} {:>12} {:>12} {:>12}",
            "", "mean", "deviation", "5 %", "median", "95 %"
        )?;
        for (name, statistics) in &self.columns {
            let Statistics {
                mean,
                standard_deviation,
                quantiles: [low, _, median, _, high],
                ..
            } = statistics;
            write!(
                f,
                "\n{name:width$} {mean:>12.4e} {standard_deviation:>12.4e} {low:>12.4e} {median:>12.4e} {high:>12.4e}"
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected values from numpy: `mean`, `std(ddof=1)`, `quantile`.
    #[test]
    fn statistics_are_those_of_textbooks() {
        let mut values = [4.0, 1.0, 3.0, 2.0, 10.0];
        let found = Statistics::of(&mut values);
        assert_eq!(found.mean, 4.0);
        assert!((found.standard_deviation - 3.535_533_905_932_737_8).abs() < 1e-15);
        assert_eq!((found.least, found.greatest), (1.0, 10.0));
        let expected = [1.2, 2.0, 3.0, 4.0, 8.8];
        for (found, expected) in found.quantiles.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-14, "{found} for {expected}");
        }
    }

    #[test]
    fn nothing_has_no_statistics() {
        let found = Statistics::of(&mut []);
        assert!(found.mean.is_nan() && found.least.is_nan() && found.quantiles[2].is_nan());
        let one = Statistics::of(&mut [7.0]);
        assert_eq!((one.mean, one.quantiles[0], one.greatest), (7.0, 7.0, 7.0));
        assert!(one.standard_deviation.is_nan());
    }

    #[test]
    fn what_lies_between_equal_values_is_their_value() {
        let mut infinite = [f64::INFINITY; 4];
        let mut same = [0.1; 10];
        assert!(same.iter().sum::<f64>() / 10.0 < 0.1);
        let found = Statistics::of(&mut same);
        assert_eq!((found.mean, found.standard_deviation), (0.1, 0.0));
        assert_eq!(
            Statistics::of(&mut infinite).quantiles,
            infinite[0..1].repeat(5)[..]
        );
    }
}
