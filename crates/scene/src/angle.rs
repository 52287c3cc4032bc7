//! Angles of a scene's file: numbers in radians, or texts with a unit.

use std::f64::consts::PI;

use lgvi_control::ParameterError;
use serde::Deserialize;

const UNITS: [(&str, f64); 4] = [
    ("rad", 1.0),
    ("deg", PI / 180.0),
    ("arcmin", PI / 10_800.0),
    ("arcsec", PI / 648_000.0),
];

const EXPECTED: &str =
    "an angle: a number (rad), or a text such as \"25 deg\" (rad, deg, arcmin, arcsec)";

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected an angle: a number (rad), or a text such as \"25 deg\" (rad, deg, arcmin, arcsec)"
)]
pub(crate) enum AngleFile {
    Radians(f64),
    Text(String),
}

/// Returns the angle of the parameter `name` (rad).
pub(crate) fn angle(name: &'static str, file: &AngleFile) -> Result<f64, ParameterError> {
    match file {
        AngleFile::Radians(angle) => Ok(*angle),
        AngleFile::Text(text) => {
            parse(text).ok_or_else(|| ParameterError::new(name, text, EXPECTED))
        }
    }
}

/// Returns an angle of half a turn at most (rad). A number beyond π is refused: degrees were meant, most likely.
pub(crate) fn half_turn(name: &'static str, file: &AngleFile) -> Result<f64, ParameterError> {
    match file {
        AngleFile::Radians(angle) if *angle > PI => {
            let expected = format!("an angle below π (rad); is it \"{angle} deg\"?");
            Err(ParameterError::new(name, angle, expected))
        }
        file => angle(name, file),
    }
}

fn parse(text: &str) -> Option<f64> {
    let (number, symbol) = text.trim().split_once(char::is_whitespace)?;
    let number: f64 = number.parse().ok()?;
    let (_, size) = UNITS.iter().find(|(known, _)| *known == symbol.trim())?;
    Some(number * size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_beyond_a_half_turn_was_meant_in_degrees() {
        assert_eq!(angle("raan", &AngleFile::Radians(4.0)).unwrap(), 4.0);
        let error = half_turn("half_angle", &AngleFile::Radians(25.0)).unwrap_err();
        assert!(error.expected.contains("\"25 deg\""), "{error:?}");
    }

    #[test]
    fn angles_have_units() {
        let text = |text: &str| half_turn("half_angle", &AngleFile::Text(text.into()));
        assert_eq!(text("180 deg").unwrap(), PI);
        assert_eq!(text("0.5 rad").unwrap(), 0.5);
        assert!((text("60 arcmin").unwrap() - PI / 180.0).abs() < 1e-17);
        assert!((text("3600 arcsec").unwrap() - PI / 180.0).abs() < 1e-17);
        for wrong in ["25", "deg", "25 degrees", "x deg"] {
            let error = text(wrong).unwrap_err();
            assert!(error.expected.contains("25 deg"), "{error:?}");
        }
    }
}
