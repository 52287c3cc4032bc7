//! What a case has shown: figures, a table and two diagrams.

use std::path::Path;

use serde::Serialize;

use super::cases::{Quantity, Setting};
use super::measure::{LeftOut, Measured, Point};
use super::ratio::{median, times_at};
use crate::error::{BenchError, write_json};
use crate::picture::{Axis, Curve, Picture};
use crate::spread::{Spread, short};
use crate::tables::Table;

/// In pictures and tables; the figures have all of this project's.
const SHOWN: [&str; 12] = [
    "LGVI",
    "composition 8, discrete rotor",
    "Nyström 4",
    "Nyström 6",
    "Nyström 8",
    "Galerkin 4",
    "implicit midpoint",
    "Runge–Kutta 4",
    "Wisdom–Holman (10, 6, 4)",
    "Dormand–Prince 8(5,3)",
    "Taylor",
    "closed form",
];

/// To this of the methods that are there all are compared.
const REFERENCES: [&str; 2] = ["heyoka Taylor", "Dormand–Prince 8(5,3)"];

/// Below this an error is drawn as this.
const LEAST: f64 = 1e-17;

/// A case.
#[derive(Serialize)]
pub(crate) struct Report {
    case: &'static str,
    /// Time of the last reference state.
    pub t: f64,
    /// The error by which times are compared.
    pub quantity: Quantity,
    /// Peers with their versions.
    pub peers: Vec<String>,
    pub methods: Vec<Measured>,
    /// Methods without a flight that was timed.
    pub left_out: Vec<LeftOut>,
    /// To what times are compared.
    pub reference: Option<String>,
    pub ratios: Vec<Ratio>,
}

/// Time of a method in parts of the reference's at one error.
#[derive(Serialize)]
pub(crate) struct Ratio {
    method: String,
    error: f64,
    /// Median of the method's time (s).
    seconds: f64,
    /// Whether the method's time is only a bound from above: its coarsest flight has a smaller error.
    at_most: bool,
    /// The same of the reference's time.
    reference_at_most: bool,
    /// Repetition by repetition.
    ratio: Spread,
}

/// Marked as a bound where it is one; nothing where it is none.
impl std::fmt::Display for Ratio {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.at_most, self.reference_at_most) {
            (false, false) => write!(f, "{}", self.ratio),
            (true, false) => write!(f, "≤ {}", self.ratio),
            (false, true) => write!(f, "≥ {}", self.ratio),
            (true, true) => write!(f, "–"),
        }
    }
}

impl Report {
    pub(super) fn new(
        setting: &Setting,
        peers: Vec<String>,
        methods: Vec<Measured>,
        left_out: Vec<LeftOut>,
    ) -> Self {
        let find = |name: &&&str| methods.iter().find(|measured| measured.method == ***name);
        let reference = REFERENCES.iter().find(|name| find(name).is_some());
        let reference = reference.and_then(|name| find(&name));
        let mut ratios = Vec::new();
        for measured in &methods {
            for error in setting.targets {
                let times = times_at(measured, setting, error);
                let below = reference.and_then(|measured| times_at(measured, setting, error));
                let (Some(times), Some(below)) = (times, below) else {
                    continue;
                };
                let seconds = Spread::of(times.seconds.iter().copied());
                let ratio = Spread::of_ratios(&times.seconds, &below.seconds);
                if let (Some(ratio), Some(seconds)) = (ratio, seconds) {
                    ratios.push(Ratio {
                        method: measured.method.clone(),
                        error,
                        seconds: seconds.median,
                        at_most: times.at_most,
                        reference_at_most: below.at_most,
                        ratio,
                    });
                }
            }
        }
        Self {
            case: setting.name,
            t: setting.t,
            quantity: setting.quantity,
            peers,
            reference: reference.map(|measured| measured.method.clone()),
            methods,
            left_out,
            ratios,
        }
    }

    /// The name of its table, and of its other files but for their endings.
    pub(super) fn name(&self) -> String {
        format!("precision_{}", self.case)
    }

