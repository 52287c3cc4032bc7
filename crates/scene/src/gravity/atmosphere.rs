//! The atmosphere of the fixed attractor.

use std::f64::consts::TAU;
use std::sync::Arc;

use lgvi_dynamics::drag::{Atmosphere, Drag, DragError};
use nalgebra::Vector3;
use serde::Deserialize;

use crate::{SceneError, Units, check};

const KEY: &str = "gravity.central.atmosphere";

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(super) struct AtmosphereFile {
    /// A body of the solar system, whose atmosphere gives the defaults of the other keys.
    body: Option<AtmosphereBody>,
    /// Altitudes, ascending, and the densities there: [[altitude, density], ...]. Between them the logarithm of the density is
    /// linear, and below the first it goes on as above it.
    density: Option<Vec<[f64; 2]>>,
    /// Scale height above the last altitude.
    scale_height: Option<f64>,
    /// Radius of the sphere that altitudes are counted from; that of the attractor by default.
    radius: Option<f64>,
    /// Angular velocity of the air, inertial frame (rad per unit of time); 0 by default, or that of `body`.
    rotation: Option<[f64; 3]>,
}

/// A body with a known atmosphere.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
enum AtmosphereBody {
    /// The Earth: a mean atmosphere up to 1000 km.
    Earth,
}

/// The Earth's atmosphere: altitudes (km) and densities (kg/m³), and the scale height above (km).
///
/// U.S. Standard Atmosphere 1976 at 0 km, CIRA-72 from 25 km on, from 500 km on with an exospheric temperature of 1000 K.
/// D. A. Vallado, *Fundamentals of Astrodynamics and Applications*, 4th ed., Microcosm 2013, table 8-4. Solar activity changes
/// the density at 400 km by a factor of about 3 either way.
const EARTH: [[f64; 2]; 28] = [
    [0.0, 1.225],
    [25.0, 3.899e-2],
    [30.0, 1.774e-2],
    [40.0, 3.972e-3],
    [50.0, 1.057e-3],
    [60.0, 3.206e-4],
    [70.0, 8.770e-5],
    [80.0, 1.905e-5],
    [90.0, 3.396e-6],
    [100.0, 5.297e-7],
    [110.0, 9.661e-8],
    [120.0, 2.438e-8],
    [130.0, 8.484e-9],
    [140.0, 3.845e-9],
    [150.0, 2.070e-9],
    [180.0, 5.464e-10],
    [200.0, 2.789e-10],
    [250.0, 7.248e-11],
    [300.0, 2.418e-11],
    [350.0, 9.518e-12],
    [400.0, 3.725e-12],
    [450.0, 1.585e-12],
    [500.0, 6.967e-13],
    [600.0, 1.454e-13],
    [700.0, 3.614e-14],
    [800.0, 1.170e-14],
    [900.0, 5.245e-15],
    [1000.0, 3.019e-15],
];
const EARTH_SCALE_HEIGHT: f64 = 268.0;

/// The duration of a turn of the Earth about its axis, relative to the stars (s).
const EARTH_DAY: f64 = 86_164.098_9;

/// Creates the atmosphere of an attractor at `center` with this pole and radius.
pub(super) fn parse(
    file: &AtmosphereFile,
    center: Vector3<f64>,
    pole: Vector3<f64>,
    radius: f64,
    units: &Units,
) -> Result<Atmosphere, SceneError> {
    let key = |name: &str| format!("{KEY}.{name}");
    let known = file.body.is_some();
    let density = match (&file.density, known) {
        (Some(density), _) => density.clone(),
        (None, true) => earth(units),
        (None, false) => {
            let expected = "altitudes with densities, or the name of a `body`";
            return Err(SceneError::missing(key("density"), expected));
        }
    };
    let scale_height = match (file.scale_height, known) {
        (Some(height), _) => height,
        (None, true) if file.density.is_none() => EARTH_SCALE_HEIGHT * 1e3 / units.length,
        (None, _) => {
            let expected = "the scale height above the last altitude";
            return Err(SceneError::missing(key("scale_height"), expected));
        }
    };
    let radius = match file.radius {
        Some(radius) => check::not_negative(&key("radius"), radius)?,
        None if radius > 0.0 => radius,
        None => {
            let expected = "the radius that altitudes are counted from: the attractor has none";
            return Err(SceneError::missing(key("radius"), expected));
        }
    };
    let rotation = match (file.rotation, known) {
        (Some(rotation), _) => check::vector(&key("rotation"), rotation)?,
        (None, true) => pole * (TAU / EARTH_DAY * units.time),
        (None, false) => Vector3::zeros(),
    };
    Atmosphere::new(center, rotation, radius, &density, scale_height).map_err(|error| match error {
        DragError::ScaleHeight(height) => {
            SceneError::value(key("scale_height"), height, "a finite number > 0")
        }
        DragError::Density { index, density } => SceneError::value(
            key(&format!("density[{index}]")),
            density,
            "a density that is a finite number > 0",
        ),
        DragError::Altitude { index, altitude } => SceneError::value(
            key(&format!("density[{index}]")),
            altitude,
            "a finite altitude above that of the layer before it",
        ),
        error => SceneError::value(KEY, error.to_string(), "an atmosphere"),
    })
}

/// The Earth's densities in the units of a scene.
fn earth(units: &Units) -> Vec<[f64; 2]> {
    let volume = units.length * units.length * units.length;
    let each = EARTH.iter();
    each.map(|[altitude, density]| [altitude * 1e3 / units.length, density * volume / units.mass])
        .collect()
}

/// What drags on a body.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct DragFile {
    /// Area that the drag coefficient refers to.
    pub area: f64,
    /// Drag coefficient; 2.2 by default.
    #[serde(default = "coefficient")]
    pub coefficient: f64,
}

fn coefficient() -> f64 {
    2.2
}

impl DragFile {
    /// Creates the drag of the body whose keys begin with `key`.
    pub(crate) fn parse(
        self,
        key: &str,
        atmosphere: Option<&Arc<Atmosphere>>,
    ) -> Result<Drag, SceneError> {
        let area = check::positive(&format!("{key}.area"), self.area)?;
        let coefficient = check::positive(&format!("{key}.coefficient"), self.coefficient)?;
        let Some(atmosphere) = atmosphere else {
            let expected = "an atmosphere, as there is a body with `drag`";
            return Err(SceneError::missing(KEY, expected));
        };
        let area = area * coefficient;
        Drag::new(Arc::clone(atmosphere), area)
            .map_err(|_| SceneError::value(key, area, "a drag area in the range of numbers"))
    }
}
