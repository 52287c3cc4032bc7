//! Initial guesses from the free flight: by bending it to the target, and by a sequence of intermediate targets.

use lgvi_dynamics::BodyState;
use lgvi_lie::{exp, log, right_jacobian_inverse};
use nalgebra::{Matrix3, SVector, Vector3};

use super::attempt::{Failure, Solver};
use super::class::Class;
use super::error::PlanError;
use super::progress::Phase;
use super::resolution::resolved;
use crate::discrete::DiscreteDynamics;
use crate::newton::{Closeness, Ended, Iterate, Newton};
use crate::problem::{Terminal, TerminalSet};

/// The first part of the way that is tried in one step, and the least.
const STRIDES: [f64; 2] = [0.25, 0.01];
/// Factor by which a step grows after a success.
const LONGER: f64 = 1.5;

impl<C> Solver<'_, C> {
    /// Solves at the first resolution for a sequence of targets between the end of the free flight and the target of
    /// the transfer. Returns `None` if the target is not a single state or if the free flight fails.
    pub(super) fn drifted<const X: usize, const U: usize>(
        &mut self,
    ) -> Option<Result<Result<Newton<X, U>, Failure<X, U>>, PlanError>>
    where
        C: Class<X, U>,
    {
        let target = self.transfer.terminal.state()?;
        let mut iterate = self.drift()?;
        let drifted = *iterate.states.last()?;
        let mut reached = 0.0;
        let mut stride = STRIDES[0];
        loop {
            let part = f64::min(reached + stride, 1.0);
            let mut view = resolved(self.transfer, iterate.commands.len());
            if part < 1.0 {
                let target = Terminal::try_from(between(&drifted, &target, part)).ok()?;
                view.terminal = TerminalSet::from(&target);
            }
            let steps = match self.class.steps(&view) {
                Ok(steps) => steps,
                Err(error) => return Some(Err(error.into())),
            };
            let problem = self.problem(&view, &steps);
            match self.level(&problem, iterate.clone(), Closeness::Far, Phase::Coarse) {
                Ok(newton) if part == 1.0 => return Some(Ok(Ok(newton))),
                Ok(newton) => {
                    iterate = newton.iterate;
                    reached = part;
                    stride *= LONGER;
                }
                failure @ Err((Ended::Stopped, _)) => return Some(Ok(failure)),
                failure => {
                    stride *= 0.5;
                    if stride < STRIDES[1] {
                        return Some(Ok(failure));
                    }
                }
            }
        }
    }

    /// Positions and attitudes of the free flight at the first resolution, bent to end at the goal. If both ends are on
    /// orbits, the flight is turned about the origin and scaled to the goal's distance. Returns `None` if the free
    /// flight fails.
    pub(super) fn bent<const X: usize, const U: usize>(
        &self,
    ) -> Option<Vec<(Vector3<f64>, Matrix3<f64>)>>
    where
        C: Class<X, U>,
    {
        let body = &self.transfer.body;
        let duration = self.transfer.h * self.transfer.intervals as f64;
        let goal = self.goal();
        let states = self.drift()?.states;
        let last = states.last()?;
        let orbits = match self.transfer.orbit {
            None => frame(last).zip(frame(&goal)),
            Some(_) => None,
        };
        let (turn, ratio, shift) = match orbits {
            Some((first, second)) => (
                log(&(second * first.transpose())),
                goal.position.norm() / last.position.norm(),
                Vector3::zeros(),
            ),
            None => (Vector3::zeros(), 1.0, goal.position - last.position),
        };
        let whole = exp(&turn);
        let own = log(&(whole * last.attitude).tr_mul(&goal.attitude));
        let faster = goal.velocity(body) - ratio * (whole * last.velocity(body));
        let spun = goal.angular_velocity(body) - exp(&own).tr_mul(&last.angular_velocity(body));
        let (faster, spun) = (
            duration * faster,
            duration * (right_jacobian_inverse(&own) * spun),
        );
        let intervals = (states.len() - 1) as f64;
        let path = states.iter().enumerate().map(|(k, state)| {
            let t = k as f64 / intervals;
            let (part, late) = (t * t * (3.0 - 2.0 * t), t * t * (1.0 - t));
            let turned = exp(&(part * turn));
            let position = (1.0 + part * (ratio - 1.0)) * (turned * state.position);
            (
                position + part * shift - late * faster,
                turned * state.attitude * exp(&(part * own - late * spun)),
            )
        });
        Some(path.collect())
    }

    /// The flight without commands at the first resolution.
    fn drift<const X: usize, const U: usize>(&self) -> Option<Iterate<X, U>>
    where
        C: Class<X, U>,
    {
        let view = resolved(self.transfer, self.first_intervals());
        let steps = self.class.steps(&view).ok()?;
        let none = SVector::zeros();
        let mut states = vec![view.initial];
        for k in 0..view.intervals {
            let next = steps.next(k, &states[k], &none).ok()?;
            states.push(next);
        }
        Some(Iterate {
            states,
            commands: vec![none; view.intervals],
            nu: SVector::zeros(),
        })
    }
}

/// The state at the fraction `part` of the way from one state to another, turned about the origin if both are on
/// orbits.
fn between(from: &BodyState, to: &BodyState, part: f64) -> BodyState {
    let turn = match (frame(from), frame(to)) {
        (Some(first), Some(last)) => log(&(last * first.transpose())),
        _ => Vector3::zeros(),
    };
    let (whole, moved) = (exp(&turn), exp(&(part * turn)));
    let mix = |a: &Vector3<f64>, b: &Vector3<f64>| moved * a.lerp(&whole.tr_mul(b), part);
    let own = from.attitude.tr_mul(&whole.tr_mul(&to.attitude));
    BodyState {
        position: mix(&from.position, &to.position),
        linear_momentum: mix(&from.linear_momentum, &to.linear_momentum),
        attitude: moved * from.attitude * exp(&(part * log(&own))),
        angular_momentum: from.angular_momentum.lerp(&to.angular_momentum, part),
    }
}

/// The radial, along-track and normal directions of an orbit about the origin, or `None` if its plane is not defined.
fn frame(state: &BodyState) -> Option<Matrix3<f64>> {
    let normal = state.position.cross(&state.linear_momentum);
    let least = 1e-3 * state.position.norm() * state.linear_momentum.norm();
    let across = normal.try_normalize(least.max(f64::MIN_POSITIVE))?;
    let outwards = state.position.normalize();
    Some(Matrix3::from_columns(&[
        outwards,
        across.cross(&outwards),
        across,
    ]))
}
