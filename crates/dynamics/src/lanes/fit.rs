use thiserror::Error;

use super::body::Motion;
use crate::gravity::Form;
use crate::integrator::{Rotor, Splitting};
use crate::{MassDistribution, Method, System};

/// Why lanes cannot fly a system. Bodies count from 0.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Unfit {
    /// Not a method of kicks and drifts with the discrete rotor.
    #[error(
        "lanes cannot fly by {method}, expected LGVI, Lie–Euler or a composition with the discrete rotor"
    )]
    Method {
        /// Its name.
        method: String,
    },
    /// Gravity of another form.
    #[error("lanes know no such gravity, expected point masses, second moments, uniform or mutual")]
    Gravity,
    /// A body that gravity does not act on by points.
    #[error("body {body} is no set of points of mass")]
    Distribution {
        /// Which body.
        body: usize,
    },
    /// A body that is driven.
    #[error("body {body} is driven, expected free, pivoted or fixed")]
    Mobility {
        /// Which body.
        body: usize,
    },
    /// Nothing to fly.
    #[error("there is no system, expected one at least")]
    Nobody,
    /// Thrust on a body that is not there.
    #[error("the thrust is that of body {body}, expected a body of the system")]
    Thrust {
        /// Which body.
        body: usize,
    },
    /// A system of another layout beside it.
    #[error("system {member} differs from the first in more than numbers")]
    Unlike {
        /// Which system, from 0.
        member: usize,
    },
}

/// What lanes fly a system by: how they do it, beside the numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    pub(super) stages: Vec<(f64, f64)>,
    pub(super) last_kick: f64,
    pub(super) forms: Vec<Form>,
    pub(super) motions: Vec<Motion>,
    /// Whether something has an extent that another could enter.
    pub(super) extents: bool,
    /// Points of each body.
    pub(super) points: Vec<usize>,
}

/// Whether lanes can fly `system` by `method`.
pub fn fit(system: &System, method: Method) -> Result<(), Unfit> {
    Layout::of(system, method).map(|_| ())
}

impl Layout {
    pub(super) fn of(system: &System, method: Method) -> Result<Self, Unfit> {
        let (stages, last_kick) = stages(system, method)?;
        let bodies = system.bodies();
        let forms = system.forms().ok_or(Unfit::Gravity)?;
        let mut motions = Vec::with_capacity(bodies.len());
        for (index, body) in bodies.iter().enumerate() {
            if !matches!(body.distribution(), MassDistribution::Points(_)) {
                return Err(Unfit::Distribution { body: index });
            }
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
            motions,
            extents: bodies.iter().any(|body| body.radius() > 0.0) || forms.iter().any(wide),
            forms,
            points: bodies.iter().map(|body| body.points().len()).collect(),
        })
    }
}

/// Coefficients of kicks and drifts.
fn stages(system: &System, method: Method) -> Result<(Vec<(f64, f64)>, f64), Unfit> {
    let bodies = system.bodies();
    let splitting = match method {
        Method::Lgvi(rotor @ Rotor::Discrete) => Some(Splitting::lgvi(rotor, bodies)),
        Method::LieEuler(rotor @ Rotor::Discrete) => Some(Splitting::lie_euler(rotor, bodies)),
        Method::Composition {
            order,
            rotor: rotor @ Rotor::Discrete,
        } => Splitting::composition(order, rotor, bodies).ok(),
        _ => None,
    };
    splitting
        .map(|splitting| splitting.coefficients())
        .ok_or_else(|| Unfit::Method {
            method: method.to_string(),
        })
}
