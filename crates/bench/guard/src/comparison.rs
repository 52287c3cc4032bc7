//! What has become of the counts.

use std::fmt;

use crate::counts::Counts;

/// Growth (%) that fails, with the compiler that the kept counts belong to.
const LIMIT: f64 = 3.0;

/// The same with another one, which counts differently.
const OTHER_COMPILER: f64 = 25.0;

/// Measured counts beside those that are kept.
pub(crate) struct Comparison {
    rows: Vec<Row>,
    limit: f64,
    /// The compiler of the kept counts and that of the measured ones, where they differ.
    compilers: Option<[String; 2]>,
}

struct Row {
    group: String,
    kernel: String,
    kept: Option<u64>,
    measured: Option<u64>,
    verdict: Verdict,
}

/// What a kernel's count has done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Kept,
    Fallen,
    Grown,
    /// It is not in the file.
    New,
    /// It was not measured.
    Missing,
}

impl Verdict {
    fn of(kept: Option<u64>, measured: Option<u64>, limit: f64) -> Self {
        match (kept, measured) {
            (None, _) => Self::New,
            (_, None) => Self::Missing,
            // Both sides are whole numbers, so that the limit itself is not beyond the limit.
            (Some(kept), Some(measured)) => match (kept as f64, 100.0 * measured as f64) {
                (kept, measured) if measured > (100.0 + limit) * kept => Self::Grown,
                (kept, measured) if measured < (100.0 - limit) * kept => Self::Fallen,
                _ => Self::Kept,
            },
        }
    }

    fn passes(self) -> bool {
        matches!(self, Self::Kept | Self::Fallen)
    }
}

/// In %.
fn growth(kept: u64, measured: u64) -> f64 {
    100.0 * (measured as f64 / kept as f64 - 1.0)
}

impl Comparison {
    pub(crate) fn of(kept: &Counts, measured: &Counts) -> Self {
        let same = kept.toolchain == measured.toolchain;
        let limit = if same { LIMIT } else { OTHER_COMPILER };
        let row = |group: &str, kernel: &str| {
            let (kept, measured) = (kept.get(group, kernel), measured.get(group, kernel));
            Row {
                group: group.to_owned(),
                kernel: kernel.to_owned(),
                kept,
                measured,
                verdict: Verdict::of(kept, measured, limit),
            }
        };
        let known = kept.iter().map(|(group, kernel, _)| row(group, kernel));
        let new = measured
            .iter()
            .filter(|(group, kernel, _)| kept.get(group, kernel).is_none());
        let rows = known.chain(new.map(|(group, kernel, _)| row(group, kernel)));
        Self {
            rows: rows.collect(),
            limit,
            compilers: (!same).then(|| [kept.toolchain.clone(), measured.toolchain.clone()]),
        }
    }

    /// Whether nothing has grown beyond the limit, and all kernels are known.
    pub(crate) fn passes(&self) -> bool {
        self.rows.iter().all(|row| row.verdict.passes())
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |count: Option<u64>| count.map_or("–".to_owned(), |count| count.to_string());
        for row in &self.rows {
            let change = match (row.kept, row.measured) {
                (Some(kept), Some(measured)) => format!("{:+.2} %", growth(kept, measured)),
                _ => String::new(),
            };
            let name = format!("{}.{}", row.group, row.kernel);
            let (kept, measured) = (count(row.kept), count(row.measured));
            write!(f, "{name:<36} {kept:>12} {measured:>12} {change:>10}")?;
            match row.verdict {
                Verdict::Kept => writeln!(f)?,
                Verdict::Fallen => writeln!(f, "  less")?,
                Verdict::Grown => writeln!(f, "  GROWN")?,
                Verdict::New => writeln!(f, "  NOT IN THE FILE")?,
                Verdict::Missing => writeln!(f, "  NOT MEASURED")?,
            }
        }
        if let Some([kept, measured]) = &self.compilers {
            writeln!(
                f,
                "The counts are those of rustc {kept}; this is {measured}."
            )?;
        }
        let verdict = if self.passes() { "passes" } else { "FAILS" };
        writeln!(f, "{verdict}: limit {} %", self.limit)?;
        if self.passes() {
            return Ok(());
        }
        writeln!(f, "`just instructions-update` keeps the new counts.")
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn counts<const N: usize>(toolchain: &str, kernels: [(&str, u64); N]) -> Counts {
        let kernels = kernels.map(|(kernel, count)| (kernel.to_owned(), count));
        Counts {
            toolchain: toolchain.to_owned(),
            instructions: BTreeMap::from([("steps".to_owned(), BTreeMap::from(kernels))]),
        }
    }

    fn compared(kept: u64, measured: u64) -> (bool, String) {
        let [kept, measured] = [kept, measured].map(|count| counts("1.95", [("lgvi", count)]));
        let comparison = Comparison::of(&kept, &measured);
        (comparison.passes(), comparison.to_string())
    }

    #[test]
    fn growth_beyond_the_limit_fails_and_less_is_told() {
        assert!(compared(1000, 1000).0);
        let (passes, text) = compared(1000, 1030);
        assert!(passes && text.contains("+3.00 %"), "{text}");
        let (passes, text) = compared(1000, 1031);
        assert!(
            !passes && text.contains("GROWN") && text.contains("FAILS"),
            "{text}"
        );
        let (passes, text) = compared(1000, 969);
        assert!(passes && text.contains("less"), "{text}");
    }

    #[test]
    fn every_kernel_must_be_known_and_measured() {
        let one = counts("1.95", [("lgvi", 1000)]);
        let two = counts("1.95", [("lgvi", 1000), ("nystrom", 5000)]);
        let appeared = Comparison::of(&one, &two);
        assert!(!appeared.passes() && appeared.to_string().contains("NOT IN THE FILE"));
        let gone = Comparison::of(&two, &one);
        assert!(!gone.passes() && gone.to_string().contains("NOT MEASURED"));
    }

    #[test]
    fn another_compiler_has_a_wider_limit_and_is_named() {
        let kept = counts("1.95", [("lgvi", 1000)]);
        let within = Comparison::of(&kept, &counts("1.96", [("lgvi", 1200)]));
        let text = within.to_string();
        assert!(within.passes(), "{text}");
        assert!(
            text.contains("1.95") && text.contains("1.96") && text.contains("25 %"),
            "{text}"
        );
        assert!(!Comparison::of(&kept, &counts("1.96", [("lgvi", 1260)])).passes());
    }

    #[test]
    fn the_file_reads_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("instructions.toml");
        let written = counts("1.95", [("lgvi", 1000), ("nystrom", 5000)]);
        written.write(&path).unwrap();
        assert_eq!(Counts::read(&path).unwrap(), written);
        std::fs::write(&path, "toolchain = 5").unwrap();
        let refusal = Counts::read(&path).unwrap_err().to_string();
        assert!(refusal.contains("instructions.toml"), "{refusal}");
    }
}
