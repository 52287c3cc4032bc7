//! Rounding over many steps.

use lgvi_dynamics::Simulation;
use lgvi_truth::Case;
use lgvi_truth::random::Random;
use nalgebra::Vector3;

use crate::bodies::{LGVI, ULP, body, fly, free, keep, relative, turning};
use crate::fit::Spread;
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 4] = [
    Trial {
        name: "1e9 steps",
        done: "free asymmetric body (b1), `lgvi`, h = 0.01, 1e9 steps",
        right: "roundings of Π are a random walk: `|Π|²` errs by 1e-12 at most after 2e7 steps and by 2⁻⁵²√n after n; \
                R is relieved of its rounding at each step: `|RᵀR − I|` does not grow",
        run: many_steps,
    },
    Trial {
        name: "1e9 steps, direction",
        done: "the same flight",
        right: "roundings of R, too, are a random walk: the direction of `RΠ` errs by `4 × 2⁻⁵²√n` at most",
        run: direction,
    },
    Trial {
        name: "steady rotation",
        done: "a sphere, a body of revolution, and an asymmetric body about its greatest axis, `lgvi`, h = 0.01, 2e7 steps",
        right: "where each step is the last, roundings may repeat instead of cancelling: `|Π|²` errs by `2⁻⁵² n` at most",
        run: steady,
    },
    Trial {
        name: "spread of |Π|²",
        done: "64 free bodies with random momenta, `lgvi`, h = 0.01, 1e6 steps each",
        right: "the root mean square of the error of `|Π|²` grows as √n (Brouwer's law), not as n",
        run: spread,
    },
];

fn many_steps(length: Length) -> Result<Report, TrialError> {
    let (system, states) = Case::load("b1_free_asymmetric")?.system()?;
    let mut simulation = Simulation::new(system, states, LGVI, 0.01)?;
    let square = simulation.states()[0].angular_momentum.norm_squared();
    let error = |simulation: &Simulation| {
        (simulation.states()[0].angular_momentum.norm_squared() / square - 1.0).abs()
    };
    let (early, all) = length.of((200_000, 2_000_000), (20_000_000, 1_000_000_000));
    let mut report = Report::default();
    let mut orthogonality = 0.0_f64;
    while simulation.step() < all {
        fly(&mut simulation, 1000)?;
        keep(
            &mut orthogonality,
            simulation.invariants().orthogonality_error,
        );
        if simulation.step() == early {
            let what = format!("`|Π|²` error after {early:e} steps");
            report.at_most(what, error(&simulation), 1e-12);
        }
    }
    let walk = ULP * (all as f64).sqrt();
    report.at_most(format!("after {all:e}"), error(&simulation), walk);
    report.at_most("greatest `|RᵀR − I|`", orthogonality, 1e-12);
    Ok(report)
}

fn direction(length: Length) -> Result<Report, TrialError> {
    let (system, states) = Case::load("b1_free_asymmetric")?.system()?;
    let mut simulation = Simulation::new(system, states, LGVI, 0.01)?;
    let start = simulation.invariants().angular_momentum;
    let steps = length.of(2_000_000, 1_000_000_000);
    fly(&mut simulation, steps)?;
    let error = relative(&simulation.invariants().angular_momentum, &start);
    let walk = ULP * (steps as f64).sqrt();
    let mut report = Report::default();
    report.at_most(format!("after {steps:e} steps"), error, 4.0 * walk);
    Ok(report)
}

fn steady(length: Length) -> Result<Report, TrialError> {
    let steps = length.of(200_000, 20_000_000);
    let mut report = Report::default();
    let oblique = Vector3::new(1.0, 0.5, -0.75);
    for (name, moments, omega) in [
        ("sphere", [1.0; 3], oblique),
        ("body of revolution", [1.0, 1.0, 1.5], oblique),
        (
            "greatest axis",
            [1.0, 2.0, 3.0],
            Vector3::new(0.0, 0.0, 1.3),
        ),
    ] {
        let body = body(moments)?;
        let state = turning(&body, omega);
        let square = state.angular_momentum.norm_squared();
        let mut simulation = free(body, state, LGVI, 0.01)?;
        fly(&mut simulation, steps)?;
        let error = simulation.states()[0].angular_momentum.norm_squared() / square - 1.0;
        report.at_most(
            format!("{name}: `|Π|²` error"),
            error.abs(),
            ULP * steps as f64,
        );
    }
    Ok(report)
}

fn spread(length: Length) -> Result<Report, TrialError> {
    let mut spread = Spread::doubling(length.of(16_384, 1_048_576), length.of(6, 10));
    let body = body([1.0, 2.0, 3.0])?;
    for member in 0..64 {
        let mut random = Random::new(7, member);
        let omega: Vector3<f64> = random.normals();
        let state = turning(&body, omega);
        let square = state.angular_momentum.norm_squared();
        let mut simulation = free(body.clone(), state, LGVI, 0.01)?;
        let mut errors = Vec::new();
        for time in spread.times() {
            let steps = time - simulation.step();
            fly(&mut simulation, steps)?;
            errors.push(simulation.states()[0].angular_momentum.norm_squared() / square - 1.0);
        }
        spread.add(&errors);
    }
    let mut report = Report::default();
    report.within("exponent", spread.exponent(), [0.35, 0.65]);
    report.shows("root mean square at the end", spread.last());
    Ok(report)
}
