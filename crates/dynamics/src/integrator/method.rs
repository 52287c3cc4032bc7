use std::fmt;

use super::{
    Adaptive, ChartOrigin, ClosedForm, CrouchGrossman, Galerkin, ImplicitMidpoint, Integrator,
    LagrangianLgvi, MethodError, Quadrature, RungeKutta, Splitting, WisdomHolman, taylor,
};
use crate::{RigidBody, System};

/// The method for the free rotation within a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rotor {
    /// The discrete rigid body (3.24), (3.26), of second order.
    #[default]
    Discrete,
    /// The exact rotation in closed form, [`FreeRotation`](crate::rotation::FreeRotation).
    Exact,
}

/// The coefficients of a [`WisdomHolman`] step. With a perturbation of relative size ε, a step of generalized order
/// (n₁, n₂, n₃) errs by `O(ε h^(n₁+1) + ε² h^(n₂+1) + ε³ h^(n₃+1))`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KeplerScheme {
    /// Half a kick, a drift and half a kick: generalized order (2, 2), 1 gravity evaluation per step.
    Leapfrog,
    /// Generalized order (8, 2), 4 gravity evaluations per step (McLachlan 1995; Laskar and Robutel 2001).
    Aba82,
    /// Generalized order (8, 6, 4), 7 gravity evaluations per step (Blanes et al. 2013).
    Aba864,
    /// Generalized order (10, 6, 4), 8 gravity evaluations per step (Blanes et al. 2013).
    #[default]
    Aba1064,
}

impl KeplerScheme {
    /// All of them, by increasing order.
    pub const ALL: [Self; 4] = [Self::Leapfrog, Self::Aba82, Self::Aba864, Self::Aba1064];
}

/// The integrators by name.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// The Lie group variational integrator in Hamiltonian form (3.22)–(3.26), [`Splitting::lgvi`].
    Lgvi(Rotor),
    /// The Lie group variational integrator in Lagrangian form (3.18)–(3.21), [`LagrangianLgvi`].
    LagrangianLgvi,
    /// [`Splitting::lie_euler`].
    LieEuler(Rotor),
    /// [`Splitting::composition`] of this order.
    Composition {
        /// Order: 4, 6, 8 or 10.
        order: u32,
        /// Rotor of the drifts.
        rotor: Rotor,
    },
    /// [`Splitting::nystrom`] of this order.
    Nystrom {
        /// Order: 4, 6 or 8.
        order: u32,
    },
    /// [`WisdomHolman`] with these coefficients.
    WisdomHolman {
        /// Coefficients of the step.
        scheme: KeplerScheme,
    },
    /// [`ClosedForm`].
    ClosedForm,
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
        /// Tolerance for the error of a step.
        tolerance: f64,
    },
    /// [`Adaptive::dormand_prince853`].
    DormandPrince853 {
        /// Tolerance for the error of a step.
        tolerance: f64,
    },
    /// [`Adaptive::taylor`].
    Taylor {
        /// Tolerance for the error of a step.
        tolerance: f64,
    },
    /// [`Galerkin`].
    Galerkin {
        /// Degree `s` of the polynomials.
        degree: u32,
        /// Quadrature of the action.
        quadrature: Quadrature,
        /// Center of the chart.
        origin: ChartOrigin,
    },
    /// [`Galerkin::euler_poincare`].
    EulerPoincare {
        /// Degree `s` of the polynomials.
        degree: u32,
        /// Quadrature of the action.
        quadrature: Quadrature,
        /// Center of the chart.
        origin: ChartOrigin,
    },
}

impl fmt::Display for Rotor {
    /// Writes the suffix of a method's name, which is empty for the default.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Discrete => Ok(()),
            Self::Exact => write!(f, ", exact rotor"),
        }
    }
}

