//! The turn of one step, up to the limit of what can be solved and beyond it.

use std::f64::consts::FRAC_PI_2;

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::rotation::{Chart, PreprocessedOrder};
use lgvi_dynamics::{Inertia, Load, Method, StepError};
use lgvi_lie::{hat, to_rotation_vector};
use lgvi_truth::random::Random;
use nalgebra::{Matrix3, Vector3};

use crate::bodies::{LGVI, ULP, body, free, keep, turning};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 4] = [
    Trial {
        name: "principal axes",
        done: "one step of `lgvi` about each principal axis of five bodies, from sphere to rod, `h|Ω|` from 1e-9 to 1 − 1e-12",
        right: "the turn is `asin(h|Ω|)`, up to 90°; its error is the rounding of `h|Ω|` times the slope, \
                `2⁻⁵²/√(1 − (h|Ω|)²)`",
        run: principal_axes,
    },
    Trial {
        name: "beyond, every rotor",
        done: "the same axes, `h|Ω|` from 1 + 1e-9 to 1e300, by every rotor",
        right: "the discrete rotors refuse with the turn in the error, the preprocessed above 1 rad likewise, the state is \
                that of before to the last bit; the exact rotor turns, or refuses once the phase is no number",
        run: beyond,
    },
    Trial {
        name: "within the sufficient bound",
        done: "random bodies (moments down to 1e-6 of the greatest), axes and momenta with `|h J⁻¹Π| < 1`, 1e6 of them, both \
               charts",
        right: "all are solved, with a residual of rounding, both charts alike",
        run: sufficient,
    },
    Trial {
        name: "the right branch",
        done: "random momenta with `|h J⁻¹Π|` from 0.5 to 3, 2e4 of them; each solution is also followed from F = I in 400 \
               steps by Newton's method of its own",
        right: "where the path from I reaches the momentum the solution is the path's end, where it folds before there is a \
                typed error: never another solution",
        run: branch,
    },
];

const BODIES: [[f64; 3]; 5] = [
    [1.0, 1.0, 1.0],
    [1.0, 2.0, 2.5],
    [0.1, 1.0, 1.0],
    [1e-3, 0.7, 0.7005],
    [1.0, 2.0, 3.0],
];

/// Each body about each of its principal axes.
fn axes() -> impl Iterator<Item = ([f64; 3], Vector3<f64>)> {
    BODIES
        .into_iter()
        .flat_map(|moments| (0..3).map(move |axis| (moments, Vector3::ith(axis, 1.0))))
}

fn principal_axes(_: Length) -> Result<Report, TrialError> {
    let mut report = Report::default();
    let (mut worst, mut greatest) = (0.0_f64, 0.0_f64);
    for (moments, axis) in axes() {
        for turn in [
            1e-9,
            1e-3,
            0.1,
            0.5,
            0.9,
            0.99,
            1.0 - 1e-6,
            1.0 - 1e-9,
            1.0 - 1e-12,
        ] {
            let body = body(moments)?;
            let state = turning(&body, axis * turn);
            let mut simulation = free(body, state, LGVI, 1.0)?;
            simulation.advance(&[Load::default()])?;
            let turned = lgvi_lie::log(&simulation.states()[0].attitude).dot(&axis);
            let slope = 1.0 / (1.0 - turn * turn).sqrt();
            let error = (turned - libm::asin(turn)).abs() / (turned.max(turn * slope) * ULP);
            keep(&mut worst, error);
            keep(&mut greatest, turned / FRAC_PI_2);
        }
    }
    report.at_most("greatest error in 2⁻⁵² of that", worst, 64.0);
    report.within("greatest turn in 90°", greatest, [0.999_999, 1.0]);
    Ok(report)
}

