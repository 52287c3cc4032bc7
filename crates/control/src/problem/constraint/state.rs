use lgvi_dynamics::BodyState;
use nalgebra::{Matrix3, Vector3};

use crate::problem::pointing::Pointing;

/// An inequality on the state at the end of a step.
#[derive(Clone, Debug)]
pub(crate) struct StateInequality {
    /// Which constraint it belongs to, from 0.
    pub(crate) constraint: usize,
    pub(super) kind: Kind,
    /// By how much it may be violated.
    pub(super) slack: f64,
}

/// What an inequality sees of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// `x`, with derivatives by δx.
    Position,
    /// `R`, with derivatives by ζ.
    Attitude,
}

#[derive(Clone, Debug)]
pub(super) enum Kind {
    /// `(d · R a − cos α)/sin α`
    Cone {
        axis: Vector3<f64>,
        direction: Vector3<f64>,
        cosine: f64,
        sine: f64,
    },
    /// `½ (1 − |x − c|²/r²)`
    Sphere { center: Vector3<f64>, radius: f64 },
    /// `(cos α (r − ε) − n · ρ)/L` with `ρ = x − apex`, `r = √(|ρ|² + ε²)`: convex, and smooth at the apex.
    Corridor {
        apex: Vector3<f64>,
        axis: Vector3<f64>,
        cosine: f64,
        length: f64,
    },
}

/// `ε/L` by which a corridor's apex is rounded off.
const ROUNDING: f64 = 1e-12;
/// The least distance from an apex that counts, in parts of `L`.
const NEAREST: f64 = 1e-4;

impl StateInequality {
    /// The same with `slack` of room, `g ≤ slack`.
    pub(super) fn relaxed(&self, slack: f64) -> Self {
        Self {
            slack: self.slack + slack,
            ..self.clone()
        }
    }

    /// What it sees.
    pub(crate) fn place(&self) -> Place {
        match self.kind {
            Kind::Cone { .. } => Place::Attitude,
            Kind::Sphere { .. } | Kind::Corridor { .. } => Place::Position,
        }
    }

    /// What to multiply `g` by near `state`, so that it keeps its meaning there: a corridor's is relative to the distance
    /// from the apex.
    pub(crate) fn scale(&self, state: &BodyState) -> f64 {
        match &self.kind {
            Kind::Corridor { apex, length, .. } => {
                1.0 / ((state.position - apex).norm() / length).clamp(NEAREST, 1.0)
            }
            Kind::Cone { .. } | Kind::Sphere { .. } => 1.0,
        }
    }

    /// The displacement (rad of the attitude) that changes `g` by 1, to first order at the boundary.
    pub(crate) fn size(&self) -> f64 {
        match self.kind {
            Kind::Cone { .. } => 1.0,
            Kind::Sphere { radius, .. } => radius,
            Kind::Corridor { length, .. } => length,
        }
    }

    /// `g(s)`, less the slack.
    pub(crate) fn value(&self, state: &BodyState) -> f64 {
        let value = match &self.kind {
            Kind::Cone {
                axis,
                direction,
                cosine,
                sine,
            } => ((state.attitude * axis).dot(direction) - cosine) / sine,
            Kind::Sphere { center, radius } => {
                0.5 * (1.0 - ((state.position - center) / *radius).norm_squared())
            }
            Kind::Corridor {
                apex,
                axis,
                cosine,
                length,
            } => {
                let rho = (state.position - apex) / *length;
                let r = (rho.norm_squared() + ROUNDING * ROUNDING).sqrt();
                cosine * (r - ROUNDING) - axis.dot(&rho)
            }
        };
        value - self.slack
    }

    /// How far inside what is kept out of, or outside what is kept in, a state is where the inequality has the value `g`: in
    /// radians of a cone, in parts of a sphere's radius or a corridor's length.
    pub(crate) fn excess(&self, g: f64) -> f64 {
        let value = g + self.slack;
        match self.kind {
            Kind::Cone { cosine, sine, .. } => {
                libm::atan2(sine, cosine) - libm::acos((cosine + sine * value).clamp(-1.0, 1.0))
            }
            Kind::Sphere { .. } => 1.0 - (1.0 - 2.0 * value).max(0.0).sqrt(),
            Kind::Corridor { .. } => value,
        }
    }

    /// Gradient and Hessian of `g` by [`StateInequality::place`], the Hessian symmetric and along `Steps::moved`.
    pub(crate) fn derivatives(&self, state: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        match &self.kind {
            Kind::Cone {
                axis,
                direction,
                sine,
                ..
            } => {
                let pointing = Pointing::new(&state.attitude, axis, direction);
                (pointing.gradient / *sine, pointing.hessian / *sine)
            }
            Kind::Sphere { center, radius } => {
                let scale = -1.0 / (radius * radius);
                (
                    scale * (state.position - center),
                    Matrix3::from_diagonal_element(scale),
                )
            }
            Kind::Corridor {
                apex,
                axis,
                cosine,
                length,
            } => {
                let rho = (state.position - apex) / *length;
                let r = (rho.norm_squared() + ROUNDING * ROUNDING).sqrt();
                let unit = rho / r;
                let across = Matrix3::identity() - unit * unit.transpose();
                (
                    (*cosine * unit - axis) / *length,
                    across * (cosine / (r * length * length)),
                )
            }
        }
    }
}
