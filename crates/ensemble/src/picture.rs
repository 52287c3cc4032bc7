use std::error::Error;

use plotters::prelude::*;

use crate::{EnsembleError, Summary};

/// Number of histograms per row, and maximum number in total.
const ACROSS: usize = 3;
const MOST: usize = 12;

/// Width and height of a histogram (px), and height of the heading (px).
const SIZE: (u32, u32) = (360, 240);
const HEADING: u32 = 40;

const COLOR: RGBColor = RGBColor(0, 114, 178);
const GRID: RGBColor = RGBColor(225, 225, 225);

/// Parts of column names in order of relevance. Only columns that vary are drawn.
const TELLING: [&str; 5] = [
    "miss.",
    "violation.",
    "change.",
    ".final.position.",
    ".final.angular_velocity.",
];

/// Draws histograms of the most relevant columns as SVG. Returns `None` if no column varies.
///
/// # Errors
/// Returns an error if the picture cannot be drawn.
pub fn draw(summary: &Summary) -> Result<Option<String>, EnsembleError> {
    let chosen = chosen(summary);
    if chosen.is_empty() {
        return Ok(None);
    }
    let mut picture = String::new();
    let drawn = try_draw(summary, &chosen, &mut picture);
    drawn.map_err(|error| EnsembleError::Picture(error.to_string()))?;
    Ok(Some(picture))
}

/// Returns the most relevant columns that vary.
fn chosen(summary: &Summary) -> Vec<usize> {
    let varies = |column: &usize| {
        let statistics = summary.columns[*column].1;
        varies(statistics.least, statistics.greatest)
    };
    let mut chosen = Vec::new();
    for part in TELLING {
        let columns = 0..summary.columns.len();
        chosen.extend(
            columns
                .filter(|column| summary.columns[*column].0.contains(part))
                .filter(varies),
        );
    }
    chosen.truncate(MOST);
    chosen
}

/// Returns true if the range is finite and wide enough for bars with distinct edges.
fn varies(low: f64, high: f64) -> bool {
    let step = (high - low) / 64.0;
    step.is_finite() && low < low + step && high - step < high
}

fn try_draw<'a>(
    summary: &Summary,
    chosen: &[usize],
    picture: &'a mut String,
) -> Result<(), Box<dyn Error + 'a>> {
    let across = chosen.len().min(ACROSS);
    let down = chosen.len().div_ceil(ACROSS);
    let size = (SIZE.0 * across as u32, HEADING + SIZE.1 * down as u32);
    let root = SVGBackend::with_string(picture, size).into_drawing_area();
    root.fill(&WHITE)?;
    let heading = format!("{}: {} samples", summary.scene, summary.complete);
    let font = ("sans-serif", 18).into_font();
    root.draw(&Text::new(heading, (16, 12), font))?;
    let (_, charts) = root.split_vertically(HEADING);
    for (area, column) in charts.split_evenly((down, across)).iter().zip(chosen) {
        let (name, _) = &summary.columns[*column];
        let bars: Vec<_> = summary.histograms[*column].bars().collect();
        histogram(area, name, &bars)?;
    }
    root.present()?;
    Ok(())
}

fn histogram<'a>(
    area: &DrawingArea<SVGBackend<'a>, plotters::coord::Shift>,
    name: &str,
    bars: &[([f64; 2], u64)],
) -> Result<(), Box<dyn Error + 'a>> {
    let (Some(([low, _], _)), Some(([_, high], _))) = (bars.first(), bars.last()) else {
        return Ok(());
    };
    let (low, high) = (*low, *high);
    let most = bars.iter().map(|(_, count)| *count).max().unwrap_or(1);
    let mut chart = ChartBuilder::on(area)
        .caption(name, ("sans-serif", 14))
        .margin(8)
        .x_label_area_size(24)
        .y_label_area_size(44)
        .build_cartesian_2d(low..high, 0.0..1.08 * most as f64)?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .bold_line_style(GRID)
        .x_labels(4)
        .y_labels(5)
        .x_label_formatter(&|value| tick(*value, high.abs().max(low.abs()), high - low))
        .y_label_formatter(&|value| format!("{value:.0}"))
        .draw()?;
    chart.draw_series(bars.iter().map(|([left, right], count)| {
        Rectangle::new([(*left, 0.0), (*right, *count as f64)], COLOR.filled())
    }))?;
    Ok(())
}

/// Formats a number with enough digits to distinguish the ticks.
fn tick(value: f64, size: f64, range: f64) -> String {
    let digits = (size / range).log10().ceil().clamp(0.0, 14.0) as usize + 1;
    if (1e-2..1e4).contains(&size) {
        let decimals = (1.0 - range.log10().floor()).clamp(0.0, 15.0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.digits$e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_varies_has_a_finite_range_of_many_numbers() {
        assert!(varies(-1.0, 3.0));
        let infinity = f64::INFINITY;
        for (low, high) in [
            (-infinity, 0.0),
            (0.0, infinity),
            (-1e308, 1e308),
            (2.0, 2.0),
            (3.0, 2.0),
            (1.0, 1.0 + f64::EPSILON),
            (0.0, f64::from_bits(1)),
            (f64::NAN, 1.0),
        ] {
            assert!(!varies(low, high), "{low}..{high}");
        }
    }
}
