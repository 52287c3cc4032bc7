//! What transport has shown: figures, a table and a picture.

use std::path::Path;

use super::{Look, Measured, RATES, Round};
use crate::error::{BenchError, write_json};
use crate::picture::{Axis, Curve, Picture};
use crate::spread::{Spread, short};
use crate::tables::Table;

/// What is told of a round.
type Figure = fn(&Round) -> f64;

pub(super) fn keep(all: &[Measured], directory: &Path) -> Result<(), BenchError> {
    let mut shown = table(all);
    for rate in RATES {
        let what = format!("Latency of states at {rate} samples/s");
        shown = shown.below(&what, &picture_name(rate));
    }
    shown.keep(directory, "transport")?;
    write_json(&directory.join("transport.json"), &all)?;
    for rate in RATES {
        draw(all, rate, directory)?;
    }
    Ok(())
}

impl Measured {
    fn each(&self, figure: Figure) -> Vec<f64> {
        self.rounds.iter().map(figure).collect()
    }

    fn median(&self, figure: Figure) -> f64 {
        Spread::of(self.each(figure)).map_or(f64::NAN, |spread| spread.median)
    }

    /// The same through what is below.
    fn bare<'a>(&self, all: &'a [Self]) -> Option<&'a Self> {
        let bare = self.setup.way.bare()?;
        all.iter().find(|other| {
            let (this, other) = (&self.setup, &other.setup);
            other.way == bare
                && other.bodies == this.bodies
                && other.rate == this.rate
                && other.look == this.look
        })
    }

    /// Median in microseconds, with the ratio to what is below where there is something.
    fn cell(&self, all: &[Self], figure: Figure) -> String {
        let time = short(1e6 * self.median(figure));
        let bare = self.bare(all);
        match bare.and_then(|bare| Spread::of_ratios(&self.each(figure), &bare.each(figure))) {
            Some(ratio) => format!("{time}, × {ratio}"),
            None => time,
        }
    }
}

/// Of shared memory the latencies of a receiver that spins and the time on the processor of one that polls.
fn table(all: &[Measured]) -> Table {
    let mut table = Table::new([
        "bodies",
        "samples/s",
        "way",
        "latency, median (µs)",
        "99 % (µs)",
        "most (µs)",
        "sending, a sample (µs)",
        "receiving, a sample (µs)",
        "lost",
    ]);
    for measured in all {
        let setup = &measured.setup;
        let costs = match setup.look {
            Look::Polling => continue,
            Look::Woken => Some(measured),
            Look::Spinning => all.iter().find(|other| {
                let other = &other.setup;
                other.look == Look::Polling
                    && other.way == setup.way
                    && other.bodies == setup.bodies
                    && other.rate == setup.rate
            }),
        };
        let Some(costs) = costs else { continue };
        let lost: u64 = measured.rounds.iter().map(|round| round.lost).sum();
        let received: u64 = measured.rounds.iter().map(|round| round.received).sum();
        table.row([
            setup.bodies.to_string(),
            format!("{:.0}", setup.rate),
            setup.way.label().into(),
            measured.cell(all, |round| round.median),
            measured.cell(all, |round| round.percentile_99),
            short(1e6 * measured.median(|round| round.most)),
            costs.cell(all, |round| round.sending),
            costs.cell(all, |round| round.receiving),
            match lost {
                0 => "0".into(),
                lost => format!("{lost} of {}", lost + received),
            },
        ]);
    }
    table
}

fn picture_name(rate: f64) -> String {
    format!("transport_{rate}.svg")
}

/// Latencies against the number of bodies: medians, and 99 % of them.
fn draw(all: &[Measured], rate: f64, directory: &Path) -> Result<(), BenchError> {
    let curves = |bare: bool| {
        let mut curves: Vec<Curve> = Vec::new();
        let shown = all.iter().filter(|measured| {
            let setup = &measured.setup;
            setup.rate == rate && setup.look != Look::Polling && setup.way.bare().is_none() == bare
        });
        for measured in shown {
            let figures: [(&str, Figure); 2] = [
                ("median", |round| round.median),
                ("99 %", |round| round.percentile_99),
            ];
            for (name, figure) in figures {
                let label = format!("{}, {name}", measured.setup.way.label());
                let point = [measured.setup.bodies as f64, measured.median(figure)];
                match curves.iter_mut().find(|curve| curve.label == label) {
                    Some(curve) => curve.points.push(point),
                    None => curves.push(Curve {
                        label,
                        points: vec![point],
                    }),
                }
            }
        }
        curves
    };
    let picture = Picture {
        title: format!("latency of states at {rate} samples/s"),
        horizontal: Axis::logarithmic("bodies"),
        vertical: Axis::logarithmic("latency (s)"),
    };
    let path = directory.join(picture_name(rate));
    picture.draw_beside(&path, &curves(false), &curves(true))
}
