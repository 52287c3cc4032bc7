//! Bodies whose masses differ by twelve orders.

use std::f64::consts::TAU;

use lgvi_dynamics::gravity::Mutual;
use lgvi_dynamics::{Method, Simulation};
use nalgebra::Vector3;

use crate::bodies::{LGVI, ULP, fly, keep, moving, sphere, under};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 2] = [
    Trial {
        name: "mass ratio 1e-12, orbit",
        done: "two spheres of mass 1 and 1e-12, free, eccentricity 0.5, about their barycenter; Nyström of order 8, 50 and \
               100 steps a period, to 100 periods",
        right: "after whole periods of `2π√(a³/G(M + m))` both are where they began, the heavy one to the same part of its own \
                way, 1e-12 of the light one's: to `2⁻⁷` of the miss with 50 steps (order 8 makes 2⁻⁸ of it) and to what a walk of \
                `8 × 2⁻⁵²√n` of the energy, n the number of kicks, makes of the phase; the barycenter rests to the rounding of its \
                first momentum, `2⁻⁵² t`, and of positions, `4 × 2⁻⁵²√n`",
        run: orbit,
    },
    Trial {
        name: "mass ratio 1e-12, momenta",
        done: "the same by `lgvi`, 200 steps a period, 1e5 periods",
        right: "total linear and angular momentum are kept to `2⁻⁵²√n` and `4 × 2⁻⁵²√n` of the light body's: kicks are opposite to the last \
                bit, while `x × p` is of 12 roundings a step, three standard deviations of which are 3; the energy error, of second \
                order, is bounded: a tenth is an allowance for the phases that samples fall on",
        run: momenta,
    },
];

const LIGHT: f64 = 1e-12;
const ECCENTRICITY: f64 = 0.5;

/// With a number of steps a period.
fn simulation(method: Method, steps: f64) -> Result<Simulation, TrialError> {
    let bodies = vec![sphere(1.0)?, sphere(LIGHT)?];
    let total = 1.0 + LIGHT;
    // At the apocenter of a relative orbit with a = 1.
    let away = Vector3::new(1.0 + ECCENTRICITY, 0.0, 0.0);
    let speed = Vector3::new(
        0.0,
        (total * (1.0 - ECCENTRICITY) / (1.0 + ECCENTRICITY)).sqrt(),
        0.0,
    );
    let states = vec![
        moving(
            &bodies[0],
            -away * (LIGHT / total),
            -speed * (LIGHT / total),
        ),
        moving(&bodies[1], away / total, speed / total),
    ];
    let h = TAU / total.sqrt() / steps;
    under(Mutual::new(1.0), bodies, states, method, h)
}

/// By which parts of their first distances from the barycenter both miss their first places after whole periods, and by which of
/// the light one's mass times 1 the barycenter does.
fn misses(steps: u64, periods: u64) -> Result<[f64; 3], TrialError> {
    let method = Method::Nystrom { order: 8 };
    let mut simulation = simulation(method, steps as f64)?;
    let start = simulation.states().to_vec();
    fly(&mut simulation, steps * periods)?;
    let end = simulation.states();
    let missed = |body: usize| {
        (end[body].position - start[body].position).norm() / start[body].position.norm()
    };
    let barycenter = (end[0].position + LIGHT * end[1].position).norm() / LIGHT;
    Ok([missed(0), missed(1), barycenter])
}

fn orbit(length: Length) -> Result<Report, TrialError> {
    let periods = length.of(20, 100);
    let [_, coarse, _] = misses(50, periods)?;
    let [heavy, light, barycenter] = misses(100, periods)?;
    let kicks = (19 * 100 * periods) as f64;
    let walk = ULP * kicks.sqrt();
    let time = TAU * periods as f64;
    // The phase errs by 3/2 of the energy's relative error times the angle, that of a walk by 1/√3 of its last; the apocenter is
    // passed at a part of the mean rate.
    let rate = ((1.0 - ECCENTRICITY) / (1.0 + ECCENTRICITY)).sqrt() / (1.0 + ECCENTRICITY);
    let phase = rate * 1.5 * time * 8.0 * walk / 3.0_f64.sqrt();
    let bound = coarse / 128.0 + phase;
    let mut report = Report::default();
    report.shows("light one misses with 50 steps by", coarse);
    report.at_most("with 100", light, bound);
    report.at_most("heavy one, of its own way", heavy, bound);
    report.at_most(
        "barycenter, of the same",
        barycenter,
        ULP * time + 4.0 * walk,
    );
    Ok(report)
}

fn momenta(length: Length) -> Result<Report, TrialError> {
    let periods = length.of(1_000, 100_000);
    let mut simulation = simulation(LGVI, 200.0)?;
    let start = simulation.invariants();
    let light = simulation.states()[1].linear_momentum.norm();
    let mut errors = [0.0_f64; 2];
    let all = 200 * periods;
    while simulation.step() < all {
        fly(&mut simulation, 7)?;
        let half = &mut errors[usize::from(2 * simulation.step() > all)];
        keep(
            half,
            (simulation.invariants().energy / start.energy - 1.0).abs(),
        );
    }
    let end = simulation.invariants();
    let walk = ULP * (all as f64).sqrt();
    let mut report = Report::default();
    let linear = (end.linear_momentum - start.linear_momentum).norm() / light;
    report.at_most("linear momentum", linear, walk);
    let angular = end.angular_momentum - start.angular_momentum;
    let angular = angular.norm() / start.angular_momentum.norm();
    report.at_most("angular momentum", angular, 4.0 * walk);
    report.shows("energy error", errors[0]);
    report.within("second half to first", errors[1] / errors[0], [0.9, 1.1]);
    Ok(report)
}
