mod coasting;

pub(super) use coasting::Coasting;

use super::rotor::BodyRotation;
use super::warm_start::{Solutions, WarmStart};
use super::{Rotor, StepError};
use crate::rotation::{DiscreteRotation, FreeRotation, Unsolvable};
use crate::{BodyState, Inertia, Load, Mobility, RigidBody};

/// Kicks, and free motion of all bodies over a time, `x ← x + (h/m) γ`, `R ← R F`, `Π ← Fᵀ Π`.
pub(super) struct Drift {
    movers: Movers,
    warm_start: WarmStart<f64>,
}

/// The bodies as their drifts see them, by the kind of their rotations. A new [`Rotor`] is a variant here, with what it
/// derives from a body in an implementation of [`BodyRotation`], and an arm in [`Movers::of`] and in [`Drift::apply`].
enum Movers {
    Discrete(Vec<Mover<DiscreteRotation<f64>>>),
    Exact(Vec<Mover<FreeRotation>>),
}

impl Movers {
    fn of(rotor: Rotor, bodies: &[RigidBody]) -> Self {
        match rotor {
            Rotor::Discrete => Self::Discrete(movers(bodies, |inertia| inertia.rotation)),
            Rotor::Exact => Self::Exact(movers(bodies, FreeRotation::new)),
        }
    }
}

fn movers<T>(bodies: &[RigidBody], rotation: impl Fn(&Inertia) -> T) -> Vec<Mover<T>> {
    let each = bodies.iter().map(|body| Mover {
        mobility: *body.mobility(),
        per_mass: body.mass().recip(),
        rotation: rotation(body.inertia()),
    });
    each.collect()
}

/// A body as its drifts see it.
struct Mover<T> {
    mobility: Mobility,
    /// `1/m`
    per_mass: f64,
    rotation: T,
}

impl<T: BodyRotation> Mover<T> {
    /// Sets `next` to `state` kicked, then moved by `h`, if the body is free or pivoted and its turn is found at once.
    #[inline(always)]
    fn advance(
        &self,
        (state, next): (&BodyState, &mut BodyState),
        impulse: Impulse,
        h: f64,
        solutions: &mut Solutions<f64>,
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
        self.rotation
            .carry((&state.attitude, &p), h, solutions, next)
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
        solutions: &mut Solutions<f64>,
    ) -> Result<u32, Unsolvable> {
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
        let found = self.rotation.find(h, p, solutions.extrapolate())?;
        solutions.note(found.correction);
        (state.attitude, state.angular_momentum) = found.rotation.carry(&state.attitude, p);
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
    movers: &[Mover<impl BodyRotation>],
    bodies: &[RigidBody],
    (states, next): (&[BodyState], &mut [BodyState]),
    kick: Kick,
    h: f64,
    solutions: impl Iterator<Item = Solutions<'a, f64>>,
) -> Result<u32, StepError> {
    let mut most = 0;
    let each = movers.iter().zip(states).zip(next).zip(solutions);
    for (index, (((mover, state), next), mut solutions)) in each.enumerate() {
        let impulse = on(kick, index);
        let iterations = if mover.advance((state, next), impulse, h, &mut solutions) {
            1
        } else {
            *next = *state;
            mover
                .advance_any(&bodies[index], next, impulse, h, &mut solutions)
                .map_err(|source| StepError::of_rotation(index, source))?
        };
        most = most.max(iterations);
    }
    Ok(most)
}

impl Drift {
    /// Of `bodies`, which turn by `rotor`, several times in a step.
    pub(super) fn new(rotor: Rotor, bodies: &[RigidBody], stages: usize) -> Self {
        Self {
            movers: Movers::of(rotor, bodies),
            warm_start: WarmStart::new(0.0, stages, bodies.len()),
        }
    }

    /// Forgets the trajectory so far.
    pub(super) fn forget(&mut self) {
        self.warm_start.forget();
    }

    /// Takes the present step as made.
    #[inline(always)]
    pub(super) fn accept(&mut self) {
        self.warm_start.accept();
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
        stage: usize,
        coasting: Coasting,
    ) -> Result<u32, StepError> {
        if !coasting.bodies.is_empty() {
            return self.coast(bodies, states, kick, h, stage, coasting);
        }
        let solutions = self.warm_start.of_stage(stage);
        match &self.movers {
            Movers::Discrete(movers) => advance(movers, bodies, states, kick, h, solutions),
            Movers::Exact(movers) => advance(movers, bodies, states, kick, h, solutions),
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
