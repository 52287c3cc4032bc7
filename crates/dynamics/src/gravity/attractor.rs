use nalgebra::{Matrix3, Vector3};

use super::{Falloff, Form};

/// What attracts points: a scalar potential `φ` per unit mass, in the attractor's own frame.
///
/// `d` is the point's place in that frame. Every model is written once, here; how it acts on a rigid body, and how a
/// body that is itself an attractor recoils, follows by the chain rule elsewhere.
pub trait Attractor: Send + Sync {
    /// `φ(d)`, a point of unit mass has this potential energy.
    fn potential(&self, d: &Vector3<f64>) -> f64;

    /// `a(d) = −∇φ`.
    fn acceleration(&self, d: &Vector3<f64>) -> Vector3<f64>;

    /// `G(d) = ∂a/∂d`, symmetric.
    fn gradient(&self, d: &Vector3<f64>) -> Matrix3<f64>;

    /// `T(d) = ∂(G b)/∂d` at fixed `b`, symmetric.
    fn curvature(&self, d: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64>;

    /// What it is from afar; none where it has no place, as a uniform field.
    fn monopole(&self) -> Option<Monopole>;

    /// How it falls off with the distance from its place; none where that is not known.
    fn falloff(&self) -> Option<Falloff> {
        None
    }

    /// What it is in numbers; none where it has no such form.
    fn form(&self) -> Option<Form> {
        None
    }

    /// What an acceleration costs, in multiples of a point mass's, roughly.
    fn cost(&self) -> f64 {
        1.0
    }
}

/// The place and the strength of an attractor, in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monopole {
    /// Gravitational parameter `GM`.
    pub gm: f64,
    /// Center of mass.
    pub position: Vector3<f64>,
    /// Radius of the sphere about it that no body's may enter; 0 when it has none.
    pub radius: f64,
}