fn beyond(_: Length) -> Result<Report, TrialError> {
    let discrete = [
        Rotor::Discrete(Chart::Cayley),
        Rotor::Discrete(Chart::Exponential),
    ];
    let preprocessed = [
        PreprocessedOrder::Four,
        PreprocessedOrder::Six,
        PreprocessedOrder::Eight,
        PreprocessedOrder::Ten,
    ];
    let rotors = discrete
        .into_iter()
        .chain(preprocessed.map(Rotor::Preprocessed));
    let (mut steps, mut made, mut traces) = (0, 0, 0);
    let mut off = 0.0_f64;
    for rotor in rotors.chain([Rotor::Exact]) {
        for (moments, axis) in axes() {
            for turn in [
                1.0 + 1e-9,
                1.0001,
                1.5,
                FRAC_PI_2,
                3.2,
                10.0,
                1e6,
                1e100,
                1e300,
            ] {
                let body = body(moments)?;
                let state = turning(&body, axis * turn);
                let mut simulation = free(body, state, Method::Lgvi(rotor), 1.0)?;
                let advanced = simulation.advance(&[Load::default()]);
                let refused = match advanced {
                    // A norm beyond the range of numbers is infinite.
                    Err(StepError::Unsolvable { source, .. }) if turn > 1e150 => {
                        Some(source.turn.min(turn))
                    }
                    Err(StepError::Unsolvable { source, .. }) => Some(source.turn),
                    Err(StepError::Preprocessed { .. }) => Some(turn),
                    Err(StepError::NotFinite { .. }) if rotor == Rotor::Exact => continue,
                    _ => None,
                };
                traces += u32::from(advanced.is_err() && simulation.states()[0] != state);
                // Norms of what is greater are infinite.
                if rotor == Rotor::Exact && turn > 1e150 {
                    continue;
                }
                if rotor == Rotor::Exact {
                    let left = simulation.states()[0];
                    let kept = left.angular_momentum - state.angular_momentum;
                    let straight = left.attitude * axis - axis;
                    keep(&mut off, kept.norm() / state.angular_momentum.norm());
                    keep(&mut off, straight.norm());
                    continue;
                }
                steps += 1;
                made += u32::from(refused.is_none_or(|found| (found / turn - 1.0).abs() > 1e-9));
            }
        }
    }
    let mut report = Report::default();
    report.shows("steps beyond the limit", f64::from(steps));
    report.within(
        "made, or refused with another turn",
        f64::from(made),
        [0.0; 2],
    );
    report.within("states changed by a refusal", f64::from(traces), [0.0; 2]);
    report.at_most("exact rotor: axis and Π", off, 4.0 * ULP);
    Ok(report)
}

/// A body with a ratio of moments down to `least`, log-uniform.
fn random_inertia(random: &mut Random, least: f64) -> Result<Inertia, TrialError> {
    let (a, b) = (
        random.log_uniform(least, 1.0),
        random.log_uniform(least, 1.0),
    );
    // Moments of a body whose masses lie at a and b and 1 along its axes.
    let axes = random.rotation();
    let moments = Vector3::new(a + b, b + 1.0, 1.0 + a);
    let matrix = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
    Ok(Inertia::new(0.5 * (matrix + matrix.transpose()))?)
}

fn residual(inertia: &Inertia, g: &Vector3<f64>, f: &Matrix3<f64>) -> f64 {
    let j_d = inertia.nonstandard();
    (f * j_d - j_d * f.transpose() - hat(g)).norm() / (inertia.matrix().norm() + g.norm())
}

