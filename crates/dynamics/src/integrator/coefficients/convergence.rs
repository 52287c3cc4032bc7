//! Measures orders on nonlinear systems of two degrees of freedom.

use std::f64::consts::TAU;

use super::*;

type Pair = [f64; 2];

/// `q̇ = velocity(p)`, `ṗ = force(q)`, with the solution at `time`.
struct Problem {
    velocity: fn(Pair) -> Pair,
    force: fn(Pair) -> Pair,
    start: [Pair; 2],
    end: [Pair; 2],
    time: f64,
}

fn quadratic(p: Pair) -> Pair {
    p
}

/// Velocity for the non-quadratic kinetic energy √(1 + p²).
fn relativistic(p: Pair) -> Pair {
    let energy = (1.0 + p[0] * p[0] + p[1] * p[1]).sqrt();
    p.map(|p| p / energy)
}

fn central(q: Pair) -> Pair {
    let r2 = q[0] * q[0] + q[1] * q[1];
    q.map(|q| -q / (r2 * r2.sqrt()))
}

/// Force of the Hénon–Heiles potential (q₁² + q₂²)/2 + q₁² q₂ − q₂³/3.
fn cubic(q: Pair) -> Pair {
    [-q[0] - 2.0 * q[0] * q[1], -q[1] - q[0] * q[0] + q[1] * q[1]]
}

/// One revolution of the ellipse of eccentricity 0.3, from periapsis.
fn kepler() -> Problem {
    let start = [[0.7, 0.0], [0.0, (1.3_f64 / 0.7).sqrt()]];
    Problem {
        velocity: quadratic,
        force: central,
        start,
        end: start,
        time: TAU,
    }
}

/// The end state was computed with Taylor series to 30 digits (mpmath's `odefun`).
fn henon_heiles() -> Problem {
    Problem {
        velocity: quadratic,
        force: cubic,
        start: [[0.25, -0.125], [0.25, 0.125]],
        end: [
            [0.275_880_399_272_131_7, 0.110_429_652_545_364_94],
            [-0.194_104_750_073_993_24, 0.005_822_157_489_911_128],
        ],
        time: 8.0,
    }
}

/// The end state was computed as in [`henon_heiles`].
fn relativistic_henon_heiles() -> Problem {
    Problem {
        velocity: relativistic,
        end: [
            [0.297_356_396_458_380_65, 0.113_367_998_340_708_37],
            [-0.137_170_383_940_886, 0.037_329_141_825_151_83],
        ],
        ..henon_heiles()
    }
}

impl Problem {
    /// Distance in phase space from the solution after `steps` steps.
    fn error(&self, scheme: &Scheme, steps: u32) -> f64 {
        let h = self.time / f64::from(steps);
        let [mut q, mut p] = self.start;
        let advance = |x: &mut Pair, rate: Pair, dt: f64| {
            x.iter_mut().zip(rate).for_each(|(x, rate)| *x += dt * rate);
        };
        for _ in 0..steps {
            let mut drifts = scheme.drifts.iter();
            for kick in &scheme.kicks {
                advance(&mut p, (self.force)(q), kick * h);
                if let Some(drift) = drifts.next() {
                    advance(&mut q, (self.velocity)(p), drift * h);
                }
            }
        }
        let square = |a: Pair, b: Pair| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
        (square(q, self.end[0]) + square(p, self.end[1])).sqrt()
    }

    /// Slope of the error over three halvings of the step size, starting from `steps` steps.
    fn measured_order(&self, scheme: &Scheme, steps: u32) -> f64 {
        let errors = [1, 2, 4, 8].map(|n| self.error(scheme, n * steps));
        (errors[0] / errors[3]).log2() / 3.0
    }
}

/// Checks the slope with a margin for coarse steps. A symmetric scheme that violated an order condition would lose 2
/// orders.
fn assert_order(problem: &Problem, scheme: &Scheme, order: u32, steps: u32) {
    let measured = problem.measured_order(scheme, steps);
    assert!(measured > f64::from(order) - 0.75, "{measured} of {order}");
}

#[test]
fn compositions_have_their_orders() {
    for table in [
        &SUZUKI_4,
        &SOFRONIOU_SPALETTA_6,
        &SOFRONIOU_SPALETTA_8,
        &SOFRONIOU_SPALETTA_10,
    ] {
        let (scheme, order) = (table.scheme(), table.order);
        assert_order(&kepler(), &scheme, order, 48 / order);
        assert_order(&henon_heiles(), &scheme, order, 24 / order);
        assert_order(&relativistic_henon_heiles(), &scheme, order, 24 / order);
    }
}

const NYSTROM: [&Nystrom; 3] = [&SRKN_6B, &SRKN_14A, &RKN_A19];

#[test]
fn nystrom_splittings_have_their_orders() {
    for table in NYSTROM {
        let (scheme, order) = (table.scheme(), table.order);
        assert_order(&kepler(), &scheme, order, 48 / order);
        assert_order(&henon_heiles(), &scheme, order, 24 / order);
    }
}

/// Checks the stated limit of these tables, and that kicks and drifts are not confused.
#[test]
fn nystrom_splittings_have_order_four_outside_their_class() {
    for table in NYSTROM {
        let scheme = table.scheme();
        let exchanged = Scheme {
            kicks: [&[0.0], scheme.drifts.as_slice(), &[0.0]].concat(),
            drifts: scheme.kicks.clone(),
        };
        for measured in [
            relativistic_henon_heiles().measured_order(&scheme, 16),
            kepler().measured_order(&exchanged, 16),
        ] {
            assert!((measured - 4.0).abs() < 0.2, "{measured}");
        }
    }
}