    /// Writes `precision_<case>.json`, the table `precision_<case>` and both diagrams.
    pub(super) fn keep(&self, setting: &Setting, directory: &Path) -> Result<(), BenchError> {
        let name = self.name();
        let case = self.case.replace('_', " ");
        self.table(setting)
            .below(
                &format!("{case}: run time against error"),
                &format!("{name}.svg"),
            )
            .below(
                &format!("{case}: run time against energy error"),
                &format!("{name}_energy.svg"),
            )
            .keep(directory, &name)?;
        write_json(&directory.join(&name).with_extension("json"), self)?;
        let last = |point: &Point| point.errors.last().map(|errors| setting.error(errors));
        self.draw(&setting.error_label(), last, &name, directory)?;
        let energy = |point: &Point| {
            let errors = point.errors.iter().map(|errors| errors.energy);
            errors.reduce(f64::max)
        };
        let label = "largest relative energy error at the reference times";
        self.draw(label, energy, &format!("{name}_energy"), directory)
    }

    fn shown(&self) -> impl Iterator<Item = &Measured> {
        let shown =
            |measured: &&Measured| measured.peer || SHOWN.contains(&measured.method.as_str());
        self.methods.iter().filter(shown)
    }

    /// Times in parts of the reference's, with quartiles; every method of a peer has a row.
    fn table(&self, setting: &Setting) -> Table {
        let reference = self.reference.as_deref().unwrap_or("nothing");
        let head = format!(
            "time in parts of that of {reference}, at {}",
            setting.error_label()
        );
        let targets = setting.targets.iter().map(|target| format!("{target:.0e}"));
        let mut table = Table::new(std::iter::once(head).chain(targets));
        for measured in self.shown() {
            let cell = |target: &f64| {
                let of_this =
                    |ratio: &&Ratio| ratio.method == measured.method && ratio.error == *target;
                match self.ratios.iter().find(of_this) {
                    Some(ratio) if measured.method == reference => {
                        let bound = if ratio.at_most { "≤ " } else { "" };
                        format!("1 ({bound}{} ms)", short(1e3 * ratio.seconds))
                    }
                    Some(ratio) => ratio.to_string(),
                    None => String::new(),
                }
            };
            let cells: Vec<_> = setting.targets.iter().map(cell).collect();
            if measured.peer || cells.iter().any(|cell| !cell.is_empty()) {
                table.row(std::iter::once(measured.method.clone()).chain(cells));
            }
        }
        for left_out in self.left_out.iter().filter(|left_out| left_out.peer) {
            let empty = vec![String::new(); setting.targets.len()];
            table.row(std::iter::once(left_out.method.clone()).chain(empty));
        }
        table
    }

    fn draw(
        &self,
        label: &str,
        error: impl Fn(&Point) -> Option<f64>,
        name: &str,
        directory: &Path,
    ) -> Result<(), BenchError> {
        let picture = Picture {
            title: self.case.replace('_', " "),
            horizontal: Axis::logarithmic(label),
            vertical: Axis::logarithmic("CPU time (s)"),
        };
        let place = |point: &Point| Some([error(point)?.max(LEAST), median(point)]);
        let curve = |measured: &Measured| Curve {
            label: measured.method.clone(),
            points: measured.points.iter().filter_map(place).collect(),
        };
        let drawn = |peer| {
            let of_kind = self.shown().filter(move |measured| measured.peer == peer);
            let curves = of_kind.map(curve);
            curves
                .filter(|curve| !curve.points.is_empty())
                .collect::<Vec<_>>()
        };
        let path = directory.join(name).with_extension("svg");
        picture.draw_beside(&path, &drawn(false), &drawn(true))
    }
}

#[cfg(test)]
mod tests {
    use super::{Ratio, SHOWN};
    use crate::methods::families;
    use crate::spread::Spread;

    #[test]
    fn what_is_shown_exists() {
        let labels: Vec<_> = families().into_iter().map(|(label, _)| label).collect();
        for shown in SHOWN {
            assert!(labels.iter().any(|label| label == shown), "{shown}");
        }
    }

    #[test]
    fn ratios_of_bounds_are_marked() {
        let told = |at_most, reference_at_most| {
            let ratio = Spread::of([2.0]).unwrap();
            let ratio = Ratio {
                method: String::new(),
                error: 1e-6,
                seconds: 1.0,
                at_most,
                reference_at_most,
                ratio,
            };
            ratio.to_string()
        };
        assert_eq!(told(false, false), "2.00 (2.00–2.00)");
        assert_eq!(told(true, false), "≤ 2.00 (2.00–2.00)");
        assert_eq!(told(false, true), "≥ 2.00 (2.00–2.00)");
        assert_eq!(told(true, true), "–");
    }
}
