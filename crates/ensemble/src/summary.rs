use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use crate::histogram::Histogram;
use crate::quantiles::{EXACT, RANK_ERROR};
use crate::statistics::Column;
use crate::{EnsembleError, Identity, Statistics, Store};

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
    /// Bound of the error of the quantiles: their ranks are off by at most this fraction of the samples. It is 0 for up to
    /// 65 536 samples.
    pub quantile_error: f64,
    /// Statistics of each column, in order.
    #[serde(serialize_with = "as_map")]
    pub columns: Vec<(String, Statistics)>,
    /// Counts of the values of each column.
    #[serde(skip)]
    pub(crate) histograms: Vec<Histogram>,
}

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
    /// Computes the statistics of the samples in a store in one pass, with memory for one part.
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
        let each = store.columns().iter();
        let mut columns: Vec<_> = each.map(|_| Column::new(samples)).collect();
        let (mut present, mut complete) = (0, 0);
        let mut failures = BTreeMap::new();
        store.for_each(|row| {
            present += 1;
            if let Some(failure) = row.failure {
                *failures.entry(failure.kind.name()).or_default() += 1;
                return;
            }
            complete += 1;
            for (column, number) in columns.iter_mut().zip(row.numbers) {
                column.add(number);
            }
        })?;
        let (statistics, histograms): (Vec<_>, _) =
            columns.into_iter().map(Column::finish).unzip();
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
            quantile_error: if complete > EXACT { RANK_ERROR } else { 0.0 },
            columns: names.zip(statistics).collect(),
            histograms,
        })
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
