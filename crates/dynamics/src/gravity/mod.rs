//! Gravity: what acts on bodies, one model a file.
//!
//! A [`Gravity`] acts on all bodies of a system; a [`Field`] has fixed sources, acts on each body by itself, and is
//! differentiated twice for the planner.

mod attractor;
mod central;
mod mutual;
mod polyhedron;

use std::fmt;

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

pub use attractor::Attractor;
pub use central::Central;
pub use mutual::Mutual;
pub use polyhedron::{Moments, ObjError, Polyhedron, PolyhedronError, PolyhedronField};

use crate::{BodyState, Load, RigidBody};

/// Gravity on all bodies of a system.
pub trait Gravity: Send {
    /// Adds to `loads` (one a body) what gravity exerts in `states`.
    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]);

    /// The potential `U` in `states`.
    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64;

    /// Whether all bodies are outside each other's radii and those of the sources.
    fn check_clearance(
        &self,
        _bodies: &[RigidBody],
        _states: &[BodyState],
    ) -> Result<(), CloseApproach> {
        Ok(())
    }
}

/// A body is where another body or a source is.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub struct CloseApproach {
    /// Which body, from 0.
    pub body: usize,
    /// The other body, from 0; none for a fixed source.
    pub other: Option<usize>,
    /// Distance of their origins.
    pub distance: f64,
    /// Sum of their radii.
    pub limit: f64,
}

impl fmt::Display for CloseApproach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            body,
            distance,
            limit,
            ..
        } = self;
        match self.other {
            Some(other) => write!(f, "bodies {body} and {other}")?,
            None => write!(f, "body {body} and the attractor")?,
        }
        write!(
            f,
            " are {distance} apart, inside the sum {limit} of their radii"
        )
    }
}

/// Gravity of fixed sources on one body at `x` with attitude `R`.
///
/// Derivatives are in the variations `δx` (inertial frame) and `ζ`, `δR = R S(ζ)`.
pub trait Field: Send + Sync {
    /// Force and moment.
    fn load(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> Load;

    /// The potential `U`.
    fn potential(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> f64;

    /// First derivatives of force and moment.
    fn gradient(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> LoadGradient;

    /// Second derivatives of `b·force + c·moment` for fixed `weights` (b as their force, c as their moment).
    fn curvature(
        &self,
        body: &RigidBody,
        x: &Vector3<f64>,
        r: &Matrix3<f64>,
        weights: &Load,
    ) -> LoadCurvature;
}

/// First derivatives of a load: `δforce = F_x δx + F_R ζ`, `δmoment = M_x δx + M_R ζ`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadGradient {
    /// `F_x`.
    pub force_by_position: Matrix3<f64>,
    /// `F_R`.
    pub force_by_attitude: Matrix3<f64>,
    /// `M_x`.
    pub moment_by_position: Matrix3<f64>,
    /// `M_R`.
    pub moment_by_attitude: Matrix3<f64>,
}

/// Derivatives of `p = F_xᵀ b + M_xᵀ c` and `q = F_Rᵀ b + M_Rᵀ c` at fixed b and c:
/// `δp = H_xx δx + H_xR ζ`, `δq = H_Rx δx + H_RR ζ`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadCurvature {
    /// `H_xx`, symmetric.
    pub position_position: Matrix3<f64>,
    /// `H_xR = H_Rxᵀ`.
    pub position_attitude: Matrix3<f64>,
    /// `H_RR`; not symmetric where `q ≠ 0`, for ζ is a variation in a moving frame.
    pub attitude_attitude: Matrix3<f64>,
}

impl<F: Field> Gravity for F {
    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        for ((body, state), load) in bodies.iter().zip(states).zip(loads) {
            *load += self.load(body, &state.position, &state.attitude);
        }
    }

    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64 {
        let each = |(body, state): (&RigidBody, &BodyState)| {
            Field::potential(self, body, &state.position, &state.attitude)
        };
        bodies.iter().zip(states).map(each).sum()
    }
}
