//! The picture of a sweep: its flights over time, one over the other.

use std::collections::BTreeSet;

use lgvi_middleware::node::NodeError;
use lgvi_review::sweep::Combination;
use plotters::style::RGBColor;

use super::watched::{Point, Watched};
use crate::plot::panels::{self, Curve, Panel};

/// Most flights that are drawn.
const MOST: usize = 6;

/// Most bodies that are drawn.
const BODIES: usize = 4;

/// Colors that color-blind readers can tell apart, from the first to the last flight.
const COLORS: [RGBColor; MOST] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(38, 38, 38),
];

/// Indices of the flights that are drawn: the first, the last, and some in between.
pub(super) fn drawn(count: usize) -> BTreeSet<usize> {
    let shown = count.min(MOST);
    let last = count.saturating_sub(1);
    (0..shown)
        .map(|k| last * k / shown.saturating_sub(1).max(1))
        .collect()
}

/// Relative changes of energy, and how far the bodies have moved or, where they stay, turned.
pub(super) fn draw(
    title: &str,
    combinations: &[Combination],
    flown: &[Watched],
) -> Result<String, NodeError> {
    let shown: Vec<_> = drawn(flown.len())
        .into_iter()
        .zip(COLORS)
        .filter(|(index, _)| !flown[*index].course.is_empty())
        .collect();
    let curves = |value: &dyn Fn(&Watched, &Point) -> f64| -> Vec<Curve> {
        let each = shown.iter().map(|(index, color)| {
            let flight = &flown[*index];
            let points = flight.course.iter();
            Curve {
                label: label(&combinations[*index]),
                color: *color,
                points: points
                    .map(|point| [point.time, value(flight, point)])
                    .collect(),
            }
        });
        each.collect()
    };
    let energy = curves(&|flight, point| {
        let start = flight.course[0].energy;
        let energies = flight.course.iter().map(|point| point.energy.abs());
        let size = energies.fold(0.0, f64::max);
        if size > 0.0 {
            (point.energy - start) / size
        } else {
            0.0
        }
    });
    let mut panels = vec![Panel::new("Relative change of energy", "", energy)];
    let names = shown
        .first()
        .map_or(&[][..], |(index, _)| &flown[*index].bodies);
    for (body, name) in names.iter().enumerate().take(BODIES) {
        let of = |values: &[f64]| values.get(body).copied().unwrap_or_default();
        let moved = curves(&|_, point| of(&point.moved));
        let stays = moved.iter().flat_map(|curve| &curve.points);
        panels.push(if stays.into_iter().all(|[_, distance]| *distance == 0.0) {
            let turned = curves(&|_, point| of(&point.turned).to_degrees());
            Panel::new(format!("Turn of {name} since the start"), "°", turned)
        } else {
            Panel::new(format!("Distance of {name} from its start"), "m", moved)
        });
    }
    panels::draw(title, &panels)
}

/// The values of a combination, as a legend shows them.
fn label(combination: &Combination) -> String {
    let settings = combination.settings().iter();
    let values: Vec<_> = settings.map(|(_, value)| value.as_str()).collect();
    values.join(", ")
}
