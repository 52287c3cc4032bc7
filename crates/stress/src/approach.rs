//! Close passages, with and without subdivision.

use lgvi_dynamics::gravity::Mutual;
use lgvi_dynamics::{BodyState, Load, Method, Simulation, StepError};
use lgvi_truth::Case;
use nalgebra::Vector3;

use crate::bodies::{LGVI, ULP, moving, sphere, under};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 3] = [
    Trial {
        name: "two dumbbells pass closely",
        done: "the bodies of a1 on an orbit of apocentre 6 and pericentre 0.6 (their arms reach 0.375 of it), `lgvi`, h = 0.05 and 0.025, \
               `subdivide` 12, 20 revolutions; and without",
        right: "passages are cut, what is far is not; momenta are kept to `2⁻⁵²√n` all the same; the energy error of the first passage \
                falls with the step and is less than a tenth of that without cuts",
        run: dumbbells,
    },
    Trial {
        name: "too close for the cuts allowed",
        done: "the same with `subdivide` 1",
        right: "a typed error, `unresolved`, and the state of before the step to the last bit",
        run: unresolved,
    },
    Trial {
        name: "head on",
        done: "two spheres at rest fall on each other: points with `subdivide` 20; with radii, with and without cuts; points by Dormand and Prince's",
        right: "each ends in a typed error (unresolved, not finite, close approach, step-size underflow), its state finite and that \
                of before the step",
        run: head_on,
    },
];

const CONTROLS: [Load; 2] = [Load {
    force: Vector3::new(0.0, 0.0, 0.0),
    moment: Vector3::new(0.0, 0.0, 0.0),
}; 2];

/// The bodies of a1, with their attitudes and spins, at the apocentre of another orbit.
fn passing(h: f64) -> Result<(Simulation, f64), TrialError> {
    let (system, mut states) = Case::load("a1_two_dumbbells_regular")?.system()?;
    let (apocentre, pericentre) = (6.0, 0.6);
    let masses = [system.bodies()[0].mass(), system.bodies()[1].mass()];
    let total = masses[0] + masses[1];
    let axis = 0.5 * (apocentre + pericentre);
    let speed = (total * (2.0 / apocentre - 1.0 / axis)).sqrt();
    let period = std::f64::consts::TAU * (axis * axis * axis / total).sqrt();
    for (state, share) in states.iter_mut().zip([masses[1] / total, -masses[0] / total]) {
        state.position = Vector3::new(share * apocentre, 0.0, 0.0);
    }
    let momentum = Vector3::new(0.0, 0.9, 0.3).normalize() * (speed * masses[0] * masses[1] / total);
    states[0].linear_momentum = momentum;
    states[1].linear_momentum = -momentum;
    Ok((Simulation::new(system, states, LGVI, h)?, period))
}

fn energy_error(simulation: &Simulation, energy: f64) -> f64 {
    (simulation.invariants().energy / energy - 1.0).abs()
}

fn dumbbells(length: Length) -> Result<Report, TrialError> {
    let revolutions = length.of(2.0, 20.0);
    let mut report = Report::default();
    let mut first = Vec::new();
    for (h, depth) in [(0.05, 0), (0.05, 12), (0.025, 12)] {
        let (simulation, period) = passing(h)?;
        let mut simulation = simulation.with_subdivision(depth)?;
        // Without cuts a step may not resolve the motion and is refused: `depth` 0 is no subdivision at all.
        if depth == 0 {
            simulation = passing(h)?.0;
        }
        let start = simulation.invariants();
        let steps = (revolutions * period / h) as u64;
        let once = (period / h) as u64;
        let (mut cut, mut pieces) = (0_u32, 0_u64);
        for step in 0..steps {
            let cuts = simulation.advance(&CONTROLS)?.cuts;
            cut += u32::from(cuts > 1);
            pieces += u64::from(cuts.max(1));
            if step == once {
                first.push(energy_error(&simulation, start.energy));
            }
        }
        if depth == 0 {
            continue;
        }
        let end = simulation.invariants();
        let walk = ULP * (pieces as f64).sqrt();
        let linear = (end.linear_momentum - start.linear_momentum).norm();
        report.at_most(format!("h {h}: linear momentum"), linear, 8.0 * walk);
        let angular = (end.angular_momentum - start.angular_momentum).norm();
        report.at_most("angular", angular / start.angular_momentum.norm(), 8.0 * walk);
        report.within("share of steps cut", f64::from(cut) / steps as f64, [0.001, 0.5]);
        report.shows("pieces a step", pieces as f64 / steps as f64);
        report.shows("energy error at the end", energy_error(&simulation, start.energy));
    }
    report.shows("energy error of the first passage without cuts", first[0]);
    report.at_most("with", first[1], 0.1 * first[0]);
    report.at_most("of half the step", first[2], first[1]);
    Ok(report)
}

fn unresolved(_: Length) -> Result<Report, TrialError> {
    let (simulation, period) = passing(0.05)?;
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
        Ok(vec![sphere(1.0)?.with_radius(radius)?, sphere(1.0)?.with_radius(radius)?])
    };
    let falling = |radius, method, h| -> Result<Simulation, TrialError> {
        let bodies = spheres(radius)?;
        let at = |body, x| moving(body, Vector3::new(x, 0.0, 0.0), Vector3::zeros());
        let states = vec![at(&bodies[0], 0.5), at(&bodies[1], -0.5)];
        under(Mutual::new(1.0), bodies, states, method, h)
    };
    let adaptive = Method::DormandPrince853 { tolerance: 1e-10 };
    let mut report = Report::default();
    // The points meet after π/4: a step of a 64th of that ends there.
    let to_the_point = std::f64::consts::FRAC_PI_4 / 64.0;
    for (name, simulation, expected) in [
        ("points cut", falling(0.0, LGVI, to_the_point)?.with_subdivision(20)?, ["unresolved", "not finite"]),
        ("with radii", falling(0.1, LGVI, to_the_point)?, ["close approach"; 2]),
        ("with radii, cut", falling(0.1, LGVI, to_the_point)?.with_subdivision(20)?, ["close approach"; 2]),
        ("Dormand–Prince", falling(0.0, adaptive, to_the_point)?, ["underflow", "not finite"]),
    ] {
        let found = ending(simulation);
        let right = found.is_some_and(|(kind, kept)| kept && expected.contains(&kind));
        report.within(format!("{name}: refused as it should be"), f64::from(right), [1.0; 2]);
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
