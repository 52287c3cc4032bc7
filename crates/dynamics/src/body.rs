use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

use crate::drag::Drag;
use crate::gravity::{Multipole, Polyhedron, PolyhedronError, PolyhedronMass};
use crate::thrusters::Thrusters;
use crate::wheels::Wheels;
use crate::{Inertia, InertiaError, Mobility};

/// A point mass fixed in a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointMass {
    /// Mass, > 0.
    pub mass: f64,
    /// Position `ρ` from the center of mass, body frame.
    pub position: Vector3<f64>,
}

/// The mass distribution of a body, which determines its attraction and the gravity acting on it.
#[derive(Clone, Debug, PartialEq)]
pub enum MassDistribution {
    /// Point masses, at least one. A single one at the center of mass represents a sphere.
    Points(Vec<PointMass>),
    /// The multipole expansion of its potential, whose strength is the mass.
    Multipole(Multipole),
    /// A homogeneous polyhedron.
    Polyhedron(Arc<PolyhedronMass>),
}

/// A rigid body: its mass, inertia, mass distribution, radius and mobility.
#[derive(Clone, Debug, PartialEq)]
pub struct RigidBody {
    pub(crate) mass: f64,
    pub(crate) inertia: Inertia,
    pub(crate) distribution: MassDistribution,
    radius: f64,
    pub(crate) mobility: Mobility,
    wheels: Option<Box<Wheels>>,
    pub(crate) thrusters: Option<Box<Thrusters>>,
    pub(crate) drag: Option<Box<Drag>>,
}

