//! Close passages, with and without subdivision.

use lgvi_dynamics::gravity::Mutual;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Load, Method, Simulation, StepError};
use lgvi_truth::Case;
use nalgebra::Vector3;

use crate::bodies::{LGVI, ULP, keep, moving, sphere, under};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 4] = [
    Trial {
        name: "a close passage",
        done: "the bodies of a1, turning a tenth as fast, on an orbit of apocenter 6 and pericenter 1 (their arms reach over 0.375 of it), \
               `lgvi` with the exact rotor, one revolution: h = 0.2; and with `subdivide` 12, h = 0.2 and 0.05",
        right: "the passage is cut, the rest is not; momenta are kept to `6 × 2⁻⁵²√n` all the same: three standard deviations of 12 \
                roundings a piece, with terms of twice the sum; cuts, which at least halve a step of second order, lower the greatest energy \
                error to a quarter at most; the smaller step, whose pieces are no longer, does not raise it; to a fifth and a half where \
                the revolution ends is an allowance, for errors of any phase of the passage",
        run: passage,
    },
    Trial {
        name: "twenty passages",
        done: "the same with pericenter 1.3, h = 0.1, `subdivide` 12, 20 revolutions",
        right: "momenta as above; the energy error need not stay bounded, for the length of the steps varies: it is that of the \
                passages, one after the other, at most as many times that of the first",
        run: passages,
    },
    Trial {
        name: "too close for the cuts allowed",
        done: "the passage at pericenter 1 with h = 0.4 and `subdivide` 1",
        right: "a typed error, `unresolved`, and the state of before the step to the last bit",
        run: unresolved,
    },
    Trial {
        name: "head on",
        done: "two spheres at rest fall on each other: points with `subdivide` 20; with radii, with and without cuts; points by Dormand and Prince's and by Taylor series",
        right: "each ends in a typed error (unresolved, not finite, close approach, step-size underflow), its state finite and that \
                of before the step",
        run: head_on,
    },
];

const CONTROLS: [Load; 2] = [Load {
    force: Vector3::new(0.0, 0.0, 0.0),
    moment: Vector3::new(0.0, 0.0, 0.0),
}; 2];

/// The bodies of a1, turning a tenth as fast, at the apocenter of another orbit; its period.
fn passing(pericenter: f64, h: f64) -> Result<(Simulation, f64), TrialError> {
    let (system, mut states) = Case::load("a1_two_dumbbells_regular")?.system()?;
    let apocenter = 6.0;
    let masses = [system.bodies()[0].mass(), system.bodies()[1].mass()];
    let total = masses[0] + masses[1];
    let axis = 0.5 * (apocenter + pericenter);
    let speed = (total * (2.0 / apocenter - 1.0 / axis)).sqrt();
    let period = std::f64::consts::TAU * (axis * axis * axis / total).sqrt();
    let direction = Vector3::new(0.0, 0.9, 0.3).normalize();
    let momentum = direction * (speed * masses[0] * masses[1] / total);
    let shares = [masses[1] / total, -masses[0] / total];
    for ((state, share), sign) in states.iter_mut().zip(shares).zip([1.0, -1.0]) {
        state.position = Vector3::new(share * apocenter, 0.0, 0.0);
        state.linear_momentum = sign * momentum;
        state.angular_momentum *= 0.1;
    }
    let method = Method::Lgvi(Rotor::Exact);
    Ok((Simulation::new(system, states, method, h)?, period))
}

/// What has become of a flight over some revolutions.
struct Flown {
    steps: u64,
    /// Steps that were cut.
    cut: u64,
    energy: f64,
    /// The greatest energy error on the way, and that of the first revolution.
    greatest: [f64; 2],
    /// Change of the total momenta, in units of `2⁻⁵²√n`.
    linear: f64,
    angular: f64,
}

fn revolve(mut simulation: Simulation, period: f64, revolutions: u32) -> Result<Flown, TrialError> {
    let start = simulation.invariants();
    let (mut cut, mut pieces) = (0, 0_u64);
    let mut greatest = [0.0; 2];
    while simulation.time() < period * f64::from(revolutions) {
        let cuts = simulation.advance(&CONTROLS)?.cuts;
        cut += u64::from(cuts > 1);
        pieces += u64::from(cuts.max(1));
        let error = energy_error(&simulation, start.energy);
        keep(&mut greatest[0], error);
        if simulation.time() < period {
            keep(&mut greatest[1], error);
        }
    }
    let end = simulation.invariants();
    let walk = ULP * (pieces as f64).sqrt();
    let angular = end.angular_momentum - start.angular_momentum;
    Ok(Flown {
        steps: simulation.step(),
        cut,
        energy: energy_error(&simulation, start.energy),
        greatest,
        linear: (end.linear_momentum - start.linear_momentum).norm() / walk,
        angular: angular.norm() / start.angular_momentum.norm() / walk,
    })
}

fn energy_error(simulation: &Simulation, energy: f64) -> f64 {
    (simulation.invariants().energy / energy - 1.0).abs()
}

