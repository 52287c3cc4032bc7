//! Gravity of a scene: the fields that act on all bodies in flight, and on one body in the planner.

mod atmosphere;
mod central;
mod named;

pub(crate) use atmosphere::DragFile;
pub use central::{CentralAttractor, Oblateness};

use std::sync::Arc;

use lgvi_dynamics::drag::Atmosphere;
use lgvi_dynamics::gravity::{Field, Gravity, Mutual, Sources, Uniform};
use nalgebra::Vector3;
use serde::Deserialize;

use crate::{NamedBody, SceneError, Units, check};
use central::CentralFile;

/// Gravity of a scene, in its units. Each contribution is optional.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneGravity {
    /// The fixed attractor.
    pub central: Option<CentralAttractor>,
    /// Acceleration of a uniform field, inertial frame.
    pub uniform: Option<Vector3<f64>>,
    /// Gravitational constant of the bodies' mutual attraction.
    pub mutual: Option<f64>,
}

#[derive(Default, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct GravityFile {
    /// A fixed attractor.
    central: Option<CentralFile>,
    /// A uniform field.
    uniform: Option<UniformFile>,
    /// Mutual attraction of the bodies.
    mutual: Option<MutualFile>,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct UniformFile {
    /// Acceleration, inertial frame.
    acceleration: [f64; 3],
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct MutualFile {
    /// Gravitational constant, in the units of the scene.
    constant: f64,
}

/// A collection of sources of any type.
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
    /// Creates the gravity from the scene file.
    pub(crate) fn parse(file: &GravityFile, units: &Units) -> Result<Self, SceneError> {
        let (central, uniform, mutual) = (&file.central, &file.uniform, &file.mutual);
        Ok(Self {
            central: central
                .as_ref()
                .map(|file| CentralAttractor::parse(file, units))
                .transpose()?,
            uniform: uniform
                .as_ref()
                .map(|file| check::vector("gravity.uniform.acceleration", file.acceleration))
                .transpose()?,
            mutual: mutual
                .as_ref()
                .map(|file| check::positive("gravity.mutual.constant", file.constant))
                .transpose()?,
        })
    }

    /// The atmosphere of the fixed attractor.
    pub(crate) fn atmosphere(&self) -> Option<&Arc<Atmosphere>> {
        self.central.as_ref()?.atmosphere.as_ref()
    }

    /// Returns true if no gravity acts.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the gravity that acts on all bodies.
    pub fn of_system(&self) -> Vec<Box<dyn Gravity>> {
        let mut all: Vec<Box<dyn Gravity>> = Vec::new();
        self.add_fixed(&mut all);
        if let Some(constant) = self.mutual {
            all.push(Box::new(Mutual::new(constant)));
        }
        all
    }

    /// Returns the field that acts on the body with this index among `bodies`, with the other bodies held in place.
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
