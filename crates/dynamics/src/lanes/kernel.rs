use super::body::{Body, Effect, Motion, Rotation, State};
use super::end::{self, Ends};
use super::flight::{Batch, Outcome, Thrust};
use super::gravity::Gravity;
use super::rescue::{Unsolved, rescue, turn_each};
use crate::Load;
use crate::integrator::warm_start::WarmStart;
use crate::lane::Lane;
use crate::rotation::FreeRotations;

/// Steps after which a flight is told of.
const BLOCK: u64 = 256;

/// Integrates at most as many members as there are lanes.
#[inline(always)]
pub(super) fn fly<T: Lane>(token: T::Token, batch: &Batch, outcomes: &mut Vec<Outcome>) {
    let mut flock = Flock::<T>::new(token, batch);
    flock.fly();
    flock.ends.land(&flock.states, batch, outcomes);
}

/// The systems in the lanes, integrated by the steps of [`Splitting`](crate::integrator::Splitting).
struct Flock<'a, T> {
    batch: &'a Batch<'a>,
    bodies: Vec<Body<T>>,
    gravity: Vec<Gravity<T>>,
    /// States at the beginning of the current substep, and at the beginning of the step if it has several substeps.
    states: Vec<State<T>>,
    begun: Vec<State<T>>,
    /// States within the current substep.
    next: Vec<State<T>>,
    /// Gravity at the beginning of the substep, and later in it.
    effects: Vec<Effect<T>>,
    later: Vec<Effect<T>>,
    /// Sum of gravity and thrust.
    total: Vec<Effect<T>>,
    /// Factors of the thrust in each lane.
    factors: Effect<T>,
    warm_start: WarmStart<T>,
    ends: Ends,
}

impl<'a, T: Lane> Flock<'a, T> {
    #[inline(never)]
    fn new(token: T::Token, batch: &'a Batch<'a>) -> Self {
        let layout = &batch.layout;
        let count = layout.motions.len();
        let bodies: Vec<_> = (0..count)
            .map(|index| Body::new(token, index, batch))
            .collect();
        let none = Effect::splat(token, &Load::default());
        let mut states = vec![State::zero(token); count];
        let mut factors = none;
        for (k, (own, member)) in batch.states.iter().zip(batch.members).enumerate() {
            for (state, from) in states.iter_mut().zip(own) {
                state.set_lane(k, from);
            }
            factors.force.set_lane(k, &member.force);
            factors.moment.set_lane(k, &member.moment);
        }
        let forms = layout.forms.iter();
        Self {
            batch,
            gravity: forms
                .map(|form| Gravity::new(token, form, &bodies))
                .collect(),
            bodies,
            begun: states.clone(),
            next: states.clone(),
            states,
            effects: vec![none; count],
            later: vec![none; count],
            total: vec![none; count],
            factors,
            warm_start: WarmStart::new(T::splat(token, 0.0), layout.stages.len(), count),
            ends: Ends::new(batch.members.len()),
        }
    }

    #[inline(always)]
    fn fly(&mut self) {
        let flight = self.batch.flight;
        let substeps = flight.substeps.max(1);
        let h = match substeps {
            1 => flight.h,
            substeps => flight.h / f64::from(substeps),
        };
        self.attract(When::Begin);
        let mut known = true;
        let mut begun = 0;
        while begun < flight.steps {
            let end = flight.steps.min(begun + BLOCK);
            for step in begun..end {
                if substeps > 1 {
                    self.begun.copy_from_slice(&self.states);
                }
                let thrust = self.thrust(step);
                for _ in 0..substeps {
                    if !known {
                        self.attract(When::Begin);
                    }
                    known = self.substep(thrust.as_ref(), h);
                    if self.ends.failing() {
                        let begun = if substeps > 1 {
                            &self.begun
                        } else {
                            &self.states
                        };
                        if self.ends.ground(begun, step) {
                            return;
                        }
                    }
                    self.warm_start.accept();
                    std::mem::swap(&mut self.states, &mut self.next);
                }
            }
            (self.batch.flown)((end - begun) * self.batch.members.len() as u64);
            begun = end;
        }
    }

    /// The thrust of a step in each lane, and the index of its body.
    #[inline(always)]
    fn thrust(&self, step: u64) -> Option<(usize, Effect<T>)> {
        let Thrust { body, loads } = self.batch.flight.thrust?;
        let load = loads.get(usize::try_from(step).ok()?)?;
        if !load.acts() {
            return None;
        }
        let constant = self.factors.constant(load);
        Some((body, constant.component_mul(&self.factors)))
    }

