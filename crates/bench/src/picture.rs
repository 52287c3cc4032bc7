//! Diagrams with linear or logarithmic axes, as SVG.

use std::path::Path;

use plotters::prelude::*;

use crate::error::BenchError;

/// An axis with its label.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    label: String,
    logarithmic: bool,
}

/// A line through points with what it is.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub label: String,
    pub points: Vec<[f64; 2]>,
}

/// A diagram to be drawn.
pub(crate) struct Picture {
    pub title: String,
    pub horizontal: Axis,
    pub vertical: Axis,
}

impl Axis {
    pub(crate) fn linear(label: &str) -> Self {
        Self {
            label: label.into(),
            logarithmic: false,
        }
    }

    pub(crate) fn logarithmic(label: &str) -> Self {
        Self {
            label: label.into(),
            logarithmic: true,
        }
    }

    /// Where a value lies on the axis: its decimal logarithm or itself.
    fn place(&self, value: f64) -> f64 {
        if self.logarithmic {
            value.max(1e-300).log10()
        } else {
            value
        }
    }

    fn tick(&self, place: f64) -> String {
        if self.logarithmic {
            format!("{:.0e}", 10.0_f64.powf(place))
        } else {
            format!("{place:.0}")
        }
    }

    /// How many ticks: one a decade where there are some, two in each where there are few.
    fn ticks(&self, range: &std::ops::Range<f64>) -> usize {
        if self.logarithmic {
            let decades = (range.end - range.start).ceil().clamp(1.0, 12.0) as usize;
            if decades < 4 { 2 * decades } else { decades }
        } else {
            8
        }
    }

    fn range(&self, values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
        let places = values.map(|value| self.place(value));
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
            (low.min(place), high.max(place))
        });
        if !(low.is_finite() && high.is_finite()) {
            return 0.0..1.0;
        }
        let free = 0.04 * (high - low).max(1e-12 * high.abs().max(1e-300));
        low - free..high + free
    }
}

const SIZE: (u32, u32) = (1000, 560);

/// Width of the diagram, left of the legend (px).
const DIAGRAM: u32 = 770;

/// Height of a line of the legend (px).
const LINE: i32 = 24;

/// Of dashed lines (px).
const DASH: u32 = 9;
const GAP: u32 = 6;

/// Colors that stay apart for most eyes, and in gray.
const COLORS: [RGBColor; 12] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(90, 90, 90),
    RGBColor(120, 60, 160),
    RGBColor(160, 110, 60),
    RGBColor(240, 100, 120),
    RGBColor(150, 190, 20),
    RGBColor(20, 20, 20),
];

impl Picture {
    /// Draws `curves` to the file at `path`, whose directory is made.
    pub(crate) fn draw(&self, path: &Path, curves: &[Curve]) -> Result<(), BenchError> {
        self.draw_beside(path, curves, &[])
    }

    /// The same with the curves of others, which are dashed.
    pub(crate) fn draw_beside(
        &self,
        path: &Path,
        curves: &[Curve],
        others: &[Curve],
    ) -> Result<(), BenchError> {
        let refuse = |error: String| BenchError::Picture(format!("{}: {error}", path.display()));
        if let Some(directory) = path.parent() {
            std::fs::create_dir_all(directory).map_err(|error| refuse(error.to_string()))?;
        }
        self.try_draw(path, curves, others)
            .map_err(|error| refuse(error.to_string()))?;
        println!("{}", path.display());
        Ok(())
    }

    fn try_draw(
        &self,
        path: &Path,
        curves: &[Curve],
        others: &[Curve],
    ) -> Result<(), Box<dyn std::error::Error + '_>> {
        let all = || curves.iter().chain(others);
        let points = || all().flat_map(|curve| &curve.points);
        let x = self.horizontal.range(points().map(|point| point[0]));
        let y = self.vertical.range(points().map(|point| point[1]));
        let root = SVGBackend::new(path, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let (left, right) = root.split_horizontally(DIAGRAM);
        let (x_ticks, y_ticks) = (self.horizontal.ticks(&x), self.vertical.ticks(&y));
        let mut chart = ChartBuilder::on(&left)
            .caption(&self.title, ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(70)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(225, 225, 225))
            .x_desc(&self.horizontal.label)
            .y_desc(&self.vertical.label)
            .x_labels(x_ticks)
            .y_labels(y_ticks)
            .x_label_formatter(&|place| self.horizontal.tick(*place))
            .y_label_formatter(&|place| self.vertical.tick(*place))
            .draw()?;
        for (index, curve) in all().enumerate() {
            let dashed = index >= curves.len();
            let place_in_kind = if dashed { index - curves.len() } else { index };
            let style = COLORS[place_in_kind % COLORS.len()].stroke_width(2);
            let place = |point: &[f64; 2]| {
                (
                    self.horizontal.place(point[0]),
                    self.vertical.place(point[1]),
                )
            };
            let line = curve.points.iter().map(place);
            let y = 60 + LINE * index as i32;
            if dashed {
                chart.draw_series(DashedLineSeries::new(line, DASH, GAP, style))?;
                right.draw(&PathElement::new([(0, y), (9, y)], style))?;
                right.draw(&PathElement::new([(15, y), (24, y)], style))?;
            } else {
                chart.draw_series(LineSeries::new(line, style))?;
                right.draw(&PathElement::new([(0, y), (24, y)], style))?;
            }
            let text = ("sans-serif", 14).into_font();
            right.draw(&Text::new(curve.label.as_str(), (32, y - 7), text))?;
        }
        root.present()?;
        Ok(())
    }
}
