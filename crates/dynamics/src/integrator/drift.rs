mod coasting;

pub(super) use coasting::Coasting;

use super::rotor::Turn;
use super::turn::{Known, Turns};
use super::{Rotor, StepError};
use crate::rotation::{
    Chart, Direct, FreeRotation, General, PreprocessedDmv, PreprocessedError, Principal,
};
use crate::{BodyState, Inertia, Load, Mobility, RigidBody};

/// Kicks, and free motion of all bodies over a time, `x ← x + (h/m) γ`, `R ← R F`, `Π ← Fᵀ Π`.
pub(super) struct Drift {
    movers: Movers,
    turns: Turns,
}

/// The bodies as their drifts see them, by the kind of their turns. A new [`Rotor`] is a variant here, with what it derives
/// from a body in an implementation of [`Turn`], and an arm in [`Movers::of`] and in [`Drift::apply`].
enum Movers {
    /// The implicit equation in the Cayley chart, body axes being principal axes.
    Principal(Vec<Mover<Direct<Principal>>>),
    /// The same for any body axes.
    General(Vec<Mover<Direct<General>>>),
    /// The implicit equation in another chart.
    Chart(Vec<Mover<(Chart, Direct<General>)>>),
    /// The implicit equation with preprocessed moments.
    Preprocessed(Vec<Mover<PreprocessedDmv>>),
    /// The exact solution.
    Exact(Vec<Mover<FreeRotation>>),
}

impl Movers {
    fn of(rotor: Rotor, bodies: &[RigidBody]) -> Self {
        let general = |inertia: &Inertia| Direct::general(inertia);
        match rotor {
            Rotor::Discrete(Chart::Cayley) => {
                let principal = bodies.iter().map(|body| Direct::principal(body.inertia()));
                match principal.collect::<Option<Vec<_>>>() {
                    Some(turns) => {
                        Self::Principal(bodies.iter().zip(turns).map(Mover::of).collect())
                    }
                    None => Self::General(movers(bodies, general)),
                }
            }
            Rotor::Discrete(chart) => {
                Self::Chart(movers(bodies, |inertia| (chart, general(inertia))))
            }
            Rotor::Preprocessed(order) => Self::Preprocessed(movers(bodies, |inertia| {
                PreprocessedDmv::new(inertia, order)
            })),
            Rotor::Exact => Self::Exact(movers(bodies, FreeRotation::new)),
        }
    }
}

fn movers<T>(bodies: &[RigidBody], turn: impl Fn(&Inertia) -> T) -> Vec<Mover<T>> {
    let each = bodies
        .iter()
        .map(|body| Mover::of((body, turn(body.inertia()))));
    each.collect()
}

/// A body as its drifts see it.
struct Mover<T> {
    mobility: Mobility,
    /// `1/m`
    per_mass: f64,
    turn: T,
}

impl<T> Mover<T> {
    fn of((body, turn): (&RigidBody, T)) -> Self {
        Self {
            mobility: *body.mobility(),
            per_mass: body.mass().recip(),
            turn,
        }
    }
}

impl<T: Turn> Mover<T> {
    /// Sets `next` to `state` kicked, then moved by `h`, if the body is free or pivoted and its turn is found at once.
    #[inline(always)]
    fn advance(
        &self,
        (state, next): (&BodyState, &mut BodyState),
        impulse: Impulse,
        h: f64,
        known: &mut Known,
    ) -> bool {
        let free = match self.mobility {
            Mobility::Free => true,
            Mobility::Pivoted => false,
            Mobility::Fixed | Mobility::Driven(_) => return false,
        };
        let mut momentum = state.linear_momentum;
        let mut p = state.angular_momentum;
        if let Some((load, dt)) = impulse {
            p += dt * load.moment;
            if free {
                momentum += dt * load.force;
            }
        }
        let mut position = state.position;
        if free {
            position += (h * self.per_mass) * momentum;
        }
        next.position = position;
        next.linear_momentum = momentum;
        self.turn.carry((&state.attitude, &p), h, known, next)
    }

    /// Kicks any body and moves it by `h`; returns the Newton corrections it took.
    #[cold]
    #[inline(never)]
    fn advance_any(
        &self,
        body: &RigidBody,
        state: &mut BodyState,
        impulse: Impulse,
        h: f64,
        known: &mut Known,
    ) -> Result<u32, PreprocessedError> {
        if let Some((load, dt)) = impulse {
            kick_body(body.mobility(), state, load, dt);
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
        let found = self.turn.solve(body.inertia(), h, p, known.guess())?;
        known.note(found.s);
        (state.attitude, state.angular_momentum) = found.turn.carry(&state.attitude, p);
        Ok(found.iterations)
    }
}

/// What acts on the bodies, one load a body or nothing at all, and for how long.
pub(super) type Kick<'a> = (&'a [Load], f64);

