use super::{
    ChartOrigin, EulerPoincare, Galerkin, Integrator, MethodError, ProcessedLieEuler, Quadrature,
    Splitting,
};
use crate::System;
use crate::rotation::Chart;

/// How the free rotation within a step is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotor {
    /// The discrete rigid body (3.24), (3.26): second order, the implicit equation solved in a chart.
    Discrete(Chart),
}

/// The integrators by name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// The Lie group variational integrator in Hamiltonian form (3.22)–(3.26), [`Splitting::lgvi`].
    Lgvi(Rotor),
    /// [`Splitting::lie_euler`].
    LieEuler(Rotor),
    /// [`ProcessedLieEuler`].
    ProcessedLieEuler(Rotor),
    /// [`Galerkin`].
    Galerkin {
        /// Degree `s` of the polynomials.
        degree: u32,
        /// Quadrature of the action.
        quadrature: Quadrature,
        /// Centre of the chart.
        origin: ChartOrigin,
    },
    /// [`EulerPoincare`].
    EulerPoincare {
        /// Degree `s` of the polynomials.
        degree: u32,
        /// Quadrature of the action.
        quadrature: Quadrature,
        /// Centre of the chart.
        origin: ChartOrigin,
    },
}

impl Default for Rotor {
    fn default() -> Self {
        Self::Discrete(Chart::default())
    }
}

impl Method {
    /// The integrator for `system`.
    pub fn integrator(self, system: &System) -> Result<Box<dyn Integrator>, MethodError> {
        Ok(match self {
            Self::Lgvi(rotor) => Box::new(Splitting::lgvi(rotor, system.bodies())),
            Self::LieEuler(rotor) => Box::new(Splitting::lie_euler(rotor, system.bodies())),
            Self::ProcessedLieEuler(rotor) => {
                Box::new(ProcessedLieEuler::new(rotor, system.bodies()))
            }
            Self::Galerkin {
                degree,
                quadrature,
                origin,
            } => Box::new(Galerkin::new(system, degree, quadrature, origin)?),
            Self::EulerPoincare {
                degree,
                quadrature,
                origin,
            } => Box::new(EulerPoincare::new(system, degree, quadrature, origin)?),
        })
    }
}
