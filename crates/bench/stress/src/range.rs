//! Numbers near the ends of their range.

mod units;

use lgvi_dynamics::integrator::{ChartOrigin, Quadrature, Rotor};
use lgvi_dynamics::rotation::{Chart, PreprocessedOrder};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use nalgebra::{Matrix3, Vector3};

use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 2] = [
    Trial {
        name: "units",
        done: "a free body, two dumbbells, two multipoles, a body round an oblate planet and a pendulum, each in units of mass, length and \
               time from 2⁻⁹⁰⁰ to 2⁹⁰⁰ that its data can be written in, ten steps by each of 14 methods",
        right: "the flight in other units is the flight, to 1e-9, or refused by a typed error; never another one",
        run: units::run,
    },
    Trial {
        name: "ends of the range",
        done: "a free body whose mass, moments, momenta, position and step are each 5e-324, 1e-310, 2.3e-308, 1e-200, 1, 1e200, 1e308 in all \
               combinations, three steps by each of the 12 methods that keep momenta",
        right: "refused by a typed error, or finite, with linear and angular momentum those of the start and R a rotation",
        run: ends,
    },
];

/// One of each kind.
fn methods() -> Vec<Method> {
    let cayley = Rotor::Discrete(Chart::Cayley);
    let (degree, origin) = (2, ChartOrigin::Middle);
    let quadrature = Quadrature::Gauss(degree);
    vec![
        Method::Lgvi(cayley),
        Method::Lgvi(Rotor::Discrete(Chart::Exponential)),
        Method::Lgvi(Rotor::Preprocessed(PreprocessedOrder::Eight)),
        Method::Lgvi(Rotor::Exact),
        Method::LagrangianLgvi(Chart::Cayley),
        Method::LieEuler(cayley),
        Method::ProcessedLieEuler(cayley),
        Method::Composition {
            order: 4,
            rotor: cayley,
        },
        Method::Nystrom {
            order: 4,
            rotor: Rotor::Exact,
        },
        Method::ImplicitMidpoint,
        Method::RungeKutta4,
        Method::CrouchGrossman,
        Method::DormandPrince853 { tolerance: 1e-10 },
        Method::Galerkin {
            degree,
            quadrature,
            origin,
        },
    ]
}

const ENDS: [f64; 7] = [5e-324, 1e-310, 2.3e-308, 1e-200, 1.0, 1e200, 1e308];

/// What three steps have come to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Refused,
    Right,
    Wrong,
}

fn ends(length: Length) -> Result<Report, TrialError> {
    let [mut refused, mut right, mut wrong] = [0_u32; 3];
    let mut first = None;
    let stride = length.of(97, 1);
    let count = ENDS.len();
    for index in (0..count.pow(5)).step_by(stride) {
        let pick = |n: u32| ENDS[index / count.pow(n) % count];
        for method in methods() {
            if matches!(method, Method::RungeKutta4 | Method::CrouchGrossman) {
                continue;
            }
            let data = [pick(0), pick(1), pick(2), pick(3), pick(4)];
            match flown(data, method) {
                Outcome::Refused => refused += 1,
                Outcome::Right => right += 1,
                Outcome::Wrong => {
                    wrong += 1;
                    first = first.or(Some((method, data)));
                }
            }
        }
    }
    let mut report = Report::default();
    report.shows("right", f64::from(right));
    report.shows("refused", f64::from(refused));
    let what = first.map_or_else(String::new, |(method, data)| {
        format!(", first {method}, {data:?}")
    });
    report.within(format!("wrong{what}"), f64::from(wrong), [0.0; 2]);
    Ok(report)
}

fn flown([mass, moment, momentum, position, h]: [f64; 5], method: Method) -> Outcome {
    let direction = Vector3::new(0.8, 0.5, -0.3);
    let Ok(inertia) = Inertia::principal([0.5 * moment, 0.6 * moment, 0.9 * moment]) else {
        return Outcome::Refused;
    };
    let Ok(body) = RigidBody::new(mass, inertia, vec![]) else {
        return Outcome::Refused;
    };
    let state = BodyState {
        position: direction * position,
        linear_momentum: direction * momentum,
        attitude: Matrix3::identity(),
        angular_momentum: direction * momentum,
    };
    let system = System::new(vec![body], vec![]);
    let Ok(mut simulation) = Simulation::new(system, vec![state], method, h) else {
        return Outcome::Refused;
    };
    for _ in 0..3 {
        let before = simulation.states()[0];
        if simulation.advance(&[Load::default()]).is_err() {
            let kept = simulation.states()[0] == before && before.is_finite();
            return if kept {
                Outcome::Refused
            } else {
                Outcome::Wrong
            };
        }
    }
    let end = simulation.states()[0];
    // Relative to a power of two, as norms over- and underflow; a denormal keeps fewer digits.
    let unit = libm::ldexp(1.0, -libm::ilogb(momentum).clamp(-1000, 1000));
    let change = |end: Vector3<f64>, begin: Vector3<f64>| ((end * unit) - (begin * unit)).norm();
    let allowed = 1e-6 + 64.0 * (5e-324 * unit);
    let linear = change(end.linear_momentum, state.linear_momentum);
    let angular = change(end.attitude * end.angular_momentum, state.angular_momentum);
    let round = lgvi_lie::orthogonality_error(&end.attitude);
    if end.is_finite() && linear <= allowed && angular <= allowed && round <= 1e-6 {
        Outcome::Right
    } else {
        Outcome::Wrong
    }
}