    /// Makes one step of the method in `next`. Returns true if `effects` holds the gravity at its end.
    #[inline(always)]
    fn substep(&mut self, thrust: Option<&(usize, Effect<T>)>, h: f64) -> bool {
        let batch = self.batch;
        for (index, &(b, a)) in batch.layout.stages.iter().enumerate() {
            if index > 0 && b != 0.0 {
                self.attract(When::Later);
            }
            let impulse = (b != 0.0).then_some(b * h);
            self.stage(index, thrust, impulse, a * h);
        }
        let last = batch.layout.last_kick;
        if last != 0.0 {
            self.attract(When::Later);
            let effects = acting(&self.gravity, &self.later, &mut self.total, thrust);
            for ((body, state), effect) in self.bodies.iter().zip(&mut self.next).zip(effects) {
                state.kick(body.motion, effect, last * h);
            }
            std::mem::swap(&mut self.effects, &mut self.later);
        }
        end::check(
            &mut self.ends,
            batch,
            &self.bodies,
            &self.gravity,
            &self.next,
        );
        last != 0.0
    }

    /// Computes gravity at the beginning of the substep or at its current state.
    #[inline(always)]
    fn attract(&mut self, when: When) {
        let (states, effects) = match when {
            When::Begin => (&self.states, &mut self.effects),
            When::Later => (&self.next, &mut self.later),
        };
        for effect in effects.iter_mut() {
            effect.clear();
        }
        for gravity in &mut self.gravity {
            gravity.add_to(&self.bodies, states, effects);
        }
    }

    /// Makes a kick over the time `impulse`, if any, and a drift over `h`.
    #[inline(always)]
    fn stage(
        &mut self,
        index: usize,
        thrust: Option<&(usize, Effect<T>)>,
        impulse: Option<f64>,
        h: f64,
    ) {
        let effects = if index == 0 {
            &self.effects
        } else {
            &self.later
        };
        let effects = match impulse {
            Some(_) => acting(&self.gravity, effects, &mut self.total, thrust),
            None => &[],
        };
        let each = self.bodies.iter().zip(self.warm_start.of_stage(index));
        for (number, (body, mut solutions)) in each.enumerate() {
            let mut state = if index == 0 {
                self.states[number]
            } else {
                self.next[number]
            };
            if body.motion == Motion::Held {
                self.next[number] = state;
                continue;
            }
            if let (Some(effect), Some(dt)) = (effects.get(number), impulse) {
                state.kick(body.motion, effect, dt);
            }
            if body.motion == Motion::Free {
                let drift = state.linear_momentum * (body.per_mass * h);
                state.position = state.position + drift;
            }
            let flying = self.ends.flying();
            let next = &mut self.next[number];
            next.position = state.position;
            next.linear_momentum = state.linear_momentum;
            let rotation = match &body.rotation {
                Rotation::Discrete(rotation) => rotation,
                Rotation::Free(rotation) => {
                    turn(rotation, &state, next, h, flying);
                    continue;
                }
            };
            let guess = solutions.extrapolate();
            let solved = rotation.solve(h, state.angular_momentum, guess, flying);
            let (attitude, angular_momentum) = solved
                .rotation
                .carry(&state.attitude, state.angular_momentum);
            next.attitude = attitude;
            next.angular_momentum = angular_momentum;
            let mut correction = solved.correction;
            let unsolved = flying & !solved.lanes;
            if unsolved != 0 {
                let lanes = Unsolved {
                    batch: self.batch,
                    lanes: unsolved,
                    body: number,
                    h,
                };
                let ends = &mut self.ends;
                rescue(&lanes, (&state, &guess), (next, &mut correction), ends);
            }
            solutions.note(correction);
        }
    }
}

/// Sets `next` to `state` rotated freely over `h`, in the lanes that are `flying`.
// A function of its own, which leaves the registers of the other rotor alone.
#[inline(never)]
fn turn<T: Lane>(
    rotation: &FreeRotations<T>,
    state: &State<T>,
    next: &mut State<T>,
    h: f64,
    flying: u32,
) {
    let others = state.position.x.vectorize(
        #[inline(always)]
        || {
            let turn = rotation.flow(state.angular_momentum, h, flying);
            next.attitude = turn.rotation.compose(turn.factor, &state.attitude);
            next.angular_momentum = turn.momentum;
            flying & !turn.lanes
        },
    );
    if others != 0 {
        turn_each(rotation, state, next, h, others);
    }
}

#[derive(Clone, Copy)]
enum When {
    Begin,
    Later,
}

/// The sum of gravity and thrust, one load per body, or an empty slice if nothing acts.
#[inline(always)]
fn acting<'b, T: Lane>(
    gravity: &[Gravity<T>],
    effects: &'b [Effect<T>],
    total: &'b mut [Effect<T>],
    thrust: Option<&(usize, Effect<T>)>,
) -> &'b [Effect<T>] {
    match thrust {
        None if gravity.is_empty() => &[],
        None => effects,
        Some((body, thrust)) => {
            for (number, (total, effect)) in total.iter_mut().zip(effects).enumerate() {
                *total = *effect;
                if number == *body {
                    *total = effect.plus(thrust);
                }
            }
            total
        }
    }
}
