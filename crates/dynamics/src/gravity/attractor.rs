use nalgebra::{Matrix3, Vector3};

use super::{Falloff, Form};

/// A source of gravity that acts on points: a scalar potential `φ` per unit mass, in the attractor's own frame.
///
/// `d` is the position of the point in that frame. Every model implements only this. Its action on a rigid body and the
/// recoil of a body that is itself an attractor are derived elsewhere by the chain rule.
pub trait Attractor: Send + Sync {
    /// `φ(d)`, the potential energy of a point of unit mass.
    fn potential(&self, d: &Vector3<f64>) -> f64;

    /// `a(d) = −∇φ`.
    fn acceleration(&self, d: &Vector3<f64>) -> Vector3<f64>;

    /// `G(d) = ∂a/∂d`, symmetric.
    fn gradient(&self, d: &Vector3<f64>) -> Matrix3<f64>;

    /// `T(d) = ∂(G b)/∂d` at fixed `b`, symmetric.
    fn curvature(&self, d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64>;

    /// The attractor as a monopole at large distance, or `None` if it has no position, such as a uniform field.
    fn monopole(&self) -> Option<Monopole>;

    /// The falloff with distance from the attractor's position, or `None` if it is not known.
    fn falloff(&self) -> Option<Falloff> {
        None
    }

    /// The parameters of the model, or `None` if it has no such form.
    fn form(&self) -> Option<Form> {
        None
    }

    /// Approximate cost of an acceleration, in multiples of that of a point mass.
    fn cost(&self) -> f64 {
        1.0
    }
}

/// The position and strength of an attractor, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monopole {
    /// Gravitational parameter `GM`.
    pub gm: f64,
    /// Center of mass.
    pub position: Vector3<f64>,
    /// Radius of the sphere about the center of mass that the spheres of bodies must not enter, or 0 if it has none.
    pub radius: f64,
}
