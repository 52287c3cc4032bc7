use lgvi_lie::{Quaternion, compose, rotate_back};
use nalgebra::Vector3;

use super::turn::{Strip, Turns};
use super::{Rotor, StepError};
use crate::rotation::{
    Chart, Direct, FreeRotation, General, PreprocessedDmv, PreprocessedError, Principal,
};
use crate::{BodyState, Inertia, Load, Mobility, RigidBody};

/// Free motion of all bodies over a time, `x ← x + (h/m) γ`, `R ← R F`, `Π ← Fᵀ Π`.
pub(super) struct Drift {
    movers: Vec<Mover>,
}

/// A body as its drifts see it.
struct Mover {
    mobility: Mobility,
    /// `1/m`
    per_mass: f64,
    rotor: BodyRotor,
}

/// How a body's rotation over a drift is found, chosen once. A new [`Rotor`] is a variant here, with what it derives from
/// the body, and an arm in [`BodyRotor::of`], `at_once` and `solve`: a jump that the processor foresees.
enum BodyRotor {
    /// The implicit equation in the Cayley chart, body axes being principal axes.
    Principal(Direct<Principal>),
    /// The same for any body axes.
    General(Direct<General>),
    /// The implicit equation in another chart.
    Chart(Chart, Direct<General>),
    /// The implicit equation with preprocessed moments.
    Preprocessed(PreprocessedDmv),
    /// The exact solution.
    Exact(FreeRotation),
}

impl BodyRotor {
    fn of(rotor: Rotor, body: &RigidBody) -> Self {
        let inertia = body.inertia();
        match rotor {
            Rotor::Discrete(Chart::Cayley) => Direct::principal(inertia)
                .map_or_else(|| Self::General(Direct::general(inertia)), Self::Principal),
            Rotor::Discrete(chart) => Self::Chart(chart, Direct::general(inertia)),
            Rotor::Preprocessed(order) => Self::Preprocessed(PreprocessedDmv::new(inertia, order)),
            Rotor::Exact => Self::Exact(FreeRotation::new(inertia)),
        }
    }

    /// The Cayley vector of a turn by `h` from angular momentum `p`, if a guess of s is good, and what s is.
    #[inline(always)]
    fn at_once(&self, h: f64, p: &Vector3<f64>, guess: f64) -> Option<(Vector3<f64>, f64)> {
        match self {
            Self::Principal(equation) => equation.solve(h, p, guess),
            Self::General(equation) => equation.solve(h, p, guess),
            Self::Chart(..) | Self::Preprocessed(_) | Self::Exact(_) => None,
        }
    }

    /// The same with all that it may take.
    fn solve(
        &self,
        inertia: &Inertia,
        h: f64,
        p: &Vector3<f64>,
        guess: f64,
    ) -> Result<Turned, PreprocessedError> {
        let (relative, s) = match self {
            Self::Principal(equation) => equation.solve_on(inertia, h, p, guess)?,
            Self::General(equation) => equation.solve_on(inertia, h, p, guess)?,
            Self::Chart(chart, equation) => equation.solve_in(*chart, inertia, h, p, guess)?,
            Self::Preprocessed(dmv) => (dmv.step(p, h)?, 0.0),
            Self::Exact(rotation) => {
                let (turn, angular_momentum) = rotation.flow(p, h);
                return Ok(Turned {
                    turn,
                    angular_momentum,
                    iterations: 0,
                    s: 0.0,
                });
            }
        };
        Ok(Turned {
            turn: Quaternion::from_cayley(&relative.cayley),
            angular_momentum: rotate_back(&relative.cayley, p),
            iterations: relative.iterations,
            s,
        })
    }
}

/// The outcome of a body's rotation over a drift.
struct Turned {
    turn: Quaternion,
    angular_momentum: Vector3<f64>,
    /// Newton corrections.
    iterations: u32,
    /// What the next guess builds on.
    s: f64,
}

impl Mover {
    fn of(rotor: Rotor, body: &RigidBody) -> Self {
        Self {
            mobility: *body.mobility(),
            per_mass: body.mass().recip(),
            rotor: BodyRotor::of(rotor, body),
        }
    }

