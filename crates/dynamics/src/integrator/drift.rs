use lgvi_lie::{compose, rotate_back};
use nalgebra::Vector3;

use super::turn::Turn;
use super::{Rotor, StepError};
use crate::rotation::{Chart, FromGuess, General, Principal, Unsolvable};
use crate::{BodyState, Inertia, Load, Mobility, RigidBody};

/// Free motion of all bodies over a time, `x ← x + (h/m) γ`, `R ← R F`, `Π ← Fᵀ Π`.
pub(super) struct Drift {
    movers: Vec<Mover>,
}

/// What one of the drifts in a step knows of its last times: starting guesses, one a body.
pub(super) struct Memory {
    turns: Vec<Turn>,
    /// The same with the solutions of the present step.
    next: Vec<Turn>,
}

/// A body as its drifts see it.
struct Mover {
    mobility: Mobility,
    /// `1/m`
    per_mass: f64,
    rotor: BodyRotor,
}

/// How a body's rotation over a drift is found, chosen once. A new [`Rotor`] is a variant here, with what it derives from
/// the body, and an arm in [`BodyRotor::of`] and in [`BodyRotor::turn`]: a jump that the processor foresees.
enum BodyRotor {
    /// The implicit equation in the Cayley chart, body axes being principal axes.
    Principal(FromGuess<Principal>),
    /// The same for any body axes.
    General(FromGuess<General>),
    /// The implicit equation in another chart.
    Chart(Chart),
}

impl BodyRotor {
    fn of(rotor: Rotor, body: &RigidBody) -> Self {
        let inertia = body.inertia();
        match rotor {
            Rotor::Discrete(Chart::Cayley) => FromGuess::principal(inertia).map_or_else(
                || Self::General(FromGuess::general(inertia)),
                Self::Principal,
            ),
            Rotor::Discrete(chart) => Self::Chart(chart),
        }
    }

    /// Turns a body with angular momentum `p` by `h`; returns the Newton corrections it took.
    #[inline(always)]
    fn turn(
        &self,
        body: &RigidBody,
        p: &Vector3<f64>,
        state: &mut BodyState,
        turns: (&Turn, &mut Turn),
        h: f64,
    ) -> Result<u32, Unsolvable> {
        let guess = turns.0.guess();
        let at_once = match self {
            Self::Principal(equation) => equation.at_once(h, p, &guess),
            Self::General(equation) => equation.at_once(h, p, &guess),
            Self::Chart(_) => None,
        };
        match at_once {
            Some(f) => {
                rotate(&f, p, state, turns);
                Ok(1)
            }
            None => self.solve_and_turn(body.inertia(), p, &guess, state, turns, h),
        }
    }

    #[cold]
    #[inline(never)]
    fn solve_and_turn(
        &self,
        inertia: &Inertia,
        p: &Vector3<f64>,
        guess: &Vector3<f64>,
        state: &mut BodyState,
        turns: (&Turn, &mut Turn),
        h: f64,
    ) -> Result<u32, Unsolvable> {
        let relative = match self {
            Self::Principal(equation) => equation.solve(inertia, h, p, *guess),
            Self::General(equation) => equation.solve(inertia, h, p, *guess),
            Self::Chart(chart) => chart.solve(inertia, &(h * p), Some(guess)),
        }?;
        rotate(&relative.cayley, p, state, turns);
        Ok(relative.iterations)
    }
}

/// Turns a body with angular momentum `p` by `cay(f)`.
#[inline(always)]
fn rotate(
    f: &Vector3<f64>,
    p: &Vector3<f64>,
    state: &mut BodyState,
    (turn, next): (&Turn, &mut Turn),
) {
    state.angular_momentum = rotate_back(f, p);
    state.attitude = compose(&state.attitude, f);
    *next = turn.then(*f);
}

impl Mover {
    fn of(rotor: Rotor, body: &RigidBody) -> Self {
        Self {
            mobility: *body.mobility(),
            per_mass: body.mass().recip(),
            rotor: BodyRotor::of(rotor, body),
        }
    }
}

/// Gravity's loads, controls and the time for which they act.
#[derive(Clone, Copy)]
pub(super) struct Kick<'a> {
    pub(super) gravity: &'a [Load],
    pub(super) controls: &'a [Load],
    pub(super) dt: f64,
}

impl Drift {
    /// Of `bodies`, which turn by `rotor`.
    pub(super) fn new(rotor: Rotor, bodies: &[RigidBody]) -> Self {
        Self {
            movers: bodies.iter().map(|body| Mover::of(rotor, body)).collect(),
        }
    }

    /// Kicks `states`, then moves them by `h`; returns the most Newton corrections a body took.
    #[inline(never)]
    pub(super) fn apply(
        &self,
        bodies: &[RigidBody],
        states: &mut [BodyState],
        kick: &Kick,
        memory: &mut Memory,
        h: f64,
    ) -> Result<u32, StepError> {
        let mut most = 0;
        let Kick {
            gravity,
            controls,
            dt,
        } = *kick;
        let loads = gravity.iter().zip(controls);
        let turns = memory.turns.iter().zip(&mut memory.next);
        let each = self.movers.iter().zip(states).zip(loads).zip(turns);
        for (index, (((mover, state), (gravity, control)), turns)) in each.enumerate() {
            match &mover.mobility {
                Mobility::Free => {
                    if dt != 0.0 {
                        state.linear_momentum += dt * (gravity.force + control.force);
                    }
                    state.position += (h * mover.per_mass) * state.linear_momentum;
                }
                Mobility::Pivoted => {}
                Mobility::Fixed => continue,
                Mobility::Driven(drive) => {
                    *state = drive.advance(&bodies[index], state, h);
                    continue;
                }
            }
            let mut p = state.angular_momentum;
            if dt != 0.0 {
                p += dt * (gravity.moment + control.moment);
            }
            match mover.rotor.turn(&bodies[index], &p, state, turns, h) {
                Ok(iterations) => most = most.max(iterations),
                Err(source) => {
                    return Err(StepError::Unsolvable {
                        body: index,
                        source,
                    });
                }
            }
        }
        Ok(most)
    }
}

impl Memory {
    /// Of nothing, for a number of bodies.
    pub(super) fn new(bodies: usize) -> Self {
        Self {
            turns: vec![Turn::default(); bodies],
            next: vec![Turn::default(); bodies],
        }
    }

    /// Forgets the trajectory so far.
    pub(super) fn forget(&mut self) {
        self.turns.fill(Turn::default());
    }

    /// Takes the last drift as part of an accepted step: later starting guesses build on it.
    #[inline]
    pub(super) fn accept(&mut self) {
        std::mem::swap(&mut self.turns, &mut self.next);
    }

    /// Takes the last drift as the first of a trajectory.
    pub(super) fn begin(&mut self) {
        for (turn, next) in self.turns.iter_mut().zip(&self.next) {
            *turn = next.steady();
        }
    }
}

/// Adds the impulse of gravity and controls over `dt` to the momenta.
#[inline]
pub(super) fn kick(
    bodies: &[RigidBody],
    states: &mut [BodyState],
    gravity: &[Load],
    controls: &[Load],
    dt: f64,
) {
    let loads = gravity.iter().zip(controls);
    for ((body, state), (load, control)) in bodies.iter().zip(states).zip(loads) {
        match body.mobility() {
            Mobility::Free => {
                state.linear_momentum += dt * (load.force + control.force);
                state.angular_momentum += dt * (load.moment + control.moment);
            }
            Mobility::Pivoted => state.angular_momentum += dt * (load.moment + control.moment),
            Mobility::Fixed | Mobility::Driven(_) => {}
        }
    }
}
