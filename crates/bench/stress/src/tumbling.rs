//! Tumbling about the middle axis, in closed form and in steps.

use std::f64::consts::PI;

use lgvi_dynamics::rotation::FreeRotation;
use lgvi_dynamics::{BodyState, Inertia, Simulation, System};
use lgvi_truth::Case;
use nalgebra::{Matrix3, Vector3};

use crate::bodies::{LGVI, ULP, fly, keep, relative};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 2] = [
    Trial {
        name: "1e9 s in closed form",
        done: "tumbling about the middle axis (b2), `closed_form`, one step of 1e9 s; one back; one of what 1e9 s leaves over \
               a whole number of periods, by the arithmetic-geometric mean; and a regular body (b1) in one step and in a \
               thousand of 1e6 s",
        right: "Π goes round on the period of Jacobi's functions, `RΠ` and the energy are those of the start, and all ways \
                lead to one place: within the rounding of the phase, `2⁻⁵² |Ω| t` each; n leaps, which round Π n times, within √n times \
                that",
        run: closed_form,
    },
    Trial {
        name: "1e8 steps",
        done: "the same body, `lgvi`, h = 0.01, 1e8 steps",
        right: "it turns over twice a period for ever; the discrete rigid body has the integrals of the continuous one, `|Π|²` and \
                the energy: they err by roundings alone, `2⁻⁵²√n` and four times that",
        run: steps,
    },
];

fn tumbling() -> Result<(System, Vec<BodyState>), TrialError> {
    Ok(Case::load("b2_dzhanibekov")?.system()?)
}

/// The period of Π in the body frame: `4 K(m)/λ`, with `K = π/(2 agm(1, √(1 − m)))`.
fn period(moments: [f64; 3], pi: &Vector3<f64>) -> f64 {
    let [a, b, c] = moments;
    let square = pi.norm_squared();
    let twice_energy = pi.component_div(&Vector3::from(moments)).dot(pi);
    // About the axis of the greatest moment or that of the least.
    let (near, far) = if square > twice_energy * b {
        (a, c)
    } else {
        (c, a)
    };
    // `G² − 2E J₂ = Σ Πᵢ² (1 − J₂/Jᵢ)`, in which nothing cancels but what must.
    let apart: f64 = [(pi.x, a), (pi.z, c)]
        .map(|(pi, j)| pi * pi * (j - b) / j)
        .iter()
        .sum();
    let rate = (far - b) * (square - twice_energy * near) / (a * b * c);
    let complement = apart * (far - near) / ((far - b) * (square - twice_energy * near));
    let (mut mean, mut geometric) = (1.0, complement.sqrt());
    while (mean - geometric).abs() > ULP * mean {
        (mean, geometric) = (0.5 * (mean + geometric), (mean * geometric).sqrt());
    }
    2.0 * PI / ((mean + geometric) * rate.sqrt()) * 2.0
}

fn closed_form(length: Length) -> Result<Report, TrialError> {
    let (system, states) = tumbling()?;
    let inertia = system.bodies()[0].inertia();
    let start = states[0].angular_momentum;
    let moments: [f64; 3] = inertia.matrix().diagonal().into();
    let flow = FreeRotation::new(inertia);
    let t = 1e9;
    let (turn, end) = flow.flow(&start, t);
    let turn = turn.matrix();

    let mut report = Report::default();
    report.at_most("`RΠ`", relative(&(turn * end), &start), 16.0 * ULP);
    report.at_most(
        "energy",
        (energy(inertia, &end) / energy(inertia, &start) - 1.0).abs(),
        16.0 * ULP,
    );
    let phase = ULP * start.norm() / moments[1] * t;
    let left = t % period(moments, &start);
    let (_, over) = flow.flow(&start, left);
    report.at_most("Π beside whole periods", relative(&end, &over), 4.0 * phase);
    let (back, begun) = flow.flow(&end, -t);
    let way = (turn * back.matrix() - Matrix3::identity()).norm();
    report.at_most(
        "there and back",
        way + relative(&begun, &start),
        4.0 * phase,
    );

    let (system, states) = Case::load("b1_free_asymmetric")?.system()?;
    let flow = FreeRotation::new(system.bodies()[0].inertia());
    let leaps = length.of(100, 1000);
    let (whole, _) = flow.flow(&states[0].angular_momentum, t);
    let (mut r, mut pi) = (Matrix3::identity(), states[0].angular_momentum);
    for _ in 0..leaps {
        let (turn, next) = flow.flow(&pi, t / f64::from(leaps));
        (r, pi) = (r * turn.matrix(), next);
    }
    let phase = ULP * 1.35 * t * f64::from(leaps).sqrt();
    let apart = (r - whole.matrix()).norm();
    report.at_most(format!("b1, R beside {leaps} leaps"), apart, 4.0 * phase);
    Ok(report)
}

fn energy(inertia: &Inertia, pi: &Vector3<f64>) -> f64 {
    0.5 * pi.dot(&(inertia.inverse() * pi))
}

fn steps(length: Length) -> Result<Report, TrialError> {
    let (system, states) = tumbling()?;
    let moments: [f64; 3] = system.bodies()[0].inertia().matrix().diagonal().into();
    let start = states[0].angular_momentum;
    let (h, look) = (0.01, 20);
    let all = length.of(1_000_000, 100_000_000);
    let mut simulation = Simulation::new(system, states, LGVI, h)?;
    let energy = simulation.invariants().energy;
    let (mut error, mut flips, mut side) = (0.0_f64, 0_u64, true);
    while simulation.step() < all {
        fly(&mut simulation, look)?;
        keep(
            &mut error,
            (simulation.invariants().energy / energy - 1.0).abs(),
        );
        let now = simulation.states()[0].angular_momentum.y > 0.0;
        flips += u64::from(now != side);
        side = now;
    }
    let mut report = Report::default();
    let expected = 2.0 * all as f64 * h / period(moments, &start);
    report.within(
        "flips to those of the exact flow",
        flips as f64 / expected,
        [0.999, 1.001],
    );
    report.shows("flips", flips as f64);
    let end = simulation.states()[0].angular_momentum;
    let square = (end.norm_squared() / start.norm_squared() - 1.0).abs();
    let walk = ULP * (all as f64).sqrt();
    report.at_most("`|Π|²` error", square, walk);
    report.at_most("energy error", error, 4.0 * walk);
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without a difference between two moments it is that of a body of revolution: `2π/|(J₁ − J₃) Ω₃/J₁|`.
    #[test]
    fn periods_are_those_of_bodies_of_revolution_in_the_limit() {
        let moments = [1.0, 1.0 + 1e-9, 1.5];
        let pi = Vector3::new(0.3, 0.2, 0.9);
        let spin: f64 = 0.5 * pi.z / 1.5;
        let found = period(moments, &pi);
        assert!((found * spin / (2.0 * PI) - 1.0).abs() < 1e-8, "{found}");
    }
}
