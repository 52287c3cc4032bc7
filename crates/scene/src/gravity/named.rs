//! Bodies of the solar system as attractors.

use nalgebra::Vector3;
use serde::Deserialize;

use crate::Units;

/// An attractor by its name.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub(super) enum NamedFile {
    /// The Earth: EGM2008 (tide-free).
    Earth,
    /// The Moon: GM of DE440, J₂ of DE430.
    Moon,
    /// The Sun: DE440.
    Sun,
    /// Mars: GMM-3.
    Mars,
}

/// The constants of an attractor, in SI or in the units of a scene.
#[derive(Clone, Copy)]
pub(super) struct Constants {
    pub name: &'static str,
    pub gm: f64,
    pub radius: f64,
    pub j2: f64,
    pub reference_radius: f64,
    pub pole: Vector3<f64>,
}

impl NamedFile {
    /// Returns the constants, in the units of a scene.
    pub(super) fn constants(self, units: &Units) -> Constants {
        let constants = self.in_si();
        let volume = units.length * units.length * units.length;
        Constants {
            gm: constants.gm * (units.time * units.time) / volume,
            radius: constants.radius / units.length,
            reference_radius: constants.reference_radius / units.length,
            ..constants
        }
    }

    /// Returns the constants in SI. The sources of field and reference radius:
    ///
    /// - Earth: N. K. Pavlis et al., *The development and evaluation of the Earth Gravitational Model 2008*, JGR 117 (2012);
    ///   `J₂ = −√5 C̄₂₀` with `C̄₂₀ = −0.484165143790815e-3`, tide-free.
    /// - Moon and Sun: R. S. Park et al., *The JPL planetary and lunar ephemerides DE440 and DE441*, AJ 161 (2021); the Moon's
    ///   `J₂` without tides: W. M. Folkner et al., *The planetary and lunar ephemerides DE430 and DE431*, IPN 42-196 (2014).
    /// - Mars: A. Genova et al., *Seasonal and static gravity field of Mars …*, Icarus 272 (2016), the model GMM-3; `C̄₂₀ =
    ///   −8.7502113235452894e-4`.
    ///
    /// Mean radii and poles at J2000 in the ICRF: B. A. Archinal et al., *Report of the IAU Working Group on Cartographic
    /// Coordinates and Rotational Elements: 2015*, CMDA 130 (2018). The radius of the Sun: IAU 2015 resolution B3.
    fn in_si(self) -> Constants {
        match self {
            Self::Earth => Constants {
                name: "Earth",
                gm: 3.986_004_415e14,
                radius: 6_371_008.4,
                j2: 1.082_626_173_852_222_7e-3,
                reference_radius: 6_378_136.3,
                pole: Vector3::z(),
            },
            Self::Moon => Constants {
                name: "Moon",
                gm: 4.902_800_118_457_55e12,
                radius: 1_737_400.0,
                j2: 2.032_156_846_495_257e-4,
                reference_radius: 1_738_000.0,
                pole: direction(266.857_733, 65.641_103),
            },
            Self::Sun => Constants {
                name: "Sun",
                gm: 1.327_124_400_412_794_2e20,
                radius: 695_700_000.0,
                j2: 2.196_139_151_652_982_5e-7,
                reference_radius: 696_000_000.0,
                pole: direction(286.13, 63.87),
            },
            Self::Mars => Constants {
                name: "Mars",
                gm: 4.282_837_285_418_776e13,
                radius: 3_389_500.0,
                j2: 1.956_606_733_693_567_3e-3,
                reference_radius: 3_396_000.0,
                pole: direction(317.680_854, 52.886_439),
            },
        }
    }
}

/// Returns the unit vector of a right ascension and a declination (degrees).
fn direction(right_ascension: f64, declination: f64) -> Vector3<f64> {
    let [ra, dec] = [right_ascension, declination].map(f64::to_radians);
    let along = libm::cos(dec);
    Vector3::new(along * libm::cos(ra), along * libm::sin(ra), libm::sin(dec))
}