impl fmt::Display for KeplerScheme {
    /// Writes the generalized order.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Leapfrog => "(2, 2)",
            Self::Aba82 => "(8, 2)",
            Self::Aba864 => "(8, 6, 4)",
            Self::Aba1064 => "(10, 6, 4)",
        })
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lgvi(rotor) => write!(f, "LGVI{rotor}"),
            Self::LagrangianLgvi => write!(f, "LGVI in Lagrangian form"),
            Self::LieEuler(rotor) => write!(f, "Lie–Euler{rotor}"),
            Self::ClosedForm => write!(f, "closed form"),
            Self::Composition { order, rotor } => {
                write!(f, "composition of order {order}{rotor}")
            }
            Self::Nystrom { order } => write!(f, "Nyström splitting of order {order}"),
            Self::WisdomHolman { scheme } => write!(f, "Wisdom–Holman of order {scheme}"),
            Self::Galerkin { degree, .. } => write!(f, "Galerkin of degree {degree}"),
            Self::EulerPoincare { degree, .. } => write!(f, "Euler–Poincaré of degree {degree}"),
            Self::ExplicitMidpoint => write!(f, "explicit midpoint"),
            Self::ImplicitMidpoint => write!(f, "implicit midpoint"),
            Self::CrouchGrossman => write!(f, "Crouch–Grossman 2"),
            Self::RungeKutta4 => write!(f, "Runge–Kutta 4"),
            Self::Fehlberg78 { tolerance } => {
                write!(f, "Fehlberg 7(8), tolerance {tolerance:.1e}")
            }
            Self::DormandPrince853 { tolerance } => {
                write!(f, "Dormand–Prince 8(5,3), tolerance {tolerance:.1e}")
            }
            Self::Taylor { tolerance } => write!(f, "Taylor series, tolerance {tolerance:.1e}"),
        }
    }
}

impl Method {
    /// Returns true if the method chooses its own steps within those of the simulation.
    pub fn has_error_control(self) -> bool {
        matches!(
            self,
            Self::Fehlberg78 { .. } | Self::DormandPrince853 { .. } | Self::Taylor { .. }
        )
    }

    /// Order of convergence, or `None` if the motion is exact. Of a generalized order it is the last number, of Taylor
    /// series that of their tolerance.
    pub fn order(self) -> Option<u32> {
        match self {
            Self::LieEuler(_) => Some(1),
            Self::Lgvi(_)
            | Self::LagrangianLgvi
            | Self::ExplicitMidpoint
            | Self::ImplicitMidpoint
            | Self::CrouchGrossman => Some(2),
            Self::RungeKutta4 => Some(4),
            Self::Fehlberg78 { .. } | Self::DormandPrince853 { .. } => Some(8),
            Self::Composition { order, .. } | Self::Nystrom { order } => Some(order),
            Self::WisdomHolman { scheme } => Some(match scheme {
                KeplerScheme::Leapfrog | KeplerScheme::Aba82 => 2,
                KeplerScheme::Aba864 | KeplerScheme::Aba1064 => 4,
            }),
            Self::Galerkin {
                degree, quadrature, ..
            }
            | Self::EulerPoincare {
                degree, quadrature, ..
            } => {
                let exact = match quadrature {
                    Quadrature::Gauss(points) => 2 * points,
                    Quadrature::Lobatto(points) => 2 * points - 2,
                };
                Some(exact.min(2 * degree))
            }
            Self::Taylor { tolerance } => Some(taylor::order(tolerance)),
            Self::ClosedForm => None,
        }
    }

    /// The rotor of the method, or `None` if it has none.
    pub fn rotor(self) -> Option<Rotor> {
        match self {
            Self::Lgvi(rotor) | Self::LieEuler(rotor) | Self::Composition { rotor, .. } => {
                Some(rotor)
            }
            Self::LagrangianLgvi => Some(Rotor::Discrete),
            Self::Nystrom { .. } | Self::WisdomHolman { .. } | Self::ClosedForm => {
                Some(Rotor::Exact)
            }
            _ => None,
        }
    }

