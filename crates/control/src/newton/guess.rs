//! Initial guesses for a cold start: a path between both ends and the commands that would follow it.

use lgvi_dynamics::rotation::Unsolvable;
use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_lie::{exp, log, right_jacobian_inverse, vee};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::problem::{Iterate, Problem};
use crate::discrete::{DiscreteDynamics, Linearization};
use crate::riccati::Policy;

/// Angle (rad) below which the mean spin of both ends says nothing about the number of turns.
const HALF_TURN: f64 = std::f64::consts::PI;

/// Position and attitude at the stages `0 … N` between two states, as cubic Hermite interpolants. The attitude is
/// interpolated as the rotation vector relative to a frame that turns at the mean of both angular velocities.
///
/// The cheapest motion between given rates over a given time turns at about their mean. The shorter way of the
/// remaining rotation therefore gives the right number of turns.
pub(crate) fn hermite(
    body: &RigidBody,
    duration: f64,
    intervals: usize,
    from: &BodyState,
    to: &BodyState,
    turns: f64,
) -> Vec<(Vector3<f64>, Matrix3<f64>)> {
    let velocity = |state: &BodyState| duration * state.velocity(body);
    let spin = |state: &BodyState| duration * state.angular_velocity(body);
    let mean = 0.5 * (spin(from) + spin(to));
    let mean = if mean.norm() < HALF_TURN {
        Vector3::zeros()
    } else {
        mean
    };
    let mut rotation = log(&(from.attitude * exp(&mean)).tr_mul(&to.attitude));
    if turns != 0.0 {
        let angle = rotation.norm();
        if angle > 0.0 {
            rotation *= (angle + turns * std::f64::consts::TAU) / angle;
        }
    }
    let cubic = |t: f64, ends: [Vector3<f64>; 2], rates: [Vector3<f64>; 2]| {
        let (s, r) = (t * t, 1.0 - t);
        (1.0 - s * (3.0 - 2.0 * t)) * ends[0] + s * (3.0 - 2.0 * t) * ends[1] + t * r * r * rates[0]
            - s * r * rates[1]
    };
    let start_rate = spin(from) - mean;
    let end_rate = right_jacobian_inverse(&rotation) * (spin(to) - exp(&rotation).tr_mul(&mean));
    (0..=intervals)
        .map(|k| {
            let t = k as f64 / intervals as f64;
            let position = cubic(
                t,
                [from.position, to.position],
                [velocity(from), velocity(to)],
            );
            let left = cubic(t, [Vector3::zeros(), rotation], [start_rate, end_rate]);
            (position, from.attitude * exp(&(t * mean)) * exp(&left))
        })
        .collect()
}

/// Returns the iterate that follows a path as closely as the actuation can. The momenta are differences of the path;
/// the commands minimize the remaining defects of the steps.
pub(crate) fn along<S, E, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    body: &RigidBody,
    path: &[(Vector3<f64>, Matrix3<f64>)],
    to: &BodyState,
) -> Result<Iterate<X, U>, (usize, Unsolvable)>
where
    S: DiscreteDynamics<X, U>,
{
    let h = problem.h;
    let mut states: Vec<_> = path
        .windows(2)
        .map(|pair| {
            let [(position, attitude), (next_position, next_attitude)] = [pair[0], pair[1]];
            let relative = attitude.tr_mul(&next_attitude);
            let moved = relative * body.inertia().nonstandard();
            BodyState {
                position,
                linear_momentum: (body.mass() / h) * (next_position - position),
                attitude,
                angular_momentum: vee(&(moved - moved.transpose())) / h,
            }
        })
        .collect();
    states.push(*to);
    states[0] = problem.initial;
    problem.steps.complete(&mut states);

    let mut linear = Linearization::default();
    let idle = SVector::zeros();
    let inputs = problem.steps.inputs();
    let fitted = |linear: &Linearization| {
        let b: SMatrix<f64, X, U> = linear.by_command(&inputs);
        let weighted = SMatrix::<f64, X, U>::from_fn(|i, j| problem.stiffness[i] * b[(i, j)]);
        // A share of the cost so small that it only bounds commands that have no effect.
        let normal = weighted.tr_mul(&b) + (1e-9 * h) * problem.weight;
        (weighted, normal.cholesky())
    };
    let mut fit = None;
    let mut commands = Vec::with_capacity(problem.intervals);
    for k in 0..problem.intervals {
        let next = problem
            .steps
            .next(k, &states[k], &idle)
            .map_err(|source| (k, source))?;
        let missing = problem.steps.difference(&next, &states[k + 1]);
        // The effect of commands hardly differs from step to step, unless they turn with the body
        // or some are off.
        let (weighted, factor) = match &fit {
            Some(fit) if linear.own.is_none() && problem.steps.off().is_empty() => fit,
            _ => {
                problem
                    .steps
                    .linearize(k, &states[k], &idle, &mut linear)
                    .map_err(|source| (k, source))?;
                fit.insert(fitted(&linear))
            }
        };
        let command = factor.as_ref().map_or_else(SVector::zeros, |factor| {
            factor.solve(&weighted.tr_mul(&missing))
        });
        commands.push(command);
    }
    Ok(Iterate {
        states,
        commands,
        nu: SVector::zeros(),
    })
}

