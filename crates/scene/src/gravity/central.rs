use std::sync::Arc;

use lgvi_dynamics::BodyError;
use lgvi_dynamics::drag::Atmosphere;
use lgvi_dynamics::gravity::{Central, Fixed, Multipole};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use super::Collection;
use super::atmosphere::{self, AtmosphereFile};
use super::named::{Constants, NamedFile};
use crate::{SceneError, Units, check};

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct CentralFile {
    /// A body of the solar system, whose constants are the defaults of the other keys.
    body: Option<NamedFile>,
    /// Gravitational parameter.
    gm: Option<f64>,
    /// Oblateness; 0 by default, or that of `body`.
    j2: Option<f64>,
    /// Radius that `j2` refers to.
    reference_radius: Option<f64>,
    /// Axis of the attractor, inertial frame, of any length; [0, 0, 1] by default, or that of `body` at J2000 in the ICRF.
    pole: Option<[f64; 3]>,
    /// Position of the center, inertial frame.
    #[serde(default)]
    position: [f64; 3],
    /// Radius of a sphere that no body may enter; 0 (none) by default, or the mean radius of `body`.
    radius: Option<f64>,
    /// The atmosphere, in which bodies with `drag` slow down.
    atmosphere: Option<AtmosphereFile>,
}

/// A fixed attractor.
#[derive(Clone, Debug, PartialEq)]
pub struct CentralAttractor {
    /// Name, if it is a body of the solar system.
    pub name: Option<&'static str>,
    /// Gravitational parameter `GM`.
    pub gm: f64,
    /// Position of the center, inertial frame.
    pub position: Vector3<f64>,
    /// Radius that no body may enter, or 0 for no limit.
    pub radius: f64,
    /// Deviation of the field from spherical symmetry.
    pub oblateness: Option<Oblateness>,
    /// The atmosphere.
    pub atmosphere: Option<Arc<Atmosphere>>,
    source: Source,
}

/// The attractor's field. A point mass at the origin needs no frame of its own.
#[derive(Clone, Debug, PartialEq)]
enum Source {
    Point(Central),
    Placed(Fixed<Central>),
    Oblate(Fixed<Multipole>),
}

/// The zonal harmonic of degree 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oblateness {
    /// `J₂`.
    pub j2: f64,
    /// The reference radius of `J₂`.
    pub reference_radius: f64,
    /// Direction of the pole, inertial frame, a unit vector.
    pub pole: Vector3<f64>,
}

impl CentralAttractor {
    /// Creates the attractor from the scene file. The keys of the file override the constants of its body.
    pub(super) fn parse(file: &CentralFile, units: &Units) -> Result<Self, SceneError> {
        let known = file.body.map(|body| body.constants(units));
        let gm = match (file.gm, &known) {
            (Some(gm), _) => check::positive("gravity.central.gm", gm)?,
            (None, Some(known)) => known.gm,
            (None, None) => {
                let expected = "a number > 0, or the name of a `body`";
                return Err(SceneError::missing("gravity.central.gm", expected));
            }
        };
        let position = check::vector("gravity.central.position", file.position)?;
        let radius = file.radius.or(known.map(|known| known.radius));
        let radius = radius.unwrap_or(0.0);
        let oblateness = oblateness(file, known.as_ref())?;
        let attractor = Self::new(gm, position, radius, oblateness).map_err(|_| {
            SceneError::value("gravity.central.radius", radius, "a finite number ≥ 0")
        })?;
        let atmosphere = (file.atmosphere.as_ref())
            .map(|file| {
                let pole = oblateness.map_or(Vector3::z(), |oblateness| oblateness.pole);
                atmosphere::parse(file, position, pole, radius, units)
            })
            .transpose()?;
        Ok(Self {
            name: known.map(|known| known.name),
            atmosphere: atmosphere.map(Arc::new),
            ..attractor
        })
    }

