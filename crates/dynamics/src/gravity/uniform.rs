use nalgebra::{Matrix3, Vector3};

use super::{Attractor, Falloff, Form, Monopole};

/// A uniform field, `φ = −g·d`, for example the gravity of the 3D pendulum and the heavy top.
///
/// # Assumptions and limitations
/// The field is constant: the extent of the motion is small compared with the distance from the center of the
/// attractor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uniform {
    /// Free-fall acceleration `g`.
    pub acceleration: Vector3<f64>,
}

impl Attractor for Uniform {
    fn form(&self) -> Option<Form> {
        Some(Form::Uniform {
            acceleration: self.acceleration,
        })
    }

    fn potential(&self, d: &Vector3<f64>) -> f64 {
        -self.acceleration.dot(d)
    }

    fn acceleration(&self, _d: &Vector3<f64>) -> Vector3<f64> {
        self.acceleration
    }

    fn gradient(&self, _d: &Vector3<f64>) -> Matrix3<f64> {
        Matrix3::zeros()
    }

    fn curvature(&self, _d: &Vector3<f64>, _b: &Vector3<f64>) -> Matrix3<f64> {
        Matrix3::zeros()
    }

    fn monopole(&self) -> Option<Monopole> {
        None
    }
    fn falloff(&self) -> Option<Falloff> {
        Some(Falloff {
            strength: 0.0,
            harmonic: 0.0,
        })
    }
}
