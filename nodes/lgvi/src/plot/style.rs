//! Colors and sizes, the same in all figures. The palette is Okabe and Ito's, which color-blind readers can tell apart.

use plotters::style::RGBColor;

pub(super) const PAPER: RGBColor = RGBColor(255, 255, 255);
pub(super) const INK: RGBColor = RGBColor(38, 38, 38);
pub(super) const SOFT_INK: RGBColor = RGBColor(105, 105, 105);
pub(super) const FRAME: RGBColor = RGBColor(170, 170, 170);
pub(super) const GRID: RGBColor = RGBColor(228, 228, 228);
pub(super) const WALL: RGBColor = RGBColor(250, 250, 250);

pub(super) const BLUE: RGBColor = RGBColor(0, 114, 178);
pub(super) const VERMILION: RGBColor = RGBColor(213, 94, 0);
pub(super) const GREEN: RGBColor = RGBColor(0, 158, 115);
pub(super) const ORANGE: RGBColor = RGBColor(230, 159, 0);
pub(super) const SKY: RGBColor = RGBColor(86, 180, 233);
pub(super) const PURPLE: RGBColor = RGBColor(204, 121, 167);

/// Of bodies, by index.
pub(super) const BODIES: [RGBColor; 6] = [BLUE, ORANGE, GREEN, PURPLE, SKY, VERMILION];

/// Of x, y and z.
pub(super) const COMPONENTS: [RGBColor; 3] = [VERMILION, GREEN, BLUE];

/// Font sizes.
pub(super) const TITLE: f64 = 25.0;
pub(super) const HEADING: f64 = 15.0;
pub(super) const LABEL: f64 = 13.5;

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
