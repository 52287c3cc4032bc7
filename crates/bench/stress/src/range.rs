//! Numbers near the ends of their range.

mod limits;
mod units;

use lgvi_dynamics::integrator::{ChartOrigin, Quadrature, Rotor};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use nalgebra::{Matrix3, Vector3};

use self::limits::{Numbers, Outcome, Tally};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 2] = [
    Trial {
        name: "units",
        done: "a free body, two dumbbells, two multipoles, a body round an oblate planet and a pendulum, each in units of mass, length and \
               time from 2⁻⁹⁰⁰ to 2⁹⁰⁰ that its data can be written in, ten steps by each of 15 methods",
        right: "within the limits of numbers it flies, beyond them it may be refused by a typed error; where it flies it is the flight in other \
                units: powers of two change no rounding, and 1e-9 is an allowance for iterations that end a turn earlier or later, at tolerances \
                of 1e-10 and less",
        run: units::run,
    },
    Trial {
        name: "ends of the range",
        done: "a free body whose mass, moments, momenta, position and step are each 5e-324, 1e-310, 2.3e-308, 1e-200, 1e-60, 1e-30, 1, 1e30, \
               1e60, 1e200, 1e308 in all combinations, three steps by each of the 13 methods that keep momenta",
        right: "within the limits of numbers, and where it turns by `|hJ⁻¹Π| ≤ 1` a step, it flies; elsewhere it may be refused by a typed \
                error; where it flies it is finite, with linear and angular momentum those of the start and R a rotation, to 1e-6, an \
                allowance: 1e4 times the tolerance 1e-10 of methods with error control, as what is looked for is errors of order 1",
        run: ends,
    },
];

/// One of each kind.
fn methods() -> Vec<Method> {
    let cayley = Rotor::Discrete;
    let (degree, origin) = (2, ChartOrigin::Middle);
    let quadrature = Quadrature::Gauss(degree);
    vec![
        Method::Lgvi(cayley),
        Method::Lgvi(Rotor::Exact),
        Method::LagrangianLgvi,
        Method::LieEuler(cayley),
        Method::Composition {
            order: 4,
            rotor: cayley,
        },
        Method::Nystrom { order: 4 },
        Method::ImplicitMidpoint,
        Method::RungeKutta4,
        Method::CrouchGrossman,
        Method::DormandPrince853 { tolerance: 1e-10 },
        Method::Taylor { tolerance: 1e-10 },
        Method::Galerkin {
            degree,
            quadrature,
            origin,
        },
    ]
}

const ENDS: [f64; 11] = [
    5e-324, 1e-310, 2.3e-308, 1e-200, 1e-60, 1e-30, 1.0, 1e30, 1e60, 1e200, 1e308,
];

/// Moments, in units of the one given.
const MOMENTS: [f64; 3] = [0.5, 0.6, 0.9];

const DIRECTION: [f64; 3] = [0.8, 0.5, -0.3];

fn ends(length: Length) -> Result<Report, TrialError> {
    let mut tally = Tally::default();
    let mut refused_within = None;
    let mut first = None;
    let stride = length.of(97, 1);
    let count = ENDS.len();
    for index in (0..count.pow(5)).step_by(stride) {
        let pick = |n: u32| ENDS[index / count.pow(n) % count];
        let data = [pick(0), pick(1), pick(2), pick(3), pick(4)];
        let must = must_fly(data);
        for method in methods() {
            if matches!(method, Method::RungeKutta4 | Method::CrouchGrossman) {
                continue;
            }
            let outcome = flown(data, method);
            tally.add(must, outcome);
            match outcome {
                Outcome::Wrong => first = first.or(Some((method, data))),
                Outcome::Refused if must => {
                    refused_within = refused_within.or(Some((method, data)));
                }
                _ => {}
            }
        }
    }
    let mut report = Report::default();
    tally.tell(
        &mut report,
        "",
        refused_within.map(|(method, data)| format!("{method}, {data:?}")),
    );
    let what = first.map_or_else(String::new, |(method, data)| {
        format!(", first {method}, {data:?}")
    });
    report.within(format!("wrong{what}"), f64::from(tally.wrong), [0.0; 2]);
    Ok(report)
}

/// Whether all is within the limits of numbers and the body turns by no more than every rotor can.
fn must_fly([mass, moment, momentum, position, h]: [f64; 5]) -> bool {
    let rate = Vector3::from(DIRECTION).component_div(&Vector3::from(MOMENTS));
    let numbers = Numbers {
        h,
        mass,
        trace: MOMENTS.iter().sum::<f64>() * moment,
        farthest: Vector3::from(DIRECTION).norm() * position,
    };
    numbers.are_within() && momentum * h / moment * rate.norm() <= 1.0
}

fn flown([mass, moment, momentum, position, h]: [f64; 5], method: Method) -> Outcome {
    let direction = Vector3::from(DIRECTION);
    let Ok(inertia) = Inertia::principal(MOMENTS.map(|part| part * moment)) else {
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
