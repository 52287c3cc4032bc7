//! The turn of one step, up to the limit of what can be solved and beyond it.

use std::f64::consts::FRAC_PI_2;

use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::rotation;
use lgvi_dynamics::{BodyState, Inertia, Load, Method, StepError};
use lgvi_lie::{hat, to_rotation_vector};
use lgvi_truth::random::Random;
use nalgebra::{Matrix3, Vector3};

use crate::bodies::{LGVI, ULP, body, free, keep, turning};
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 6] = [
    Trial {
        name: "principal axes",
        done: "one step of `lgvi` about each principal axis of five bodies, from sphere to rod, `h|Ω|` from 1e-9 to 1 − 1e-12",
        right: "the turn is `asin(h|Ω|)`, up to 90°; its error is the rounding of `h|Ω|` times the slope, \
                `2⁻⁵²/√(1 − (h|Ω|)²)`: at most 16 of these, the halves of 16 roundings before the equation is solved and of 16 after \
                it",
        run: principal_axes,
    },
    Trial {
        name: "beyond, discrete rotor",
        done: "the same axes, `h|Ω|` from 1 + 1e-9 to 1e300, by the discrete rotor",
        right: "each step is refused with the turn in the error, to the rounding of `|hJ⁻¹Π|`, 8 × 2⁻⁵², infinite where its \
                square is beyond the range of numbers; the state is that of before to the last bit",
        run: beyond,
    },
    Trial {
        name: "beyond, exact rotor",
        done: "the same steps by the exact rotor",
        right: "it turns by `h|Ω|`, up to 1e6 within the rounding of that phase, four operations and the sine and cosine of four \
                more, and keeps Π and the axis up to 1e100; at 1e300, where `|Π|²` is no number, it refuses as not finite and the \
                state is that of before",
        run: exact,
    },
    Trial {
        name: "within the sufficient bound",
        done: "random bodies (moments down to 1e-6 of the greatest), axes and momenta with `|h J⁻¹Π|` from 0 to 0.999, 1e6 of them",
        right: "all are solved, with a residual of rounding: 64 × 2⁻⁵² of `|J| + |hΠ|`, half of it of F and its two products with J_d, half \
                of what Newton's method leaves; the bound allows the double",
        run: sufficient,
    },
    Trial {
        name: "up to the sufficient bound",
        done: "the same with `|h J⁻¹Π|` from 0.999 to 1 − 1e-9, what is left to 1 log-uniform",
        right: "as above: up to 1 each has a solution, and a residual does not depend on how well it is conditioned",
        run: up_to_the_bound,
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
    report.at_most("greatest error in 2⁻⁵² of that", worst, 16.0);
    report.within("greatest turn in 90°", greatest, [0.999_999, 1.0]);
    Ok(report)
}

/// Turns beyond the limit of every discrete rotor. The norm of the last is beyond the range of numbers.
const BEYOND: [f64; 9] = [
    1.0 + 1e-9,
    1.0001,
    1.5,
    FRAC_PI_2,
    3.2,
    10.0,
    1e6,
    1e100,
    1e300,
];

/// One step of length 1 about a principal axis: where it began, what came of it, and where it is then.
fn turn_by(
    moments: [f64; 3],
    omega: Vector3<f64>,
    rotor: Rotor,
) -> Result<(BodyState, Option<StepError>, BodyState), TrialError> {
    let body = body(moments)?;
    let state = turning(&body, omega);
    let mut simulation = free(body, state, Method::Lgvi(rotor), 1.0)?;
    let error = simulation.advance(&[Load::default()]).err();
    Ok((state, error, simulation.states()[0]))
}

fn beyond(_: Length) -> Result<Report, TrialError> {
    let (mut steps, mut made, mut traces) = (0, 0, 0);
    for (moments, axis) in axes() {
        for turn in BEYOND {
            let (before, error, after) = turn_by(moments, axis * turn, Rotor::Discrete)?;
            let refused = match error {
                Some(StepError::Unsolvable { source, .. }) => Some(source.turn),
                _ => None,
            };
            steps += 1;
            made += u32::from(!refused.is_some_and(|found| tells(found, turn)));
            traces += u32::from(after != before);
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
    Ok(report)
}

/// Whether it is this turn: to the rounding of `|h J⁻¹Π|`, eight operations; a norm beyond the range of numbers is infinite.
fn tells(found: f64, turn: f64) -> bool {
    if turn > 1e154 {
        return found == f64::INFINITY;
    }
    (found / turn - 1.0).abs() <= 8.0 * ULP
}

fn exact(_: Length) -> Result<Report, TrialError> {
    let (mut turned, mut refused, mut others) = (0_u32, 0_u32, 0_u32);
    let (mut kept, mut apart) = (0.0_f64, 0.0_f64);
    for (moments, axis) in axes() {
        for turn in BEYOND {
            let (before, error, after) = turn_by(moments, axis * turn, Rotor::Exact)?;
            match error {
                None => {
                    turned += 1;
                    let begun = before.angular_momentum;
                    let unit = begun.norm();
                    keep(&mut kept, (after.angular_momentum - begun).norm() / unit);
                    keep(&mut kept, (after.attitude * axis - axis).norm());
                    // A phase of 1e16 and more is rounding in all its digits.
                    if turn < 1e16 {
                        let miss = after.attitude - lgvi_lie::exp(&(axis * turn));
                        keep(&mut apart, miss.norm() / (ULP * (1.0 + turn)));
                    }
                }
                Some(StepError::NotFinite { .. }) if turn > 1e154 && after == before => {
                    refused += 1;
                }
                Some(_) => others += 1,
            }
        }
    }
    let count = axes().count() as f64;
    let mut report = Report::default();
    let finite = count * (BEYOND.len() - 1) as f64;
    report.within("turned", f64::from(turned), [finite; 2]);
    report.within("refused at 1e300", f64::from(refused), [count; 2]);
    report.within("other errors", f64::from(others), [0.0; 2]);
    report.at_most("axis and Π", kept, 4.0 * ULP);
    report.at_most("attitude in 2⁻⁵² of 1 and the turn", apart, 8.0);
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

/// Of `F J_d − J_d Fᵀ = S(g)`, relative.
fn residual(inertia: &Inertia, g: &Vector3<f64>, f: &Matrix3<f64>) -> f64 {
    let j_d = inertia.nonstandard();
    (f * j_d - j_d * f.transpose() - hat(g)).norm() / (inertia.matrix().norm() + g.norm())
}

fn sufficient(length: Length) -> Result<Report, TrialError> {
    solved(length, |random| random.uniform(0.0, 0.999))
}

fn up_to_the_bound(length: Length) -> Result<Report, TrialError> {
    solved(length, |random| 1.0 - random.log_uniform(1e-9, 1e-3))
}

/// Random bodies and momenta with turns so drawn.
fn solved(length: Length, turn: fn(&mut Random) -> f64) -> Result<Report, TrialError> {
    let (mut refused, mut worst) = (0_u32, 0.0_f64);
    let mut random = Random::new(11, 0);
    let trials = length.of(5_000, 1_000_000);
    for _ in 0..trials {
        let inertia = random_inertia(&mut random, 1e-6)?;
        let turn = turn(&mut random);
        let g = inertia.matrix() * (turn * random.direction());
        match rotation::solve(&inertia, &g) {
            Ok(found) => keep(&mut worst, residual(&inertia, &g, &found.matrix())),
            Err(_) => refused += 1,
        }
    }
    let mut report = Report::default();
    report.shows("momenta", f64::from(trials));
    report.within("refused", f64::from(refused), [0.0; 2]);
    report.at_most("greatest residual", worst, 128.0 * ULP);
    Ok(report)
}

/// The derivative of the left-hand side of (2.6) by f.
fn slope(inertia: &Inertia, g: &Vector3<f64>, f: &Vector3<f64>) -> Matrix3<f64> {
    let two_j = 2.0 * inertia.matrix();
    hat(g) + f * g.transpose() + Matrix3::from_diagonal_element(g.dot(f)) - two_j
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
            let slope = slope(inertia, &g, &f);
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
        match (rotation::solve(&inertia, &g), followed(&inertia, &g)) {
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
    let at_rest = 8.0 * inertia.matrix().determinant();
    slope(inertia, g, f).determinant() < -0.05 * at_rest
}
