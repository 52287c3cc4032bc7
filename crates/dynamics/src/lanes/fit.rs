use thiserror::Error;

use super::body::Motion;
use crate::gravity::Form;
use crate::integrator::{Rotor, Splitting};
use crate::{MassDistribution, Method, RigidBody, System};

/// Reasons why lanes cannot integrate a system. Bodies are counted from 0.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum Unfit {
    /// The method is not a splitting into kicks and free motion.
    #[error(
        "lanes cannot fly by {method}, expected LGVI, Lie–Euler, a composition or a Nyström splitting"
    )]
    Method {
        /// Name of the method.
        method: String,
    },
    /// The gravity model is not supported.
    #[error(
        "this gravity cannot be computed side by side; expected point masses, second moments, a uniform field or mutual gravity"
    )]
    Gravity,
    /// Gravity acts on a body other than through points or a multipole.
    #[error("body {body} is a polyhedron, expected point masses or a multipole")]
    Distribution {
        /// Index of the body.
        body: usize,
    },
    /// A body is driven.
    #[error("body {body} is driven, expected free, pivoted or fixed")]
    Mobility {
        /// Index of the body.
        body: usize,
    },
    /// A body has reaction wheels or thrusters.
    #[error("body {body} has reaction wheels or thrusters, expected none")]
    Actuators {
        /// Index of the body.
        body: usize,
    },
    /// A body has drag.
    #[error("body {body} has drag, expected none")]
    Drag {
        /// Index of the body.
        body: usize,
    },
    /// There are no systems.
    #[error("there are no systems, expected at least one")]
    Nobody,
    /// The thrust refers to a body that does not exist.
    #[error("the thrust acts on body {body}, expected a body of the system")]
    Thrust {
        /// Index of the body.
        body: usize,
    },
    /// A system differs from the first in its layout.
    #[error(
        "system {member} has another structure than the first; systems side by side may differ only in numbers"
    )]
    Unlike {
        /// Index of the system, from 0.
        member: usize,
    },
}

/// The structure of a system and its method, without the numerical values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    pub(super) stages: Vec<(f64, f64)>,
    pub(super) last_kick: f64,
    pub(super) rotor: Rotor,
    pub(super) forms: Vec<Form>,
    pub(super) motions: Vec<Motion>,
    /// True if a body or source has an extent that another could enter.
    pub(super) extents: bool,
    pub(super) shapes: Vec<Shape>,
}

/// The kind of a body's mass distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// This number of points.
    Points(usize),
    /// A multipole of this order.
    Multipole(u32),
}

impl Shape {
    fn of(body: &RigidBody) -> Option<Self> {
        match body.distribution() {
            MassDistribution::Points(points) => Some(Self::Points(points.len())),
            MassDistribution::Multipole(multipole) => Some(Self::Multipole(multipole.order())),
            MassDistribution::Polyhedron(_) => None,
        }
    }
}

/// Returns an error if lanes cannot integrate `system` by `method`.
pub fn fit(system: &System, method: Method) -> Result<(), Unfit> {
    Layout::of(system, method).map(|_| ())
}

impl Layout {
    pub(super) fn of(system: &System, method: Method) -> Result<Self, Unfit> {
        let (splitting, rotor) = splitting(system, method)?;
        let (stages, last_kick) = splitting.coefficients();
        let bodies = system.bodies();
        let forms = system.forms().ok_or(Unfit::Gravity)?;
        let mut motions = Vec::with_capacity(bodies.len());
        let mut shapes = Vec::with_capacity(bodies.len());
        for (index, body) in bodies.iter().enumerate() {
            if body.has_actuators() {
                return Err(Unfit::Actuators { body: index });
            }
            if body.drag().is_some() {
                return Err(Unfit::Drag { body: index });
            }
            shapes.push(Shape::of(body).ok_or(Unfit::Distribution { body: index })?);
            let motion = Motion::of(body.mobility()).ok_or(Unfit::Mobility { body: index })?;
            motions.push(motion);
        }
        let wide = |form: &Form| match form {
            Form::Attractor { placement, .. } => placement.as_ref().is_some_and(|p| p.radius > 0.0),
            Form::Uniform { .. } | Form::Mutual { .. } => false,
        };
        Ok(Self {
            stages,
            last_kick,
            rotor,
            motions,
            extents: bodies.iter().any(|body| body.radius() > 0.0) || forms.iter().any(wide),
            forms,
            shapes,
        })
    }
}

/// The splitting of the method and its rotor.
fn splitting(system: &System, method: Method) -> Result<(Splitting, Rotor), Unfit> {
    let bodies = system.bodies();
    let splitting = match method {
        Method::Lgvi(rotor) => Some(Splitting::lgvi(rotor, bodies)),
        Method::LieEuler(rotor) => Some(Splitting::lie_euler(rotor, bodies)),
        Method::Composition { order, rotor } => Splitting::composition(order, rotor, bodies).ok(),
        Method::Nystrom { order } => Splitting::nystrom(order, bodies).ok(),
        _ => None,
    };
    splitting.zip(method.rotor()).ok_or_else(|| Unfit::Method {
        method: method.to_string(),
    })
}
