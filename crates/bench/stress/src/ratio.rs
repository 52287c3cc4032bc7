//! Bodies whose masses differ by twelve orders.

use std::f64::consts::TAU;

use lgvi_dynamics::gravity::Mutual;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Method, Simulation};
use nalgebra::Vector3;

use crate::bodies::{LGVI, ULP, fly, keep, moving, sphere, under};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 2] = [
    Trial {
        name: "mass ratio 1e-12, orbit",
        done: "two spheres of mass 1 and 1e-12, free, eccentricity 0.5, about their barycentre; Nyström of order 8, 100 steps \
               a period, to 100 periods",
        right: "after whole periods of `2π√(a³/G(M + m))` both are where they began, the heavy one to the same part of its own \
                way, 1e-12 of the light one's; the barycentre rests",
        run: orbit,
    },
    Trial {
        name: "mass ratio 1e-12, momenta",
        done: "the same by `lgvi`, 200 steps a period, 1e5 periods",
        right: "total linear and angular momentum are kept to `2⁻⁵²√n` of the light body's; the energy error, of second order, \
                is bounded",
        run: momenta,
    },
];

const LIGHT: f64 = 1e-12;
const ECCENTRICITY: f64 = 0.5;

/// With a number of steps a period.
fn simulation(method: Method, steps: f64) -> Result<Simulation, TrialError> {
    let bodies = vec![sphere(1.0)?, sphere(LIGHT)?];
    let total = 1.0 + LIGHT;
    // At the apocentre of a relative orbit with a = 1.
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

fn orbit(length: Length) -> Result<Report, TrialError> {
    let method = Method::Nystrom {
        order: 8,
        rotor: Rotor::Exact,
    };
    let periods = length.of(20, 100);
    let mut simulation = simulation(method, 100.0)?;
    let start = simulation.states().to_vec();
    fly(&mut simulation, 100 * periods)?;
    let end = simulation.states();
    let missed = |body: usize| {
        (end[body].position - start[body].position).norm() / start[body].position.norm()
    };
    let barycentre = (end[0].position + LIGHT * end[1].position).norm() / LIGHT;
    let mut report = Report::default();
    report.at_most("light one misses by", missed(1), 1e-8);
    report.at_most("heavy one, of its own way", missed(0), 1e-8);
    report.at_most("barycentre, of the same", barycentre, 1e-11);
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
