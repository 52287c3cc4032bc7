use nalgebra::{Matrix3, Vector3};

use super::{Attractor, Falloff, Form, Monopole, Placement};
use crate::BodyError;

/// An attractor `A` held at a position and attitude in the inertial frame. It is itself an attractor in that frame.
///
/// # Assumptions and limitations
/// The attractor does not move or rotate, regardless of the bodies' masses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fixed<A> {
    attractor: A,
    position: Vector3<f64>,
    attitude: Matrix3<f64>,
    radius: f64,
}

impl<A: Attractor> Fixed<A> {
    /// Places the attractor with the origin of its frame at `position`. `attitude` maps from its frame to the inertial
    /// one.
    pub fn new(attractor: A, position: Vector3<f64>, attitude: Matrix3<f64>) -> Self {
        Self {
            attractor,
            position,
            attitude,
            radius: 0.0,
        }
    }

    /// Adds a radius about its center of mass that the spheres of bodies must not enter.
    pub fn with_radius(self, radius: f64) -> Result<Self, BodyError> {
        if radius.is_finite() && radius >= 0.0 {
            Ok(self.within(radius))
        } else {
            Err(BodyError::Radius(radius))
        }
    }

    /// Sets a radius that is already validated.
    pub(super) fn within(self, radius: f64) -> Self {
        Self { radius, ..self }
    }

    #[inline]
    fn seen(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.attitude.tr_mul(&(x - self.position))
    }

    #[inline]
    fn turned(&self, m: &Matrix3<f64>) -> Matrix3<f64> {
        self.attitude * m * self.attitude.transpose()
    }
}

impl<A: Attractor> Attractor for Fixed<A> {
    fn form(&self) -> Option<Form> {
        match self.attractor.form()? {
            Form::Attractor {
                shape,
                placement: None,
            } => Some(Form::Attractor {
                shape,
                placement: Some(Placement {
                    position: self.position,
                    attitude: self.attitude,
                    radius: self.radius,
                }),
            }),
            _ => None,
        }
    }

    fn cost(&self) -> f64 {
        self.attractor.cost()
    }

    fn falloff(&self) -> Option<Falloff> {
        self.attractor.falloff()
    }

    #[inline]
    fn potential(&self, d: &Vector3<f64>) -> f64 {
        self.attractor.potential(&self.seen(d))
    }

    #[inline]
    fn acceleration(&self, d: &Vector3<f64>) -> Vector3<f64> {
        self.attitude * self.attractor.acceleration(&self.seen(d))
    }

    #[inline]
    fn gradient(&self, d: &Vector3<f64>) -> Matrix3<f64> {
        self.turned(&self.attractor.gradient(&self.seen(d)))
    }

    #[inline]
    fn curvature(&self, d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
        let b = self.attitude.tr_mul(b);
        self.turned(&self.attractor.curvature(&self.seen(d), &b))
    }

    fn monopole(&self) -> Option<Monopole> {
        self.attractor.monopole().map(|own| Monopole {
            gm: own.gm,
            position: self.position + self.attitude * own.position,
            radius: own.radius.max(self.radius),
        })
    }
}
