//! What acts on the bodies of a scene: on all of them as they fly, and on one of them as the planner sees it.

use lgvi_dynamics::BodyError;
use lgvi_dynamics::gravity::{Central, Field, Fixed, Gravity, Multipole, Mutual, Sources, Uniform};
use nalgebra::{Matrix3, Vector3};

use crate::NamedBody;

/// Gravity of a scene, in its units; each kind is there or not.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneGravity {
    /// An attractor that does not move.
    pub central: Option<CentralAttractor>,
    /// Acceleration of a field that is the same everywhere, inertial frame.
    pub uniform: Option<Vector3<f64>>,
    /// Gravitational constant of the bodies' attraction on each other.
    pub mutual: Option<f64>,
}

/// An attractor that does not move.
#[derive(Clone, Debug, PartialEq)]
pub struct CentralAttractor {
    /// Gravitational parameter `GM`.
    pub gm: f64,
    /// Its centre, inertial frame.
    pub position: Vector3<f64>,
    /// Radius that no body may enter, 0 for none.
    pub radius: f64,
    /// By what it differs from a sphere.
    pub oblateness: Option<Oblateness>,
    source: Source,
}

/// An attractor as it acts; one that needs no frame of its own has none.
#[derive(Clone, Debug, PartialEq)]
enum Source {
    Point(Central),
    Placed(Fixed<Central>),
    Oblate(Fixed<Multipole>),
}

/// The zonal harmonic of second degree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oblateness {
    /// `J₂`.
    pub j2: f64,
    /// The radius that belongs to it.
    pub reference_radius: f64,
    /// Direction of the pole, inertial frame, a unit vector.
    pub pole: Vector3<f64>,
}

/// Takes sources of whatever type.
trait Collection {
    fn add(&mut self, source: impl Field + 'static);
}

impl Collection for Vec<Box<dyn Gravity>> {
    fn add(&mut self, source: impl Field + 'static) {
        self.push(Box::new(source));
    }
}

impl Collection for Vec<Box<dyn Field>> {
    fn add(&mut self, source: impl Field + 'static) {
        self.push(Box::new(source));
    }
}

impl SceneGravity {
    /// Whether nothing acts.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// What acts on all bodies.
    pub fn of_system(&self) -> Vec<Box<dyn Gravity>> {
        let mut all: Vec<Box<dyn Gravity>> = Vec::new();
        self.add_fixed(&mut all);
        if let Some(constant) = self.mutual {
            all.push(Box::new(Mutual::new(constant)));
        }
        all
    }

    /// What acts on the body with this index among `bodies`, the others being held.
    pub(crate) fn on_body(&self, index: usize, bodies: &[NamedBody]) -> Sources {
        let mut all: Vec<Box<dyn Field>> = Vec::new();
        self.add_fixed(&mut all);
        if let Some(constant) = self.mutual {
            let others = bodies.iter().enumerate().filter(|(i, _)| *i != index);
            let (others, states): (Vec<_>, Vec<_>) = others
                .map(|(_, other)| (other.body.clone(), other.state))
                .unzip();
            all.add(Sources::of_bodies(constant, &others, &states));
        }
        Sources::new(all)
    }

    fn add_fixed(&self, all: &mut impl Collection) {
        if let Some(central) = &self.central {
            central.add_to(all);
        }
        if let Some(acceleration) = self.uniform {
            all.add(Uniform { acceleration });
        }
    }
}

impl CentralAttractor {
    /// An attractor at `position`; an error where the radius is none.
    pub(crate) fn new(
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
            gm,
            position,
            radius,
            oblateness,
            source,
        })
    }

    fn add_to(&self, all: &mut impl Collection) {
        match &self.source {
            Source::Point(source) => all.add(*source),
            Source::Placed(source) => all.add(*source),
            Source::Oblate(source) => all.add(source.clone()),
        }
    }
}

/// The least rotation that turns the third axis to the line through `pole`, whose two directions are the same to an
/// oblate planet.
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