    /// Kicks a body and moves it by `h` if it is free and turns by what is found at once; else leaves it as it is.
    #[inline(always)]
    fn advance(
        &self,
        state: &mut BodyState,
        (gravity, control, dt): (&Load, &Load, f64),
        (strip, present): (&mut Strip, usize),
        h: f64,
    ) -> bool {
        if !matches!(self.mobility, Mobility::Free) {
            return false;
        }
        let mut momentum = state.linear_momentum;
        let mut p = state.angular_momentum;
        if dt != 0.0 {
            momentum += dt * (gravity.force + control.force);
            p += dt * (gravity.moment + control.moment);
        }
        if let BodyRotor::Exact(rotation) = &self.rotor {
            state.linear_momentum = momentum;
            state.position += (h * self.per_mass) * momentum;
            let (turn, angular_momentum) = rotation.flow(&p, h);
            state.angular_momentum = angular_momentum;
            state.attitude = turn.compose(&state.attitude);
            return true;
        }
        let Some((f, s)) = self.rotor.at_once(h, &p, strip.guess(present)) else {
            return false;
        };
        strip.note(present, s);
        state.linear_momentum = momentum;
        state.position += (h * self.per_mass) * momentum;
        state.angular_momentum = rotate_back(&f, &p);
        state.attitude = compose(&state.attitude, &f);
        true
    }

    /// Kicks any body and moves it by `h`; returns the Newton corrections it took.
    #[cold]
    #[inline(never)]
    fn advance_any(
        &self,
        body: &RigidBody,
        state: &mut BodyState,
        (gravity, control, dt): (&Load, &Load, f64),
        (strip, present): (&mut Strip, usize),
        h: f64,
    ) -> Result<u32, PreprocessedError> {
        if dt != 0.0 {
            kick_body(body.mobility(), state, gravity, control, dt);
        }
        match body.mobility() {
            Mobility::Free => state.position += (h * self.per_mass) * state.linear_momentum,
            Mobility::Pivoted => {}
            Mobility::Fixed => return Ok(0),
            Mobility::Driven(drive) => {
                *state = drive.advance(body, state, h);
                return Ok(0);
            }
        }
        let p = &state.angular_momentum;
        let guess = strip.guess(present);
        let turned = self.rotor.solve(body.inertia(), h, p, guess)?;
        strip.note(present, turned.s);
        state.angular_momentum = turned.angular_momentum;
        state.attitude = turned.turn.compose(&state.attitude);
        Ok(turned.iterations)
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
    #[inline]
    pub(super) fn apply(
        &self,
        bodies: &[RigidBody],
        states: &mut [BodyState],
        kick: &Kick,
        turns: &mut Turns,
        h: f64,
    ) -> Result<u32, StepError> {
        let mut most = 0;
        let (strips, present) = turns.strips();
        let loads = kick.gravity.iter().zip(kick.controls);
        let each = self.movers.iter().zip(states).zip(loads).zip(strips);
        for (index, (((mover, state), (gravity, control)), strip)) in each.enumerate() {
            let load = (gravity, control, kick.dt);
            let iterations = if mover.advance(state, load, (strip, present), h) {
                1
            } else {
                mover
                    .advance_any(&bodies[index], state, load, (strip, present), h)
                    .map_err(|source| StepError::of_turn(index, source))?
            };
            most = most.max(iterations);
        }
        Ok(most)
    }

    /// Kicks `states`; returns whether they are finite to all appearances: sums may overflow where terms do not.
    #[inline(always)]
    pub(super) fn end(&self, states: &mut [BodyState], kick: &Kick) -> bool {
        let mut zero = 0.0;
        let loads = kick.gravity.iter().zip(kick.controls);
        for ((mover, state), (gravity, control)) in self.movers.iter().zip(states).zip(loads) {
            if kick.dt != 0.0 {
                kick_body(&mover.mobility, state, gravity, control, kick.dt);
            }
            let [x, y, z] = state.position.into();
            let [u, v, w] = state.linear_momentum.into();
            let [p, q, r] = state.angular_momentum.into();
            // One after the other: two at a time they would be loaded across what has just been stored. The third row
            // of the attitude is made of all of the others.
            zero += 0.0 * (x + y + z + u + v + w + p + q + r + state.attitude[(2, 2)]);
        }
        zero == 0.0
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
    for ((body, state), (gravity, control)) in bodies.iter().zip(states).zip(loads) {
        kick_body(body.mobility(), state, gravity, control, dt);
    }
}

#[inline(always)]
fn kick_body(mobility: &Mobility, state: &mut BodyState, gravity: &Load, control: &Load, dt: f64) {
    match mobility {
        Mobility::Free => {
            state.linear_momentum += dt * (gravity.force + control.force);
            state.angular_momentum += dt * (gravity.moment + control.moment);
        }
        Mobility::Pivoted => state.angular_momentum += dt * (gravity.moment + control.moment),
        Mobility::Fixed | Mobility::Driven(_) => {}
    }
}
