//! Growth of the energy error with time.

use std::f64::consts::TAU;

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Method, Simulation};
use lgvi_truth::Case;
use lgvi_truth::random::Random;
use nalgebra::Vector3;

use crate::bodies::{LGVI, fly, keep, moving, sphere, under};
use crate::fit::{Spread, exponent};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 5] = [
    Trial {
        name: "bounded, 1e7 orbits",
        done: "sphere in a central field, eccentricity 0.3, `lgvi`, 30 steps an orbit, 1e7 orbits (3e8 steps)",
        right: "the greatest error in each doubling of time stays what it is: its exponent of growth is 0",
        run: bounded,
    },
    Trial {
        name: "bounded, high order",
        done: "the same orbit, 40 steps an orbit, 1e5 orbits, by compositions of order 4 and 8 and Nyström of order 8",
        right: "as above",
        run: high_order,
    },
    Trial {
        name: "bounded, orbit and rotation coupled",
        done: "dumbbell on an eccentric orbit (d), `lgvi`, h = 0.02, 1e8 steps (3e5 orbits)",
        right: "as above",
        run: coupled,
    },
    Trial {
        name: "not symplectic",
        done: "the orbit of eccentricity 0.3 by Runge–Kutta 4, 100 steps an orbit, 5000 orbits",
        right: "the error grows as time: a bounded one is not an artefact of how it is measured",
        run: not_symplectic,
    },
    Trial {
        name: "rounding",
        done: "64 spheres on discrete circular orbits (`v² = 1/r − h²/4r⁴`), where truncation errs by a constant, `lgvi`, about 30 \
               steps an orbit, 5e4 orbits each",
        right: "the root mean square of the energy error grows as √t (Brouwer's law), not as t",
        run: rounding,
    },
];

/// A sphere in the field of a mass 1, from the pericentre of an orbit with a = 1.
fn kepler(eccentricity: f64, method: Method, steps: u64) -> Result<Simulation, TrialError> {
    let body = sphere(1.0)?;
    let speed = ((1.0 + eccentricity) / (1.0 - eccentricity)).sqrt();
    let position = Vector3::new(1.0 - eccentricity, 0.0, 0.0);
    let state = moving(&body, position, Vector3::new(0.0, speed, 0.0));
    under(
        Central { gm: 1.0 },
        vec![body],
        vec![state],
        method,
        TAU / steps as f64,
    )
}

/// The greatest relative energy error in each doubling of time: its exponent and the greatest of all.
fn growth(mut simulation: Simulation, first: u64, all: u64) -> Result<[f64; 2], TrialError> {
    // Samples fall on all phases of an orbit in turn.
    let between = 7;
    let energy = simulation.invariants().energy;
    let mut blocks = Vec::new();
    let (mut begin, mut end) = (0, first);
    while begin < all {
        let mut greatest = 0.0_f64;
        while simulation.step() < end.min(all) {
            fly(&mut simulation, between)?;
            keep(
                &mut greatest,
                (simulation.invariants().energy / energy - 1.0).abs(),
            );
        }
        // A last one that is cut short says less.
        if end <= all {
            blocks.push([end as f64, greatest]);
        }
        (begin, end) = (end, 2 * end);
    }
    let mut greatest = 0.0;
    for block in &blocks {
        keep(&mut greatest, block[1]);
    }
    Ok([exponent(&blocks), greatest])
}

fn bounded(length: Length) -> Result<Report, TrialError> {
    let steps = 30;
    let orbits = length.of(1 << 13, 10_000_000);
    let [exponent, greatest] = growth(kepler(0.3, LGVI, steps)?, 128 * steps, orbits * steps)?;
    let mut report = Report::default();
    report.within("exponent", exponent, [-0.02, 0.02]);
    report.shows("greatest error", greatest);
    Ok(report)
}

fn high_order(length: Length) -> Result<Report, TrialError> {
    let steps = 40;
    let orbits = length.of(1 << 9, 100_000);
    let rotor = Rotor::Exact;
    let methods = [
        Method::Composition { order: 4, rotor },
        Method::Composition { order: 8, rotor },
        Method::Nystrom { order: 8, rotor },
    ];
    let mut report = Report::default();
    for method in methods {
        let flight = kepler(0.3, method, steps)?;
        let [exponent, greatest] = growth(flight, 32 * steps, orbits * steps)?;
        report.within(format!("{method}: exponent"), exponent, [-0.05, 0.05]);
        report.shows("greatest error", greatest);
    }
    Ok(report)
}

fn coupled(length: Length) -> Result<Report, TrialError> {
    let (system, states) = Case::load("d_dumbbell_central")?.system()?;
    let simulation = Simulation::new(system, states, LGVI, 0.02)?;
    let all = length.of(1 << 18, 100_000_000);
    let [exponent, greatest] = growth(simulation, 1 << 13, all)?;
    let mut report = Report::default();
    report.within("exponent", exponent, [-0.05, 0.05]);
    report.shows("greatest error", greatest);
    Ok(report)
}

fn not_symplectic(length: Length) -> Result<Report, TrialError> {
    let steps = 100;
    let orbits = length.of(600, 5_000);
    let flight = kepler(0.3, Method::RungeKutta4, steps)?;
    let [exponent, greatest] = growth(flight, 8 * steps, orbits * steps)?;
    let mut report = Report::default();
    report.within("exponent", exponent, [0.9, 1.1]);
    report.shows("greatest error", greatest);
    Ok(report)
}

fn rounding(length: Length) -> Result<Report, TrialError> {
    let mut spread = Spread::doubling(length.of(1 << 14, 1_500_000), length.of(6, 10));
    let body = sphere(1.0)?;
    for member in 0..64 {
        let mut random = Random::new(17, member);
        let radius = random.uniform(0.9, 1.1);
        let h = random.uniform(0.19, 0.21);
        // A step of the leapfrog turns position and momentum by the same angle.
        let speed = (1.0 / radius - h * h / (4.0 * f64::powi(radius, 4))).sqrt();
        let frame = random.rotation();
        let state = moving(&body, frame.column(0) * radius, frame.column(1) * speed);
        let field = Central { gm: 1.0 };
        let mut simulation = under(field, vec![body.clone()], vec![state], LGVI, h)?;
        let energy = simulation.invariants().energy;
        let mut errors = Vec::new();
        for time in spread.times() {
            let steps = time - simulation.step();
            fly(&mut simulation, steps)?;
            errors.push(simulation.invariants().energy / energy - 1.0);
        }
        spread.add(&errors);
    }
    let mut report = Report::default();
    report.within("exponent", spread.exponent(), [0.35, 0.65]);
    report.shows("root mean square at the end", spread.last());
    Ok(report)
}