/// What of it acts on one body.
type Impulse<'a> = Option<(&'a Load, f64)>;

#[inline(always)]
fn on<'a>((loads, dt): Kick<'a>, body: usize) -> Impulse<'a> {
    loads.get(body).map(|load| (load, dt))
}

/// Sets `next` to `states` kicked, then moved by `h`; returns the most Newton corrections a body took.
///
/// A function of its own for each kind of turn: all that it works on stays in registers from the first load to the last
/// store, and bodies overlap.
#[inline(never)]
fn advance<'a>(
    movers: &[Mover<impl Turn>],
    bodies: &[RigidBody],
    (states, next): (&[BodyState], &mut [BodyState]),
    kick: Kick,
    h: f64,
    known: impl Iterator<Item = Known<'a>>,
) -> Result<u32, StepError> {
    let mut most = 0;
    let each = movers.iter().zip(states).zip(next).zip(known);
    for (index, (((mover, state), next), mut known)) in each.enumerate() {
        let impulse = on(kick, index);
        let iterations = if mover.advance((state, next), impulse, h, &mut known) {
            1
        } else {
            *next = *state;
            mover
                .advance_any(&bodies[index], next, impulse, h, &mut known)
                .map_err(|source| StepError::of_turn(index, source))?
        };
        most = most.max(iterations);
    }
    Ok(most)
}

impl Drift {
    /// Of `bodies`, which turn by `rotor`, several times in a step.
    pub(super) fn new(rotor: Rotor, bodies: &[RigidBody], times: usize) -> Self {
        Self {
            movers: Movers::of(rotor, bodies),
            turns: Turns::new(times, bodies.len()),
        }
    }

    /// Forgets the trajectory so far.
    pub(super) fn forget(&mut self) {
        self.turns.forget();
    }

    /// Takes the present step as made.
    #[inline(always)]
    pub(super) fn accept(&mut self) {
        self.turns.accept();
    }

    /// Sets `next` to `states` kicked, then moved by `h`, for the given time in a step; returns the most Newton
    /// corrections a body took.
    #[inline(always)]
    pub(super) fn apply(
        &mut self,
        bodies: &[RigidBody],
        states: (&[BodyState], &mut [BodyState]),
        kick: Kick,
        h: f64,
        time: usize,
        coasting: Coasting,
    ) -> Result<u32, StepError> {
        if !coasting.bodies.is_empty() {
            return self.coast(bodies, states, kick, h, time, coasting);
        }
        let known = self.turns.known(time);
        match &self.movers {
            Movers::Principal(movers) => advance(movers, bodies, states, kick, h, known),
            Movers::General(movers) => advance(movers, bodies, states, kick, h, known),
            Movers::Chart(movers) => advance(movers, bodies, states, kick, h, known),
            Movers::Preprocessed(movers) => advance(movers, bodies, states, kick, h, known),
            Movers::Exact(movers) => advance(movers, bodies, states, kick, h, known),
        }
    }
}

/// Kicks `states`; returns whether they are finite to all appearances: sums may overflow where terms do not.
#[inline(always)]
pub(super) fn end(bodies: &[RigidBody], states: &mut [BodyState], kick: Kick) -> bool {
    let mut zero = 0.0;
    for (index, (body, state)) in bodies.iter().zip(states).enumerate() {
        if let Some((load, dt)) = on(kick, index) {
            kick_body(body.mobility(), state, load, dt);
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

/// Adds the impulse of loads over `dt` to the momenta.
#[inline]
pub(super) fn kick(bodies: &[RigidBody], states: &mut [BodyState], loads: &[Load], dt: f64) {
    for ((body, state), load) in bodies.iter().zip(states).zip(loads) {
        kick_body(body.mobility(), state, load, dt);
    }
}

#[inline(always)]
fn kick_body(mobility: &Mobility, state: &mut BodyState, load: &Load, dt: f64) {
    match mobility {
        Mobility::Free => {
            state.linear_momentum += dt * load.force;
            state.angular_momentum += dt * load.moment;
        }
        Mobility::Pivoted => state.angular_momentum += dt * load.moment,
        Mobility::Fixed | Mobility::Driven(_) => {}
    }
}
