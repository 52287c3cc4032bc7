//! Colors and sizes, the same in all figures. Most colors are Okabe and Ito's, which color-blind readers can tell apart.

use plotters::style::RGBColor;

pub(super) const PAPER: RGBColor = RGBColor(255, 255, 255);
pub(super) const INK: RGBColor = RGBColor(38, 38, 38);
pub(super) const SOFT_INK: RGBColor = RGBColor(105, 105, 105);
pub(super) const FRAME: RGBColor = RGBColor(170, 170, 170);
pub(super) const GRID: RGBColor = RGBColor(228, 228, 228);
pub(super) const WALL: RGBColor = RGBColor(250, 250, 250);

/// Of x, y and z, everywhere.
pub(super) const COMPONENTS: [RGBColor; 3] = [VERMILION, GREEN, BLUE];
const VERMILION: RGBColor = RGBColor(213, 94, 0);
const GREEN: RGBColor = RGBColor(0, 158, 115);
const BLUE: RGBColor = RGBColor(0, 114, 178);

/// Of energies: translation, rotation, potential.
pub(super) const ENERGIES: [RGBColor; 3] = [SKY, PURPLE, ORANGE];
const SKY: RGBColor = RGBColor(86, 180, 233);
const PURPLE: RGBColor = RGBColor(204, 121, 167);
const ORANGE: RGBColor = RGBColor(230, 159, 0);

/// Of bodies in the order in which they are named, from the muted palette of P. Tol.
pub(super) const BODIES: [RGBColor; 4] = [
    RGBColor(51, 34, 136),
    RGBColor(170, 68, 153),
    RGBColor(153, 153, 51),
    RGBColor(102, 166, 194),
];

/// Of bodies that are not named.
pub(super) const OTHERS: RGBColor = RGBColor(178, 178, 178);

/// Of control forces; of what a flight is to reach or to stay in; of what it must stay out of, and limits.
pub(super) const FORCE: RGBColor = RGBColor(214, 40, 57);
pub(super) const TARGET: RGBColor = RGBColor(68, 140, 60);
pub(super) const LIMIT: RGBColor = RGBColor(136, 34, 85);

pub(super) const ATTRACTOR: RGBColor = RGBColor(250, 204, 21);

/// Font sizes, readable where the picture is as wide as a page.
pub(super) const TITLE: f64 = 25.0;
pub(super) const HEADING: f64 = 16.0;
pub(super) const LABEL: f64 = 15.0;

/// A color mixed with paper; 1 is paper.
pub(super) fn faded(color: RGBColor, part: f64) -> RGBColor {
    let mix = |ink: u8, paper: u8| {
        (f64::from(ink) + (f64::from(paper) - f64::from(ink)) * part).round() as u8
    };
    RGBColor(
        mix(color.0, PAPER.0),
        mix(color.1, PAPER.1),
        mix(color.2, PAPER.2),
    )
}