fn sufficient(length: Length) -> Result<Report, TrialError> {
    let (mut refused, mut worst, mut apart) = (0_u32, 0.0_f64, 0.0_f64);
    let mut random = Random::new(11, 0);
    let trials = length.of(5_000, 1_000_000);
    for _ in 0..trials {
        let inertia = random_inertia(&mut random, 1e-6)?;
        let turn = random.uniform(0.0, 0.999);
        let g = inertia.matrix() * (turn * random.direction());
        let [cayley, exponential] =
            [Chart::Cayley, Chart::Exponential].map(|chart| chart.solve(&inertia, &g, None));
        match (cayley, exponential) {
            (Ok(one), Ok(other)) => {
                for found in [&one, &other] {
                    keep(&mut worst, residual(&inertia, &g, &found.matrix()));
                }
                let difference = inertia.matrix() * (one.cayley - other.cayley);
                keep(&mut apart, difference.norm() / g.norm());
            }
            _ => refused += 1,
        }
    }
    let mut report = Report::default();
    report.shows("momenta", f64::from(trials));
    report.within("refused", f64::from(refused), [0.0; 2]);
    report.at_most("greatest residual", worst, 5e-14);
    report.at_most("charts apart by", apart, 1e-9);
    Ok(report)
}

/// Where the path of solutions from `F = I` is at `g`, by continuation in the Cayley chart (2.6),
/// `g + g × f + (gᵀf) f − 2J f = 0`; none where it folds before.
fn followed(inertia: &Inertia, g: &Vector3<f64>) -> Option<Vector3<f64>> {
    let two_j = 2.0 * inertia.matrix();
    let mut f = Vector3::zeros();
    for n in 1..=400 {
        let g = g * (f64::from(n) / 400.0);
        let begun = f;
        for _ in 0..8 {
            let residual = g + g.cross(&f) + g.dot(&f) * f - two_j * f;
            let slope =
                hat(&g) + f * g.transpose() + Matrix3::from_diagonal_element(g.dot(&f)) - two_j;
            // −2J at the start; the path folds where it becomes singular.
            if slope.determinant() >= 0.0 {
                return None;
            }
            f -= slope.try_inverse()? * residual;
        }
        let turned = to_rotation_vector(&f) - to_rotation_vector(&begun);
        let residual = g + g.cross(&f) + g.dot(&f) * f - two_j * f;
        if turned.norm() > 0.3 || residual.norm() > 1e-12 * two_j.norm() {
            return None;
        }
    }
    Some(f)
}

fn branch(length: Length) -> Result<Report, TrialError> {
    let mut random = Random::new(13, 0);
    let trials = length.of(500, 20_000);
    let (mut solved, mut folded, mut other, mut unlike) = (0_u32, 0_u32, 0_u32, 0_u32);
    for _ in 0..trials {
        let inertia = random_inertia(&mut random, 1e-2)?;
        let g = inertia.matrix() * (random.uniform(0.5, 3.0) * random.direction());
        match (
            Chart::Cayley.solve(&inertia, &g, None),
            followed(&inertia, &g),
        ) {
            (Ok(found), Some(end)) => {
                solved += 1;
                other += u32::from((found.cayley - end).norm() > 1e-6 * end.norm());
            }
            (Err(_), None) => folded += 1,
            // The last step to a fold may jump it, or stop before it.
            (Ok(found), None) => unlike += u32::from(clear_of_folds(&inertia, &g, &found.cayley)),
            (Err(error), Some(_)) => unlike += u32::from(error.margin < -1e-2),
        }
    }
    let mut report = Report::default();
    report.shows("solved", f64::from(solved));
    report.shows("folded before", f64::from(folded));
    report.within(
        "solutions that are not the path's end",
        f64::from(other),
        [0.0; 2],
    );
    report.within(
        "solved on one way only, far from a fold",
        f64::from(unlike),
        [0.0; 2],
    );
    Ok(report)
}

/// Whether the solution `f` is so far from a fold that the path cannot have missed it.
fn clear_of_folds(inertia: &Inertia, g: &Vector3<f64>, f: &Vector3<f64>) -> bool {
    let two_j = 2.0 * inertia.matrix();
    let slope = hat(g) + f * g.transpose() + Matrix3::from_diagonal_element(g.dot(f)) - two_j;
    slope.determinant() < -0.05 * two_j.determinant()
}