/// Resamples an iterate to `fine` intervals over the same time, linearly between its stages.
pub(crate) fn resampled<S, const X: usize, const U: usize>(
    steps: &S,
    fine: usize,
    from: &Iterate<X, U>,
) -> Iterate<X, U>
where
    S: DiscreteDynamics<X, U>,
{
    let coarse = from.commands.len();
    let ratio = coarse as f64 / fine as f64;
    let states = (0..=fine)
        .map(|k| {
            let (below, part) = between(k as f64 * ratio, coarse);
            let z = steps.difference(&from.states[below], &from.states[below + 1]);
            steps.moved(&from.states[below], &(part * z))
        })
        .collect();
    Iterate {
        states,
        commands: resampled_commands(&from.commands, fine),
        nu: from.nu,
    }
}

/// The index below a position among `0 … last`, and the distance from it.
fn between(position: f64, last: usize) -> (usize, f64) {
    let below = (position.max(0.0) as usize).min(last.saturating_sub(1));
    (below, position - below as f64)
}

fn resampled_commands<const U: usize>(
    from: &[SVector<f64, U>],
    fine: usize,
) -> Vec<SVector<f64, U>> {
    let coarse = from.len();
    let ratio = coarse as f64 / fine as f64;
    let command = |k: usize| {
        let (below, part) = between((k as f64 + 0.5) * ratio - 0.5, coarse - 1);
        let (w, next) = (from[below], from[(below + 1).min(coarse - 1)]);
        w + part * (next - w)
    };
    (0..fine).map(command).collect()
}

/// `fine + share (fine − coarse)` at the stages of `fine` (Richardson's extrapolation). The difference is interpolated
/// linearly.
pub(crate) fn extrapolated<S, const X: usize, const U: usize>(
    steps: &S,
    fine: &Iterate<X, U>,
    coarse: &Iterate<X, U>,
    share: f64,
) -> Iterate<X, U>
where
    S: DiscreteDynamics<X, U>,
{
    let (intervals, stages) = (coarse.commands.len(), fine.commands.len());
    let known = resampled(steps, intervals, fine);
    let ratio = intervals as f64 / stages as f64;
    let pairs = || coarse.states.iter().zip(&known.states);
    let differences: Vec<_> = pairs()
        .map(|(coarse, fine)| share * steps.difference(coarse, fine))
        .collect();
    let states = fine.states.iter().enumerate().map(|(k, state)| {
        let (below, part) = between(k as f64 * ratio, intervals);
        let [z, next] = [differences[below], differences[below + 1]];
        steps.moved(state, &(z + part * (next - z)))
    });
    let pairs = coarse.commands.iter().zip(&known.commands);
    let differences: Vec<_> = pairs
        .map(|(coarse, fine)| share * (fine - coarse))
        .collect();
    let more = resampled_commands(&differences, stages);
    Iterate {
        states: states.collect(),
        commands: fine
            .commands
            .iter()
            .zip(more)
            .map(|(w, more)| w + more)
            .collect(),
        nu: fine.nu + share * (fine.nu - coarse.nu),
    }
}

/// Returns the flight over more intervals that the policies of a model keep near `from`, or `None` if a step fails or
/// the state is not finite.
pub(crate) fn kept<S, E, const X: usize, const U: usize>(
    problem: &Problem<'_, S, E, X, U>,
    from: &Iterate<X, U>,
    policies: &[Policy<X, U>],
) -> Option<Iterate<X, U>>
where
    S: DiscreteDynamics<X, U>,
{
    let mut iterate = resampled(problem.steps, problem.intervals, from);
    let ratio = policies.len() as f64 / problem.intervals as f64;
    iterate.states[0] = problem.initial;
    let mut state = problem.initial;
    for k in 0..problem.intervals {
        let policy = &policies[((k as f64 + 0.5) * ratio) as usize];
        let off = problem.steps.difference(&iterate.states[k], &state);
        iterate.commands[k] += policy.state.tr_mul(&off);
        iterate.states[k] = state;
        state = problem
            .steps
            .next(k, &state, &iterate.commands[k])
            .ok()
            .filter(BodyState::is_finite)?;
    }
    iterate.states[problem.intervals] = state;
    Some(iterate)
}

/// The path of `states` over another number of intervals in the same time: cubics with slopes from the neighboring
/// stages.
pub(crate) fn refined(states: &[BodyState], intervals: usize) -> Vec<(Vector3<f64>, Matrix3<f64>)> {
    let last = states.len() - 1;
    let turn = |from: usize, to: usize| log(&states[from].attitude.tr_mul(&states[to].attitude));
    // Displacement and rotation per coarse interval, at a coarse stage.
    let slope = |k: usize| {
        let (before, after) = (k.saturating_sub(1), (k + 1).min(last));
        let share = ((after - before) as f64).recip();
        let displacement = states[after].position - states[before].position;
        (
            share * displacement,
            share * (turn(k, after) - turn(k, before)),
        )
    };
    let basis = |t: f64| {
        let r = 1.0 - t;
        [t * t * (3.0 - 2.0 * t), t * r * r, -t * t * r]
    };
    (0..=intervals)
        .map(|k| {
            let at = k as f64 * (last as f64 / intervals as f64);
            let below = (at as usize).min(last - 1);
            let (from, to) = (&states[below], &states[below + 1]);
            let [end, first, second] = basis(at - below as f64);
            let (velocity, spin) = slope(below);
            let (next_velocity, next_spin) = slope(below + 1);
            let rotation = turn(below, below + 1);
            let position = from.position
                + end * (to.position - from.position)
                + first * velocity
                + second * next_velocity;
            let turned = end * rotation
                + first * spin
                + second * (right_jacobian_inverse(&rotation) * next_spin);
            (position, from.attitude * exp(&turned))
        })
        .collect()
}
