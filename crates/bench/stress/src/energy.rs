//! Growth of the energy error with time.

use std::f64::consts::TAU;

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{Method, Simulation};
use lgvi_truth::Case;
use lgvi_truth::random::Random;
use nalgebra::Vector3;

use crate::bodies::{LGVI, ULP, fly, moving, sphere, under};
use crate::fit::{Drift, Spread};
use crate::modified::ModifiedEnergy;
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 5] = [
    Trial {
        name: "bounded, 1e7 orbits",
        done: "sphere in a central field, eccentricity 0.3, `lgvi`, 30 steps an orbit, 1e7 orbits (3e8 steps)",
        right: "the discrete orbit keeps a modified energy, and the error of the energy is a function of its phase: its mean over the last \
                quarter of the time is that over the first, but for roundings, a random walk of `8 × 2⁻⁵²√n` at most: three standard \
                deviations of 12 roundings a step, at kinetic and potential energies of up to 4.7 times the total (means are weighted by \
                `exp(−1/(s(1 − s)))` over the time s of a quarter, from 0 to 1; the drift is that of a straight line)",
        run: bounded,
    },
    Trial {
        name: "bounded, high order",
        done: "the same orbit, 1e5 orbits, by a composition of order 4 with 40 steps an orbit, one of order 8 and Nyström's of order 8 with \
               20",
        right: "as above, n the number of kicks: 5, 21 and 19 a step",
        run: high_order,
    },
    Trial {
        name: "bounded, orbit and rotation coupled",
        done: "dumbbell on an eccentric orbit (d), `lgvi`, 1e8 steps of h = 0.02 (3e5 orbits) and as many of h = 0.01",
        right: "the motion is on no single phase: it may reach new states, and the error of the energy new sizes, for ever. What is kept is \
                the modified energy, `H + h²[V̈/12 − (|F|²/m + MᵀJ⁻¹M)/24 + (e₁T² − e₂TC + e₃C²)/6] + O(h⁴)`: the error of that is of \
                fourth order, and its mean over the last quarter of the time is that over the first to a 16th of its size, an allowance \
                for what means over a quarter of the time differ by",
        run: coupled,
    },
    Trial {
        name: "not symplectic",
        done: "the orbit of eccentricity 0.3 by Runge–Kutta 4, 100 steps an orbit, 5000 orbits",
        right: "the error grows as time, the drift is most of it, and it is a thousand times the bound above: a bounded one is not an \
                artifact of how it is measured",
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

/// A sphere in the field of a mass 1, from the pericenter of an orbit with a = 1.
///
/// An orbit has 0.618… steps more than the whole number given: samples and overtones fall into no step with each other.
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
        TAU / (steps as f64 + 0.5 * (5.0_f64.sqrt() - 1.0)),
    )
}

/// The relative energy error over the four quarters of a flight.
fn drift(mut simulation: Simulation, all: u64) -> Result<Drift, TrialError> {
    let energy = simulation.invariants().energy;
    let [drift] = Drift::of(all / (4 * BETWEEN), || {
        fly(&mut simulation, BETWEEN)?;
        Ok::<_, TrialError>([simulation.invariants().energy / energy - 1.0])
    })?;
    Ok(drift)
}

/// Steps from sample to sample, which so fall on all phases of an orbit in turn.
const BETWEEN: u64 = 7;

/// What roundings may move the energy by: three standard deviations of a walk in which each kick and drift rounds six components
/// twice, `2⁻⁵³/√3` each, where kinetic and potential energy are up to 4.7 times the total.
fn walk(kicks: u64) -> f64 {
    8.0 * ULP * (kicks as f64).sqrt()
}

fn tell(report: &mut Report, drift: &Drift, bound: f64) {
    report.at_most("drift of the mean", drift.secular(), bound);
    report.shows("greatest error", drift.greatest());
    report.shows("last quarter's to first's", drift.last_to_first());
}

fn bounded(length: Length) -> Result<Report, TrialError> {
    let steps = 30;
    let all = length.of(1 << 13, 10_000_000) * steps;
    let mut report = Report::default();
    tell(
        &mut report,
        &drift(kepler(0.3, LGVI, steps)?, all)?,
        walk(all),
    );
    Ok(report)
}

fn high_order(length: Length) -> Result<Report, TrialError> {
    let orbits = length.of(1 << 12, 100_000);
    let rotor = Rotor::Exact;
    let mut report = Report::default();
    for (method, steps, kicks) in [
        (Method::Composition { order: 4, rotor }, 40, 5),
        (Method::Composition { order: 8, rotor }, 20, 21),
        (Method::Nystrom { order: 8 }, 20, 19),
    ] {
        let all = orbits * steps;
        let drift = drift(kepler(0.3, method, steps)?, all)?;
        report.shows(format!("{method}: orbits"), orbits as f64);
        tell(&mut report, &drift, walk(kicks * all));
    }
    Ok(report)
}

/// The relative errors of energy and modified energy.
fn coupled_drift(h: f64, all: u64) -> Result<[Drift; 2], TrialError> {
    let case = Case::load("d_dumbbell_central")?;
    let (system, states) = case.system()?;
    let mut modified = ModifiedEnergy::new(case.system()?.0, h);
    let mut simulation = Simulation::new(system, states, LGVI, h)?;
    let energy = simulation.invariants().energy;
    let begun = energy + modified.excess(simulation.states());
    // The modified energy costs as much as several steps.
    let between = 5 * BETWEEN;
    Drift::of(all / (4 * between), || {
        fly(&mut simulation, between)?;
        let energy_now = simulation.invariants().energy;
        let kept = energy_now + modified.excess(simulation.states());
        Ok([energy_now / energy - 1.0, kept / begun - 1.0])
    })
}

fn coupled(length: Length) -> Result<Report, TrialError> {
    let all = length.of(1 << 18, 100_000_000);
    let [plain, modified] = coupled_drift(0.02, all)?;
    let [_, half] = coupled_drift(0.01, all)?;
    let sizes = [&modified, &half].map(Drift::greatest);
    let mut report = Report::default();
    report.shows("greatest error of the energy", plain.greatest());
    report.shows("last quarter's to first's", plain.last_to_first());
    report.shows("drift of its mean", plain.secular());
    report.shows("greatest error of the modified energy", sizes[0]);
    report.within(
        "order with h = 0.01",
        (sizes[0] / sizes[1]).log2(),
        [3.5, 4.5],
    );
    report.at_most("drift of its mean", modified.secular(), sizes[1]);
    report.at_most("with h = 0.01", half.secular(), sizes[1] / 16.0);
    Ok(report)
}

fn not_symplectic(length: Length) -> Result<Report, TrialError> {
    let steps = 100;
    let all = length.of(600, 5_000) * steps;
    let drift = drift(kepler(0.3, Method::RungeKutta4, steps)?, all)?;
    let mut report = Report::default();
    report.within(
        "drift of the mean to the greatest error",
        drift.secular() / drift.greatest(),
        [0.9, 1.1],
    );
    report.at_most(
        "bound of the others to it",
        walk(all) / drift.secular(),
        1e-3,
    );
    report.shows("greatest error", drift.greatest());
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
