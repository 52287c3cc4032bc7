//! Steps from the smallest to the limit.

use lgvi_dynamics::rotation::FreeRotation;
use lgvi_dynamics::{Load, StepError};
use nalgebra::Vector3;

use crate::bodies::{LGVI, ULP, body, fly, free, keep, turning};
use crate::fit::exponent;
use crate::{Length, Report, Trial, TrialError};

pub(crate) const TRIALS: [Trial; 2] = [
    Trial {
        name: "h from 1e-9 to the limit",
        done: "free asymmetric body (b1), `lgvi`, h = 1e-9, 1e-8 … 0.1, then 0.2, 0.4, 0.6, to t = 10 or 1e6 steps, beside \
               `closed_form`",
        right: "the attitude errs by `(h|Ω|)²` of the angle turned, as a method of second order does, and by the rounding of n \
                turns, `4 × 2⁻⁵² √n`: three standard deviations of a product of two rotations, nine entries of three products each, and \
                of the rounding of the one factor",
        run: sizes,
    },
    Trial {
        name: "h beyond the limit",
        done: "the same body, one step of 65 lengths from `1/|Ω|` to `J₃/|Π|`, then h = 2, 4 … 2²⁰, 1e10, 1e20, 1e30",
        right: "every step with `h|Ω| ≤ 1` is solvable; none with `h|Π| > J₃`, the greatest moment: a rotation by θ about the axis a has \
                `|hΠ|² = (aᵀJa)² sin²θ + 2(1 − cos θ)|a × Ja|²`, which is `J₃²` at most; so the first refusal lies between, a typed error \
                from there always, and the state is that of before to the last bit",
        run: beyond,
    },
];

const MOMENTS: [f64; 3] = [1.0, 2.0, 3.0];

fn omega() -> Vector3<f64> {
    Vector3::new(1.0, 0.5, -0.75)
}

fn sizes(length: Length) -> Result<Report, TrialError> {
    let body = body(MOMENTS)?;
    let state = turning(&body, omega());
    let flow = FreeRotation::new(body.inertia());
    let most = length.of(20_000, 1_000_000);
    let rate = omega().norm();
    let (mut worst, mut resolved) = (0.0_f64, Vec::new());
    let decades = (1..=9).rev().map(|n| f64::powi(10.0, -n));
    for h in decades.chain([0.2, 0.4, 0.6]) {
        let steps = ((10.0 / h) as u64).min(most);
        let t = steps as f64 * h;
        let mut simulation = free(body.clone(), state, LGVI, h)?;
        fly(&mut simulation, steps)?;
        let exact = flow.flow(&state.angular_momentum, t).0.matrix();
        let error = (simulation.states()[0].attitude - exact).norm();
        let truncation = (h * rate).powi(2) * rate * t;
        let bound = truncation + 4.0 * ULP * (steps as f64).sqrt();
        keep(&mut worst, error / bound);
        if (9e-4..0.11).contains(&h) {
            resolved.push([h, error / t]);
        }
    }
    let mut report = Report::default();
    report.at_most("greatest error in parts of that", worst, 1.0);
    report.within("order from 1e-3 to 0.1", exponent(&resolved), [1.9, 2.1]);
    Ok(report)
}

fn beyond(_: Length) -> Result<Report, TrialError> {
    let body = body(MOMENTS)?;
    let state = turning(&body, omega());
    let solvable = 1.0 / omega().norm();
    let impossible = MOMENTS[2] / state.angular_momentum.norm();
    let (low, high) = (solvable * (1.0 - 4.0 * ULP), impossible * (1.0 + 4.0 * ULP));
    let between = (0..=64).map(|n| low * (high / low).powf(f64::from(n) / 64.0));
    let doublings = (1..=20).map(|n| f64::from(1 << n));
    let (mut refused, mut returns, mut traces, mut others) = (None, 0, 0, 0);
    for h in between.chain(doublings).chain([1e10, 1e20, 1e30]) {
        let mut simulation = free(body.clone(), state, LGVI, h)?;
        match simulation.advance(&[Load::default()]) {
            Ok(_) => returns += u32::from(refused.is_some()),
            Err(error) => {
                others += u32::from(!matches!(error, StepError::Unsolvable { .. }));
                traces += u32::from(simulation.states()[0] != state);
                refused = refused.or(Some(h));
            }
        }
    }
    let mut report = Report::default();
    report.within(
        "first h refused",
        refused.unwrap_or(f64::NAN),
        [solvable, high * (1.0 + 4.0 * ULP)],
    );
    report.within("greater ones not refused", f64::from(returns), [0.0; 2]);
    report.within("errors of another kind", f64::from(others), [0.0; 2]);
    report.within("states changed", f64::from(traces), [0.0; 2]);
    Ok(report)
}
