//! What tests of wheels and thrusters have in common.

use lgvi_dynamics::Method;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::nalgebra::Vector3;

/// Methods that integrate bodies with actuators.
pub(crate) const METHODS: [Method; 11] = [
    Method::ExplicitMidpoint,
    Method::ImplicitMidpoint,
    Method::CrouchGrossman,
    Method::Lgvi(Rotor::Discrete),
    Method::Lgvi(Rotor::Exact),
    Method::Composition {
        order: 4,
        rotor: Rotor::Discrete,
    },
    Method::Composition {
        order: 6,
        rotor: Rotor::Exact,
    },
    Method::Nystrom { order: 6 },
    Method::RungeKutta4,
    Method::DormandPrince853 { tolerance: 1e-13 },
    Method::Fehlberg78 { tolerance: 1e-13 },
];

/// Components between −`scale` and `scale`.
pub(crate) fn random(rng: &mut fastrand::Rng, scale: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0))
}
