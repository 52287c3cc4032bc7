mod coasting;

pub(super) use coasting::Coasting;

use super::rotor::{ActuatedRotation, BodyRotation, GyrostatRotation};
use super::warm_start::{Solutions, WarmStart};
use super::{Rotor, StepError};
use crate::rotation::{DiscreteRotation, FreeRotation, Unsolvable};
use crate::{BodyState, Load, Mobility, RigidBody};

/// Kicks, and free motion of all bodies over a time, `x ← x + (h/m) γ`, `R ← R F`, `Π ← Fᵀ Π`.
pub(super) struct Drift {
    movers: Movers,
    warm_start: WarmStart<f64>,
}

/// The data of all bodies for their drifts, by kind of rotor. A new [`Rotor`] needs a variant here, an implementation
/// of [`BodyRotation`] with the data derived from a body, and an arm in [`Movers::of`] and in [`Drift::apply`].
enum Movers {
    Discrete(Vec<Mover<DiscreteRotation<f64>>>),
    Exact(Vec<Mover<FreeRotation>>),
    /// The same where some bodies have wheels or thrusters.
    ActuatedDiscrete(Vec<Mover<ActuatedRotation<DiscreteRotation<f64>>>>),
    ActuatedExact(Vec<Mover<ActuatedRotation<FreeRotation>>>),
}

impl Movers {
    fn of(rotor: Rotor, bodies: &[RigidBody]) -> Self {
        let actuated = bodies.iter().any(RigidBody::has_actuators);
        match (rotor, actuated) {
            (Rotor::Discrete, false) => Self::Discrete(movers(bodies, |b| b.inertia().rotation)),
            (Rotor::Exact, false) => {
                Self::Exact(movers(bodies, |b| FreeRotation::new(b.inertia())))
            }
            (Rotor::Discrete, true) => {
                Self::ActuatedDiscrete(movers(bodies, ActuatedRotation::new))
            }
            (Rotor::Exact, true) => Self::ActuatedExact(movers(bodies, ActuatedRotation::new)),
        }
    }
}

fn movers<T>(bodies: &[RigidBody], rotation: impl Fn(&RigidBody) -> T) -> Vec<Mover<T>> {
    let each = bodies.iter();
    each.map(|body| Mover::new(body, rotation(body))).collect()
}

/// The data of a body for its drifts.
struct Mover<T> {
    course: Course,
    /// `1/m`.
    per_mass: f64,
    rotation: T,
}

/// The motion of a body's origin in a drift.
#[derive(Clone, Copy)]
enum Course {
    /// Uniform.
    Straight,
    /// At rest.
    Held,
    /// Anything else.
    Other,
}

impl Course {
    fn of(body: &RigidBody) -> Self {
        match body.mobility() {
            Mobility::Free if body.drag().is_none() => Self::Straight,
            Mobility::Pivoted => Self::Held,
            Mobility::Free | Mobility::Fixed | Mobility::Driven(_) => Self::Other,
        }
    }
}

impl<T> Mover<T> {
    fn new(body: &RigidBody, rotation: T) -> Self {
        Self {
            course: Course::of(body),
            per_mass: body.mass().recip(),
            rotation,
        }
    }
}

impl<T: BodyRotation> Mover<T> {
    /// Sets `next` to `state`, kicked and then moved by `h`. Returns false if the body is neither free, without drag, nor
    /// pivoted, or if the first pass does not find its rotation.
    #[inline(always)]
    fn advance(
        &self,
        (state, next): (&BodyState, &mut BodyState),
        impulse: Impulse,
        h: f64,
        solutions: &mut Solutions<f64>,
    ) -> bool {
        let free = match self.course {
            Course::Straight => true,
            Course::Held => false,
            Course::Other => return false,
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

    /// Kicks any body and moves it by `h`. Returns the number of Newton corrections.
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
            Mobility::Free => displace(body, state, self.per_mass, h),
            Mobility::Pivoted => {}
            Mobility::Fixed => return Ok(0),
            Mobility::Driven(drive) => {
                *state = drive.advance(body, state, h);
                return Ok(0);
            }
        }
        self.rotation.carry_any(state, h, solutions)
    }
}

/// The loads on the bodies, one per body or empty, and their duration.
pub(super) type Kick<'a> = (&'a [Load], f64);

/// The load on one body and its duration.
type Impulse<'a> = Option<(&'a Load, f64)>;

#[inline(always)]
fn on<'a>((loads, dt): Kick<'a>, body: usize) -> Impulse<'a> {
    loads.get(body).map(|load| (load, dt))
}

/// Sets `next` to `states`, kicked and then moved by `h`. Returns the largest number of Newton corrections of a body.
///
/// This is a separate function for each kind of rotation, so that all its data stays in registers between the first
/// load and the last store, and the work on successive bodies overlaps.
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

/// The same where some bodies have wheels or thrusters.
#[cold]
#[inline(never)]
fn advance_actuated<'a>(
    movers: &mut [Mover<ActuatedRotation<impl GyrostatRotation>>],
    bodies: &[RigidBody],
    states: (&[BodyState], &mut [BodyState]),
    kick: Kick,
    h: f64,
    solutions: impl Iterator<Item = Solutions<'a, f64>>,
) -> Result<u32, StepError> {
    for (mover, body) in movers.iter_mut().zip(bodies) {
        if mover.per_mass == body.mass().recip() {
            mover.rotation.update(body);
        } else {
            *mover = Mover::new(body, ActuatedRotation::new(body));
        }
    }
    advance(movers, bodies, states, kick, h, solutions)
}

impl Drift {
    /// Creates the drifts of `bodies`, with the rotations of `rotor`, for `stages` drifts per step.
    pub(super) fn new(rotor: Rotor, bodies: &[RigidBody], stages: usize) -> Self {
        Self {
            movers: Movers::of(rotor, bodies),
            warm_start: WarmStart::new(0.0, stages, bodies.len()),
        }
    }

    /// Discards the history of the trajectory.
    pub(super) fn forget(&mut self) {
        self.warm_start.forget();
    }

    /// Accepts the current step.
    #[inline(always)]
    pub(super) fn accept(&mut self) {
        self.warm_start.accept();
    }

    /// Sets `next` to `states`, kicked and then moved by `h`, in the given stage of a step. Returns the largest number
    /// of Newton corrections of a body.
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
        match &mut self.movers {
            Movers::Discrete(movers) => advance(movers, bodies, states, kick, h, solutions),
            Movers::Exact(movers) => advance(movers, bodies, states, kick, h, solutions),
            Movers::ActuatedDiscrete(all) => {
                advance_actuated(all, bodies, states, kick, h, solutions)
            }
            Movers::ActuatedExact(all) => advance_actuated(all, bodies, states, kick, h, solutions),
        }
    }
}

/// Kicks `states`. Returns false if a state may not be finite; finite states can also return false, because the sum may
/// overflow.
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
        // Add one by one: pairwise loads would span data that has just been stored. The third row of the attitude is
        // computed from all its other entries.
        zero += 0.0 * (x + y + z + u + v + w + p + q + r + state.attitude[(2, 2)]);
    }
    zero == 0.0
}

/// Moves the center of mass of a free body. Without drag the displacement has the rounding of [`Mover::advance`].
#[inline]
fn displace(body: &RigidBody, state: &mut BodyState, per_mass: f64, h: f64) {
    if body.drag().is_some() {
        body.glide(state, h, 1.0);
    } else {
        state.position += (h * per_mass) * state.linear_momentum;
    }
}

/// Adds the impulse of the loads over `dt` to the momenta.
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
