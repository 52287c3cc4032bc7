use super::{
    Adaptive, CrouchGrossman, ImplicitMidpoint, Integrator, MethodError, ProcessedLieEuler,
    RungeKutta, Splitting,
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
    /// [`RungeKutta::explicit_midpoint`].
    ExplicitMidpoint,
    /// [`ImplicitMidpoint`].
    ImplicitMidpoint,
    /// [`CrouchGrossman`].
    CrouchGrossman,
    /// [`RungeKutta::classical`].
    RungeKutta4,
    /// [`Adaptive::fehlberg78`].
    Fehlberg78 {
        /// Error allowed in a step.
        tolerance: f64,
    },
    /// [`Adaptive::dormand_prince853`].
    DormandPrince853 {
        /// Error allowed in a step.
        tolerance: f64,
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
            Self::ExplicitMidpoint => Box::new(RungeKutta::explicit_midpoint(system.bodies())),
            Self::ImplicitMidpoint => Box::new(ImplicitMidpoint::new(system.bodies())),
            Self::CrouchGrossman => Box::new(CrouchGrossman::new(system.bodies())),
            Self::RungeKutta4 => Box::new(RungeKutta::classical(system.bodies())),
            Self::Fehlberg78 { tolerance } => {
                Box::new(Adaptive::fehlberg78(tolerance, system.bodies())?)
            }
            Self::DormandPrince853 { tolerance } => {
                Box::new(Adaptive::dormand_prince853(tolerance, system.bodies())?)
            }
        })
    }
}