    /// Creates an attractor at `position`. Returns an error if the radius is invalid.
    fn new(
        gm: f64,
        position: Vector3<f64>,
        radius: f64,
        oblateness: Option<Oblateness>,
    ) -> Result<Self, BodyError> {
        let point = Central { gm };
        let source = match oblateness {
            None if position == Vector3::zeros() && radius == 0.0 => Source::Point(point),
            None => {
                let placed = Fixed::new(point, position, Matrix3::identity());
                Source::Placed(placed.with_radius(radius)?)
            }
            Some(Oblateness {
                j2,
                reference_radius,
                pole,
            }) => {
                let planet = Multipole::oblate(gm, j2, reference_radius);
                let placed = Fixed::new(planet, position, upright(&pole));
                Source::Oblate(placed.with_radius(radius)?)
            }
        };
        Ok(Self {
            name: None,
            gm,
            position,
            radius,
            oblateness,
            atmosphere: None,
            source,
        })
    }

    pub(super) fn add_to(&self, all: &mut impl Collection) {
        match &self.source {
            Source::Point(source) => all.add(*source),
            Source::Placed(source) => all.add(*source),
            Source::Oblate(source) => all.add(source.clone()),
        }
    }
}

fn oblateness(
    file: &CentralFile,
    known: Option<&Constants>,
) -> Result<Option<Oblateness>, SceneError> {
    let CentralFile {
        j2,
        reference_radius,
        pole,
        ..
    } = *file;
    // An oblateness of 0 makes the attractor a sphere.
    let known = known.filter(|_| j2 != Some(0.0));
    let Some(j2) = j2.or(known.map(|known| known.j2)) else {
        let unused = [
            ("reference_radius", reference_radius.is_some()),
            ("pole", pole.is_some()),
        ];
        return match unused.into_iter().find(|(_, given)| *given) {
            Some((key, _)) => Err(SceneError::missing(
                "gravity.central.j2",
                format!("a number, as there is a `{key}`"),
            )),
            None => Ok(None),
        };
    };
    let radius = match (reference_radius, known) {
        (Some(radius), _) => radius,
        (None, Some(known)) => known.reference_radius,
        (None, None) if file.body.is_some() => return Ok(None),
        (None, None) => {
            let expected = "the radius that belongs to `j2`";
            return Err(SceneError::missing(
                "gravity.central.reference_radius",
                expected,
            ));
        }
    };
    let pole = pole.unwrap_or_else(|| known.map_or([0.0, 0.0, 1.0], |known| known.pole.into()));
    let length = check::vector("gravity.central.pole", pole)?.norm();
    if !length.is_normal() {
        let expected = "the direction of the pole, of any length > 0";
        return Err(SceneError::value("gravity.central.pole", pole, expected));
    }
    if !j2.is_finite() {
        return Err(SceneError::value(
            "gravity.central.j2",
            j2,
            "a finite number",
        ));
    }
    Ok(Some(Oblateness {
        j2,
        reference_radius: check::positive("gravity.central.reference_radius", radius)?,
        pole: Vector3::from(pole) / length,
    }))
}

/// Returns the smallest rotation that takes the third axis to the line through `pole`. Both directions of the pole are
/// equivalent for an oblate planet.
fn upright(pole: &Vector3<f64>) -> Matrix3<f64> {
    let up = if pole.z < 0.0 { -pole } else { *pole };
    let s = lgvi_lie::hat(&Vector3::z().cross(&up));
    Matrix3::identity() + s + s * s / (1.0 + up.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pole_is_put_upright_by_a_rotation() {
        for pole in [
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
            [1.0, 0.0, 0.0],
            [0.3, -0.8, -0.2],
        ] {
            let pole = Vector3::from(pole).normalize();
            let r = upright(&pole);
            assert!(lgvi_lie::orthogonality_error(&r) < 1e-15);
            assert!(r.determinant() > 0.0);
            assert!(r.column(2).cross(&pole).norm() < 1e-15);
        }
    }
}
