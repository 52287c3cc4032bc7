use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::{Central, Field, Fixed, Intrusion, LoadCurvature, LoadGradient};
use crate::{BodyState, Load, MassDistribution, PointMass, RigidBody};

/// The combined field of several fixed sources.
#[derive(Clone, Default)]
pub struct Sources {
    fields: Arc<[Box<dyn Field>]>,
}

impl Sources {
    /// The sum of `fields`.
    pub fn new(fields: Vec<Box<dyn Field>>) -> Self {
        Self {
            fields: fields.into(),
        }
    }

    /// The gravity of bodies held in their states, as by [`Mutual`](super::Mutual) with gravitational constant `G`, but
    /// differentiable.
    ///
    /// # Assumptions and limitations
    /// The quadrupole–quadrupole interaction is omitted between two multipoles of fourth order, and between a held
    /// polyhedron and a multipole. The sources act on a polyhedron through its cloud, even where
    /// [`Mutual`](super::Mutual) uses the polyhedron's field; the results differ by the error of the cloud. Clearance
    /// is not checked for a held body of several points. For a held polyhedron it is checked against the radius
    /// assigned to the body.
    pub fn of_bodies(constant: f64, bodies: &[RigidBody], states: &[BodyState]) -> Self {
        let mut fields: Vec<Box<dyn Field>> = Vec::new();
        for (body, state) in bodies.iter().zip(states) {
            let (x, r) = (state.position, state.attitude);
            match body.distribution() {
                MassDistribution::Points(points) => {
                    let radius = if points.len() == 1 {
                        body.radius()
                    } else {
                        0.0
                    };
                    for PointMass { mass, position } in points {
                        let central = Central {
                            gm: constant * mass,
                        };
                        let place = x + r * position;
                        let source = Fixed::new(central, place, Matrix3::identity());
                        fields.push(Box::new(source.within(radius)));
                    }
                }
                MassDistribution::Polyhedron(mass) => {
                    let source = Fixed::new(mass.field().scaled(constant), x, r);
                    fields.push(Box::new(source.within(body.radius())));
                }
                MassDistribution::Multipole(multipole) => {
                    let source = Fixed::new(multipole.scaled(constant), x, r);
                    fields.push(Box::new(source.within(body.radius())));
                }
            }
        }
        Self::new(fields)
    }
}

impl Field for Sources {
    fn cost(&self, body: &RigidBody) -> f64 {
        self.fields.iter().map(|field| field.cost(body)).sum()
    }

    fn load(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> Load {
        let mut sum = Load::default();
        for field in self.fields.iter() {
            sum += field.load(body, x, r);
        }
        sum
    }

    fn potential(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> f64 {
        let fields = self.fields.iter();
        fields.map(|field| field.potential(body, x, r)).sum()
    }

    fn gradient(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> LoadGradient {
        let mut sum = LoadGradient::default();
        for field in self.fields.iter() {
            sum += field.gradient(body, x, r);
        }
        sum
    }

    fn curvature(
        &self,
        body: &RigidBody,
        x: &Vector3<f64>,
        r: &Matrix3<f64>,
        weights: &Load,
    ) -> LoadCurvature {
        let mut sum = LoadCurvature::default();
        for field in self.fields.iter() {
            sum += field.curvature(body, x, r, weights);
        }
        sum
    }

    fn check_clearance(&self, body: &RigidBody, x: &Vector3<f64>) -> Result<(), Intrusion> {
        let mut fields = self.fields.iter();
        fields.try_for_each(|field| field.check_clearance(body, x))
    }
}