    /// Returns true if its steps consist of kicks and drifts.
    pub(crate) fn drifts(self) -> bool {
        matches!(
            self,
            Self::Lgvi(_)
                | Self::LieEuler(_)
                | Self::Composition { .. }
                | Self::Nystrom { .. }
                | Self::WisdomHolman { .. }
        )
    }

    /// Returns true if it integrates bodies with [`wheels`](crate::wheels) or [`thrusters`](crate::thrusters).
    pub fn carries_actuators(self) -> bool {
        match self {
            Self::Lgvi(_)
            | Self::LieEuler(_)
            | Self::Composition { .. }
            | Self::Nystrom { .. }
            | Self::ExplicitMidpoint
            | Self::ImplicitMidpoint
            | Self::CrouchGrossman
            | Self::RungeKutta4
            | Self::Fehlberg78 { .. }
            | Self::DormandPrince853 { .. } => true,
            Self::LagrangianLgvi
            | Self::WisdomHolman { .. }
            | Self::ClosedForm
            | Self::Taylor { .. }
            | Self::Galerkin { .. }
            | Self::EulerPoincare { .. } => false,
        }
    }

    /// Returns true if it integrates bodies with [`drag`](crate::drag). A Nyström splitting does not: its coefficients cancel
    /// errors that only forces that do not depend on velocities have.
    pub fn carries_drag(self) -> bool {
        match self {
            Self::Lgvi(_)
            | Self::LieEuler(_)
            | Self::Composition { .. }
            | Self::ExplicitMidpoint
            | Self::ImplicitMidpoint
            | Self::CrouchGrossman
            | Self::RungeKutta4
            | Self::Fehlberg78 { .. }
            | Self::DormandPrince853 { .. } => true,
            Self::LagrangianLgvi
            | Self::Nystrom { .. }
            | Self::WisdomHolman { .. }
            | Self::ClosedForm
            | Self::Taylor { .. }
            | Self::Galerkin { .. }
            | Self::EulerPoincare { .. } => false,
        }
    }

    /// Creates the integrator for `system`.
    ///
    /// # Errors
    /// Returns an error if the method does not integrate such systems.
    pub fn integrator(self, system: &System) -> Result<Box<dyn Integrator>, MethodError> {
        let position = |has: fn(&RigidBody) -> bool| system.bodies().iter().position(has);
        if let Some(body) = position(RigidBody::has_actuators)
            && !self.carries_actuators()
        {
            return Err(MethodError::Actuators { method: self, body });
        }
        if let Some(body) = position(|body| body.drag().is_some())
            && !self.carries_drag()
        {
            return Err(MethodError::Drag { method: self, body });
        }
        Ok(match self {
            Self::Lgvi(rotor) => Box::new(Splitting::lgvi(rotor, system.bodies())),
            Self::LagrangianLgvi => Box::new(LagrangianLgvi::new(system)?),
            Self::LieEuler(rotor) => Box::new(Splitting::lie_euler(rotor, system.bodies())),
            Self::ClosedForm => Box::new(ClosedForm::new(system)?),
            Self::Composition { order, rotor } => {
                Box::new(Splitting::composition(order, rotor, system.bodies())?)
            }
            Self::Nystrom { order } => Box::new(Splitting::nystrom(order, system.bodies())?),
            Self::WisdomHolman { scheme } => Box::new(WisdomHolman::new(scheme, system)?),
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
            Self::Taylor { tolerance } => Box::new(Adaptive::taylor(tolerance, system)?),
            Self::Galerkin {
                degree,
                quadrature,
                origin,
            } => Box::new(Galerkin::new(system, degree, quadrature, origin)?),
            Self::EulerPoincare {
                degree,
                quadrature,
                origin,
            } => Box::new(Galerkin::euler_poincare(
                system, degree, quadrature, origin,
            )?),
        })
    }
}
