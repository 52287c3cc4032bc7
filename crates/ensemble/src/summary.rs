use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use crate::histogram::Histogram;
use crate::quantiles::{EXACT, RANK_ERROR};
use crate::statistics::Column;
use crate::{EnsembleError, Identity, Row, Statistics, Store};

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
        let mut tally = Tally::new(store.identity().samples, store.columns().len());
        store.for_each(|row| tally.add(row))?;
        Ok(tally.finish(store.identity(), store.columns()))
    }
}

/// What is kept of the samples that have been read.
struct Tally {
    present: u64,
    complete: u64,
    failures: BTreeMap<&'static str, u64>,
    columns: Vec<Column>,
}

impl Tally {
    fn new(samples: u64, columns: usize) -> Self {
        Self {
            present: 0,
            complete: 0,
            failures: BTreeMap::new(),
            columns: (0..columns).map(|_| Column::new(samples)).collect(),
        }
    }

    fn add(&mut self, row: Row) {
        self.present += 1;
        if let Some(failure) = row.failure {
            *self.failures.entry(failure.kind.name()).or_default() += 1;
            return;
        }
        self.complete += 1;
        for (column, number) in self.columns.iter_mut().zip(row.numbers) {
            column.add(number);
        }
    }

    fn finish(self, identity: &Identity, names: &[String]) -> Summary {
        let columns = self.columns.into_iter().map(Column::finish);
        let (statistics, histograms): (Vec<_>, _) = columns.unzip();
        Summary {
            scene: identity.scene.clone(),
            identity: identity.hash.clone(),
            seed: identity.seed,
            integrator: identity.scheme.clone(),
            samples: identity.samples,
            present: self.present,
            complete: self.complete,
            failures: self.failures,
            quantile_error: if self.complete > EXACT {
                RANK_ERROR
            } else {
                0.0
            },
            columns: names.iter().cloned().zip(statistics).collect(),
            histograms,
        }
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
        if self.quantile_error > 0.0 {
            let percent = 100.0 * self.quantile_error;
            write!(f, "\nranks of quantiles within {percent} % of the samples")?;
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
    use allocation_counter::measure;

    use super::*;
    use crate::{Failure, FailureKind};

    const COLUMNS: usize = 4;

    fn tally(samples: u64) -> Tally {
        let mut random = fastrand::Rng::with_seed(5);
        let mut tally = Tally::new(1_000_000_000, COLUMNS);
        for index in 0..samples {
            let failed = random.u8(..) == 0;
            tally.add(Row {
                index,
                steps: 1,
                failure: failed.then(|| Failure {
                    kind: FailureKind::Turn,
                    message: String::new(),
                }),
                numbers: (0..COLUMNS).map(|_| random.f64()).collect(),
            });
        }
        tally
    }

    fn summary(samples: u64) -> Summary {
        let identity = Identity {
            hash: String::new(),
            scene: "scene".into(),
            seed: 1,
            samples,
            scheme: "lgvi".into(),
            version: "1".into(),
            part: 1024,
        };
        let names = ["a", "b", "c", "d"].map(str::to_owned);
        tally(samples).finish(&identity, &names)
    }

    /// Ten times the samples add a few levels of the summaries of quantiles.
    #[test]
    fn memory_hardly_depends_on_the_number_of_samples() {
        let most = |samples| measure(|| drop(tally(samples))).bytes_max / COLUMNS as u64;
        let [less, more] = [200_000, 2_000_000].map(most);
        assert!(more < 8 << 20, "{more} bytes a column");
        assert!(more - less < 4 << 20, "{less} and {more} bytes a column");
    }

    #[test]
    fn a_summary_states_the_error_of_its_quantiles() {
        let exact = summary(60_000);
        assert_eq!(exact.quantile_error, 0.0);
        assert!(!exact.to_string().contains("quantiles"));
        let summary = summary(70_000);
        assert_eq!(summary.quantile_error, 1e-3);
        let text = summary.to_string();
        assert!(text.contains("ranks of quantiles within 0.1 % of the samples"));
        let failed = summary.failures["turn"];
        assert_eq!(
            (summary.present, summary.complete),
            (70_000, 70_000 - failed)
        );
        for (histogram, (_, statistics)) in summary.histograms.iter().zip(&summary.columns) {
            let counted: u64 = histogram.bars().map(|(_, count)| count).sum();
            assert_eq!(counted, summary.complete);
            let levels = [0.05, 0.25, 0.5, 0.75, 0.95];
            for (quantile, level) in statistics.quantiles.iter().zip(levels) {
                // The error of the sketch, and four standard deviations of the samples.
                let error = 1e-3 + 4.0 * (level * (1.0 - level) / 70_000_f64).sqrt();
                assert!((quantile - level).abs() < error, "{quantile} for {level}");
            }
        }
    }
}