/// Reasons why a mass and its distribution do not describe a rigid body.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BodyError {
    /// The mass is not a positive number.
    #[error("mass is {0}, expected a finite number > 0")]
    Mass(f64),
    /// The radius is negative or not a number.
    #[error("radius is {0}, expected a finite number ≥ 0")]
    Radius(f64),
    /// A point's mass is not a positive number.
    #[error("point {index} has mass {mass}, expected a finite number > 0")]
    PointMass {
        /// Index of the point, from 1.
        index: usize,
        /// Mass of the point.
        mass: f64,
    },
    /// A point's position is NaN or infinite.
    #[error("point {index} is at {position:?}, expected finite numbers")]
    PointPosition {
        /// Index of the point, from 1.
        index: usize,
        /// Position of the point.
        position: [f64; 3],
    },
    /// The points do not add up to the body's mass.
    #[error("the points' masses sum to {sum}, expected the body's mass {mass}")]
    TotalMass {
        /// Sum over the points.
        sum: f64,
        /// The body's mass.
        mass: f64,
    },
    /// The points' center of mass is not the body's.
    #[error("the points' center of mass is {0:?}, expected the origin of the body frame")]
    CenterOfMass([f64; 3]),
    /// A moment of the mass is NaN or infinite.
    #[error("the moments of the mass are not all finite")]
    Moments,
    /// A polyhedron's cloud lacks the second moments, which determine the gravitational torque.
    #[error("a cloud of degree {0}, expected at least 2")]
    CloudDegree(usize),
    /// The mass of a polyhedron is fixed by its shape.
    #[error("a polyhedron is as heavy as its shape, expected points or a multipole")]
    Heavier,
    /// The propellant is not part of the body.
    #[error("the propellant's mass is {propellant}, expected less than that of the body, {mass}")]
    Propellant {
        /// The propellant's mass.
        propellant: f64,
        /// The body's mass.
        mass: f64,
    },
    /// The polyhedron's cloud could not be built.
    #[error(transparent)]
    Polyhedron(#[from] PolyhedronError),
    /// The polyhedron's inertia is not that of a rigid body.
    #[error(transparent)]
    Inertia(#[from] InertiaError),
}

/// Relative rounding error accepted in decimal input.
const ROUNDING: f64 = 1e-9;

impl RigidBody {
    /// Creates a body on which gravity acts at the given points. Their masses must sum to `mass`, and their center of
    /// mass must be the origin of the body frame. Without points, gravity acts at the center of mass and exerts no
    /// moment.
    ///
    /// `inertia` is independent of the points, which need not reproduce it. For example, a dumbbell of two spheres
    /// attracts as two points, but its inertia includes that of the spheres.
    pub fn new(mass: f64, inertia: Inertia, points: Vec<PointMass>) -> Result<Self, BodyError> {
        let body = Self::pivoted(mass, inertia, points)?;
        let mut first_moment = Vector3::zeros();
        let mut reach = 0.0_f64;
        for point in body.points() {
            first_moment += point.mass * point.position;
            reach = reach.max(point.position.norm());
        }
        if first_moment.norm() > ROUNDING * mass * reach {
            return Err(BodyError::CenterOfMass((first_moment / mass).into()));
        }
        Ok(Self {
            mobility: Mobility::Free,
            ..body
        })
    }

    /// Creates a body that rotates about the origin of its frame, which is held in place. `inertia` and `points` are
    /// relative to that pivot.
    pub fn pivoted(mass: f64, inertia: Inertia, points: Vec<PointMass>) -> Result<Self, BodyError> {
        let with = |points| Self {
            mass,
            inertia,
            distribution: MassDistribution::Points(points),
            radius: 0.0,
            mobility: Mobility::Pivoted,
            wheels: None,
            thrusters: None,
            drag: None,
        };
        if !(mass.is_finite() && mass > 0.0) {
            return Err(BodyError::Mass(mass));
        }
        if points.is_empty() {
            let center = PointMass {
                mass,
                position: Vector3::zeros(),
            };
            return Ok(with(vec![center]));
        }
        let mut sum = 0.0;
        for (index, point) in (1..).zip(&points) {
            if !(point.mass.is_finite() && point.mass > 0.0) {
                return Err(BodyError::PointMass {
                    index,
                    mass: point.mass,
                });
            }
            if !point.position.iter().all(|c| c.is_finite()) {
                return Err(BodyError::PointPosition {
                    index,
                    position: point.position.into(),
                });
            }
            sum += point.mass;
        }
        if (sum - mass).abs() > ROUNDING * mass {
            return Err(BodyError::TotalMass { sum, mass });
        }
        Ok(with(points))
    }

    /// Creates a body on which gravity acts through its multipole. The mass is the multipole's strength. `inertia` is
    /// independent of the multipole, as it is of points.
    pub fn with_multipole(inertia: Inertia, multipole: Multipole) -> Result<Self, BodyError> {
        let body = Self::new(multipole.strength(), inertia, vec![])?;
        if !multipole.is_finite() {
            return Err(BodyError::Moments);
        }
        Ok(Self {
            distribution: MassDistribution::Multipole(multipole),
            ..body
        })
    }

    /// Creates a body that is a homogeneous polyhedron about the origin of its frame ([`Polyhedron::recentered`]), with
    /// its mass.
    ///
    /// It attracts by its closed-form field. Other fields act on it through a sparse cloud of this `degree`, 2 to 10:
    /// degree 4 has 35 points, degree 8 has 165 (figures at [`Polyhedron::sparse_cloud`]). If `inertia` is `None`, the
    /// inertia of the shape is used. A given `inertia` is independent of the shape.
    pub fn with_polyhedron(
        inertia: Option<Inertia>,
        polyhedron: &Polyhedron,
        degree: usize,
    ) -> Result<Self, BodyError> {
        let center = polyhedron.center();
        if center.norm() > ROUNDING * polyhedron.bounding_radius() {
            return Err(BodyError::CenterOfMass(center.into()));
        }
        if degree < 2 {
            return Err(BodyError::CloudDegree(degree));
        }
        let inertia = inertia.map_or_else(|| polyhedron.inertia(), Ok)?;
        let mass = PolyhedronMass::new(polyhedron, degree)?;
        Ok(Self {
            distribution: MassDistribution::Polyhedron(Arc::new(mass)),
            ..Self::new(polyhedron.mass(), inertia, vec![])?
        })
    }

    /// Returns this body with its mass multiplied by `factor`. The inertia and the mass distribution scale along.
    ///
    /// # Errors
    /// Returns an error if the factor leaves no positive mass or no valid inertia, or if the body is a polyhedron.
    pub fn scaled(&self, factor: f64) -> Result<Self, BodyError> {
        let mass = self.mass * factor;
        if !(mass.is_finite() && mass > 0.0) {
            return Err(BodyError::Mass(mass));
        }
        Self {
            mass,
            inertia: Inertia::new(self.inertia.matrix() * factor)?,
            distribution: self.distribution.scaled(factor)?,
            ..self.clone()
        }
        .loaded()
    }

    /// Returns this body with another inertia. Gravity acts as before.
    ///
    /// # Errors
    /// Returns an error if the body has propellant, and what is left without it has no valid inertia.
    pub fn with_inertia(self, inertia: Inertia) -> Result<Self, BodyError> {
        Self { inertia, ..self }.loaded()
    }

    /// Returns this body, whose inertia is that with locked wheels, with reaction wheels that turn. The inertia of the rest
    /// takes the place of its inertia. The wheels' masses are part of the body.
    ///
    /// # Errors
    /// Returns an error if the inertia of the rest is not that of a rigid body.
    pub fn with_wheels(self, wheels: Wheels) -> Result<Self, BodyError> {
        let rest = self.inertia.matrix() - wheels.axial_inertia();
        Self {
            inertia: Inertia::new(rest)?,
            wheels: Some(Box::new(wheels)),
            ..self
        }
        .loaded()
    }

    /// Returns this body, which has all its propellant, with thrusters.
    ///
    /// # Errors
    /// Returns an error if the body without propellant has no positive mass or no valid inertia, or if the body has
    /// propellant and is a polyhedron.
    pub fn with_thrusters(self, thrusters: Thrusters) -> Result<Self, BodyError> {
        Self {
            thrusters: Some(Box::new(thrusters)),
            ..self
        }
        .loaded()
    }

    /// Makes the present properties those with all propellant.
    fn loaded(mut self) -> Result<Self, BodyError> {
        if let Some(thrusters) = &mut self.thrusters {
            thrusters.load(self.mass, &self.inertia, &self.distribution)?;
        }
        Ok(self)
    }

    /// Returns this body with another mobility.
    pub fn with_mobility(self, mobility: Mobility) -> Self {
        Self { mobility, ..self }
    }

    /// Returns this body with a radius that no other body may enter.
    pub fn with_radius(self, radius: f64) -> Result<Self, BodyError> {
        if radius.is_finite() && radius >= 0.0 {
            Ok(Self { radius, ..self })
        } else {
            Err(BodyError::Radius(radius))
        }
    }

    /// The body's mobility.
    pub fn mobility(&self) -> &Mobility {
        &self.mobility
    }

    /// Radius of the sphere about the body's origin that the spheres of other bodies must not enter, or 0 if it has
    /// none.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Mass `m`.
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// The mass on which gravity acts: the sum of the points, which may differ from the mass by rounding.
    pub(crate) fn attracted_mass(&self) -> f64 {
        match self.points() {
            [] => self.mass,
            points => points.iter().map(|point| point.mass).sum(),
        }
    }

    /// The mass distribution to second order, as a multipole.
    pub(crate) fn to_second_order(&self) -> Multipole {
        if let MassDistribution::Multipole(multipole) = &self.distribution {
            return multipole.clone();
        }
        let mut second = Matrix3::zeros();
        for PointMass { mass, position } in self.points() {
            second += *mass * position * position.transpose();
        }
        Multipole::of_second_moments(self.attracted_mass(), &second)
    }

    /// The reaction wheels, with their momenta.
    pub fn wheels(&self) -> Option<&Wheels> {
        self.wheels.as_deref()
    }

    /// The inertia with locked wheels, which without wheels is [`inertia`](Self::inertia).
    pub fn locked_inertia(&self) -> Inertia {
        let with =
            |wheels: &Wheels| Inertia::new(self.inertia.matrix() + wheels.axial_inertia()).ok();
        let locked = self.wheels().and_then(with);
        locked.unwrap_or_else(|| self.inertia.clone())
    }

    /// The reaction wheels, to set their states and commands.
    pub fn wheels_mut(&mut self) -> Option<&mut Wheels> {
        self.wheels.as_deref_mut()
    }

    /// The thrusters.
    pub fn thrusters(&self) -> Option<&Thrusters> {
        self.thrusters.as_deref()
    }

    /// The thrusters, to set their commands.
    pub fn thrusters_mut(&mut self) -> Option<&mut Thrusters> {
        self.thrusters.as_deref_mut()
    }

    /// Returns true if it has wheels or thrusters.
    pub fn has_actuators(&self) -> bool {
        self.wheels.is_some() || self.thrusters.is_some()
    }

    /// Returns this body with drag.
    pub fn with_drag(self, drag: Drag) -> Self {
        Self {
            drag: Some(Box::new(drag)),
            ..self
        }
    }

    /// The body's drag.
    pub fn drag(&self) -> Option<&Drag> {
        self.drag.as_deref()
    }

    /// Inertia `J` about the center of mass. Of a body with reaction wheels it is that without their inertia about their axes.
    pub fn inertia(&self) -> &Inertia {
        &self.inertia
    }

    /// The mass distribution on which gravity acts.
    pub fn distribution(&self) -> &MassDistribution {
        &self.distribution
    }

    /// The points on which gravity acts: the cloud of a polyhedron, or none for a multipole.
    pub fn points(&self) -> &[PointMass] {
        match &self.distribution {
            MassDistribution::Points(points) => points,
            MassDistribution::Multipole(_) => &[],
            MassDistribution::Polyhedron(mass) => mass.cloud(),
        }
    }
}

impl MassDistribution {
    /// This distribution with its mass multiplied by `factor`.
    pub(crate) fn scaled(&self, factor: f64) -> Result<Self, BodyError> {
        Ok(match self {
            Self::Points(points) => {
                let scaled = points.iter().map(|point| PointMass {
                    mass: point.mass * factor,
                    ..*point
                });
                Self::Points(scaled.collect())
            }
            Self::Multipole(multipole) => Self::Multipole(multipole.scaled(factor)),
            Self::Polyhedron(_) => return Err(BodyError::Heavier),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dumbbell(masses: [f64; 2], ends: [f64; 2]) -> Result<RigidBody, BodyError> {
        let points = masses
            .iter()
            .zip(ends)
            .map(|(&mass, x)| PointMass {
                mass,
                position: Vector3::new(x, 0.0, 0.0),
            })
            .collect();
        RigidBody::new(1.0, Inertia::principal([1.0; 3]).unwrap(), points)
    }

    #[test]
    fn points_must_add_up_to_the_body() {
        assert!(dumbbell([0.5, 0.5], [0.1, -0.1]).is_ok());
        assert_eq!(
            dumbbell([0.5, 0.25], [0.1, -0.2]),
            Err(BodyError::TotalMass {
                sum: 0.75,
                mass: 1.0
            })
        );
        assert!(matches!(
            dumbbell([0.5, 0.5], [0.1, -0.2]),
            Err(BodyError::CenterOfMass(_))
        ));
        assert_eq!(
            dumbbell([1.5, -0.5], [0.1, -0.1]),
            Err(BodyError::PointMass {
                index: 2,
                mass: -0.5
            })
        );
        assert!(matches!(
            dumbbell([0.5, 0.5], [f64::INFINITY, -0.1]),
            Err(BodyError::PointPosition { index: 1, .. })
        ));
    }

    #[test]
    fn a_multipole_must_be_a_mass() {
        let inertia = || Inertia::principal([1.0, 1.2, 1.5]).unwrap();
        let with = |multipole| RigidBody::with_multipole(inertia(), multipole);
        let body = with(Multipole::of_inertia(2.0, &inertia())).unwrap();
        assert_eq!(body.mass(), 2.0);
        assert!(body.points().is_empty());
        let massless = Multipole::of_inertia(0.0, &inertia());
        assert_eq!(with(massless), Err(BodyError::Mass(0.0)));
        let endless = Multipole::oblate(1.0, f64::INFINITY, 1.0);
        assert_eq!(with(endless), Err(BodyError::Moments));
    }

    #[test]
    fn a_polyhedron_must_be_about_its_center_of_mass() {
        let rock = Polyhedron::ellipsoid([1.0, 0.8, 0.6], 1, 2.0).unwrap();
        let body = RigidBody::with_polyhedron(None, &rock, 4).unwrap();
        assert_eq!(body.mass(), rock.mass());
        assert_eq!(*body.inertia(), rock.inertia().unwrap());
        assert_eq!(body.points().len(), 35);
        let given = Inertia::principal([1.0; 3]).unwrap();
        let other = RigidBody::with_polyhedron(Some(given.clone()), &rock, 2).unwrap();
        assert_eq!(*other.inertia(), given);

        let shift = Vector3::new(1e-3, 0.0, 0.0);
        let vertices = rock.vertices().iter().map(|v| v + shift).collect();
        let shifted = Polyhedron::new(vertices, rock.faces().to_vec(), 2.0).unwrap();
        assert!(matches!(
            RigidBody::with_polyhedron(None, &shifted, 4),
            Err(BodyError::CenterOfMass([x, _, _])) if (x - 1e-3).abs() < 1e-12
        ));
        assert!(RigidBody::with_polyhedron(None, &shifted.recentered(), 4).is_ok());
        let of_degree = |degree| RigidBody::with_polyhedron(None, &rock, degree);
        assert_eq!(of_degree(1), Err(BodyError::CloudDegree(1)));
        let refusal = PolyhedronError::Degree {
            found: 11,
            limit: 10,
        };
        assert_eq!(of_degree(11), Err(BodyError::Polyhedron(refusal)));
    }
}