fn passage(_: Length) -> Result<Report, TrialError> {
    let fly = |h, depth| {
        let (simulation, period) = passing(1.0, h)?;
        let simulation = match depth {
            0 => simulation,
            depth => simulation.with_subdivision(depth)?,
        };
        revolve(simulation, period, 1)
    };
    let (whole, cut, finer) = (fly(0.2, 0)?, fly(0.2, 12)?, fly(0.05, 12)?);
    let mut report = Report::default();
    report.shows("energy error at the end, uncut", whole.energy);
    report.at_most("cut", cut.energy, 0.2 * whole.energy);
    report.at_most("h = 0.05", finer.energy, 0.5 * cut.energy);
    report.shows("greatest on the way, uncut", whole.greatest[0]);
    report.at_most("cut", cut.greatest[0], 0.25 * whole.greatest[0]);
    report.at_most("h = 0.05", finer.greatest[0], cut.greatest[0]);
    report.within(
        "share of steps cut",
        cut.cut as f64 / cut.steps as f64,
        [0.01, 0.7],
    );
    report.at_most("linear momentum in 2⁻⁵²√n", cut.linear, 6.0);
    report.at_most("angular", cut.angular, 6.0);
    Ok(report)
}

fn passages(length: Length) -> Result<Report, TrialError> {
    let revolutions = length.of(4, 20);
    let (simulation, period) = passing(1.3, 0.1)?;
    let flown = revolve(simulation.with_subdivision(12)?, period, revolutions)?;
    let mut report = Report::default();
    let [greatest, first] = flown.greatest;
    report.shows("greatest energy error of the first revolution", first);
    report.at_most("of all", greatest, f64::from(revolutions) * first);
    report.shows("at the end", flown.energy);
    report.within(
        "share of steps cut",
        flown.cut as f64 / flown.steps as f64,
        [0.01, 0.7],
    );
    report.at_most("linear momentum in 2⁻⁵²√n", flown.linear, 6.0);
    report.at_most("angular", flown.angular, 6.0);
    Ok(report)
}

fn unresolved(_: Length) -> Result<Report, TrialError> {
    let (simulation, period) = passing(1.0, 0.4)?;
    let mut simulation = simulation.with_subdivision(1)?;
    let mut report = Report::default();
    let (mut kind, mut changed) = (0.0, 1.0);
    while simulation.time() < period {
        let before = simulation.states().to_vec();
        if let Err(error) = simulation.advance(&CONTROLS) {
            kind = f64::from(matches!(error, StepError::Unresolved { excess, .. } if excess > 1.0));
            changed = f64::from(simulation.states() != before);
            break;
        }
    }
    report.within("refused as unresolved", kind, [1.0; 2]);
    report.within("states changed", changed, [0.0; 2]);
    Ok(report)
}

fn head_on(_: Length) -> Result<Report, TrialError> {
    let spheres = |radius: f64| -> Result<Vec<_>, TrialError> {
        Ok(vec![
            sphere(1.0)?.with_radius(radius)?,
            sphere(1.0)?.with_radius(radius)?,
        ])
    };
    let falling = |radius, method, h| -> Result<Simulation, TrialError> {
        let bodies = spheres(radius)?;
        let at = |body, x| moving(body, Vector3::new(x, 0.0, 0.0), Vector3::zeros());
        let states = vec![at(&bodies[0], 0.5), at(&bodies[1], -0.5)];
        under(Mutual::new(1.0), bodies, states, method, h)
    };
    let tolerance = 1e-10;
    let [dormand_prince, taylor] = [
        Method::DormandPrince853 { tolerance },
        Method::Taylor { tolerance },
    ];
    let mut report = Report::default();
    // The points meet after π/4: a step of a 64th of that ends there.
    let to_the_point = std::f64::consts::FRAC_PI_4 / 64.0;
    for (name, simulation, expected) in [
        (
            "points cut",
            falling(0.0, LGVI, to_the_point)?.with_subdivision(20)?,
            ["unresolved", "not finite"],
        ),
        (
            "with radii",
            falling(0.1, LGVI, to_the_point)?,
            ["close approach"; 2],
        ),
        (
            "with radii, cut",
            falling(0.1, LGVI, to_the_point)?.with_subdivision(20)?,
            ["close approach"; 2],
        ),
        (
            "Dormand–Prince",
            falling(0.0, dormand_prince, to_the_point)?,
            ["underflow", "not finite"],
        ),
        (
            "Taylor",
            falling(0.0, taylor, to_the_point)?,
            ["underflow", "not finite"],
        ),
    ] {
        let found = ending(simulation);
        let right = found.is_some_and(|(kind, kept)| kept && expected.contains(&kind));
        report.within(
            format!("{name}: refused as it should be"),
            f64::from(right),
            [1.0; 2],
        );
    }
    Ok(report)
}

/// The error that a fall ends with, and whether it left a finite state as it was; none where it goes through.
fn ending(mut simulation: Simulation) -> Option<(&'static str, bool)> {
    for _ in 0..1000 {
        let before: Vec<BodyState> = simulation.states().to_vec();
        if let Err(error) = simulation.advance(&CONTROLS) {
            let kind = match error {
                StepError::Unresolved { .. } => "unresolved",
                StepError::NotFinite { .. } => "not finite",
                StepError::CloseApproach(_) => "close approach",
                StepError::StepSizeUnderflow { .. } => "underflow",
                _ => "another",
            };
            let kept = simulation.states() == before && before.iter().all(BodyState::is_finite);
            return Some((kind, kept));
        }
    }
    None
}
