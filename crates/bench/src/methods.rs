//! The integrators that are compared.

use lgvi_dynamics::Method;
use lgvi_dynamics::integrator::{ChartOrigin, KeplerScheme, Quadrature, Rotor};

/// How a method is tuned.
pub(crate) enum Family {
    /// By the number of steps.
    Stepped(Method),
    /// By a tolerance.
    Adaptive(fn(f64) -> Method),
    /// Not at all: it leaps to any time.
    Exact(Method),
}

/// All, with their labels.
pub(crate) fn families() -> Vec<(String, Family)> {
    let mut families = vec![
        (
            "LGVI".into(),
            Family::Stepped(Method::Lgvi(Rotor::default())),
        ),
        (
            "LGVI, exact rotor".into(),
            Family::Stepped(Method::Lgvi(Rotor::Exact)),
        ),
    ];
    for order in [4, 6, 8, 10] {
        for (rotor, name) in [(Rotor::default(), "discrete"), (Rotor::Exact, "exact")] {
            let method = Method::Composition { order, rotor };
            families.push((
                format!("composition {order}, {name} rotor"),
                Family::Stepped(method),
            ));
        }
    }
    for order in [4, 6, 8] {
        families.push((
            format!("Nyström {order}"),
            Family::Stepped(Method::Nystrom { order }),
        ));
    }
    for scheme in KeplerScheme::ALL {
        families.push((
            format!("Wisdom–Holman {scheme}"),
            Family::Stepped(Method::WisdomHolman { scheme }),
        ));
    }
    for degree in [2, 4, 6] {
        let method = Method::Galerkin {
            degree,
            quadrature: Quadrature::Gauss(degree),
            origin: ChartOrigin::Middle,
        };
        families.push((format!("Galerkin {degree}"), Family::Stepped(method)));
    }
    let stepped = [
        ("explicit midpoint", Method::ExplicitMidpoint),
        ("implicit midpoint", Method::ImplicitMidpoint),
        ("Crouch–Grossman 2", Method::CrouchGrossman),
        ("Runge–Kutta 4", Method::RungeKutta4),
    ];
    for (label, method) in stepped {
        families.push((label.into(), Family::Stepped(method)));
    }
    families.push((
        "Fehlberg 7(8)".into(),
        Family::Adaptive(|tolerance| Method::Fehlberg78 { tolerance }),
    ));
    families.push((
        "Dormand–Prince 8(5,3)".into(),
        Family::Adaptive(|tolerance| Method::DormandPrince853 { tolerance }),
    ));
    families.push((
        "Taylor".into(),
        Family::Adaptive(|tolerance| Method::Taylor { tolerance }),
    ));
    families.push(("closed form".into(), Family::Exact(Method::ClosedForm)));
    families
}
