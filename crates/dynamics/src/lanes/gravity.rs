use nalgebra::Vector3;

use super::body::{Body, Effect, Mass, Motion, Point, State};
use super::multipole::{Multipole, acceleration};
use super::mutual::Mutual;
use crate::gravity::{Form, SourceShape};
use crate::lane::{Lane, Matrix, Vector};

/// A gravity model acting on all bodies in every lane.
pub(super) enum Gravity<T> {
    Attractor(Attractor<T>),
    Uniform(Vector<T>),
    Mutual(Mutual<T>),
}

/// A fixed attractor.
pub(super) struct Attractor<T> {
    gm: T,
    /// The matrix `½ Q`, if the attractor has second moments.
    second: Option<Matrix<T>>,
    /// Position of its center of mass.
    center: Vector<T>,
    /// Position and attitude, or `None` at the origin.
    placement: Option<(Vector<T>, Matrix<T>)>,
    /// Radius that no body may enter.
    radius: T,
}

impl<T: Lane> Gravity<T> {
    pub(super) fn new(token: T::Token, form: &Form, bodies: &[Body<T>]) -> Self {
        match form {
            Form::Attractor { shape, placement } => {
                let (gm, second) = match shape {
                    SourceShape::Point { gm } => (*gm, None),
                    SourceShape::Quadrupole { gm, second } => {
                        (*gm, Some(Matrix::splat(token, second)))
                    }
                };
                let placed = placement.as_ref();
                let radius = placed.map_or(0.0, |placement| placement.radius);
                let center = placed.map_or_else(Vector3::zeros, |placement| placement.position);
                Self::Attractor(Attractor {
                    gm: T::splat(token, gm),
                    second,
                    center: Vector::splat(token, &center),
                    placement: placed.map(|placement| {
                        let position = Vector::splat(token, &placement.position);
                        (position, Matrix::splat(token, &placement.attitude))
                    }),
                    radius: T::splat(token, radius),
                })
            }
            Form::Uniform { acceleration } => Self::Uniform(Vector::splat(token, acceleration)),
            Form::Mutual { constant } => Self::Mutual(Mutual::new(token, *constant, bodies)),
        }
    }

    /// Adds the loads on `bodies` in `states` to `effects`.
    #[inline(always)]
    pub(super) fn add_to(
        &mut self,
        bodies: &[Body<T>],
        states: &[State<T>],
        effects: &mut [Effect<T>],
    ) {
        match self {
            Self::Attractor(attractor) => {
                for ((body, state), effect) in bodies.iter().zip(states).zip(effects) {
                    attractor.add_to(body, state, effect);
                }
            }
            Self::Uniform(acceleration) => {
                for ((body, state), effect) in bodies.iter().zip(states).zip(effects) {
                    add_uniform(*acceleration, body, state, effect);
                }
            }
            Self::Mutual(mutual) => mutual.add_to(bodies, states, effects),
        }
    }

    /// Mask whose bit k is set if no body in lane k has entered another body or a source.
    #[inline(always)]
    pub(super) fn clear(&self, bodies: &[Body<T>], states: &[State<T>]) -> u32 {
        let mut entered = 0;
        match self {
            Self::Attractor(attractor) => {
                for (body, state) in bodies.iter().zip(states) {
                    if body.motion != Motion::Held {
                        entered |= attractor.entered(body, state);
                    }
                }
            }
            Self::Uniform(_) => {}
            Self::Mutual(_) => {
                for (index, (body, state)) in bodies.iter().zip(states).enumerate() {
                    for (other, there) in bodies.iter().zip(states).skip(index + 1) {
                        if body.motion != Motion::Held || other.motion != Motion::Held {
                            let distance = (state.position - there.position).norm_squared().sqrt();
                            entered |= distance.below(body.radius + other.radius);
                        }
                    }
                }
            }
        }
        !entered
    }
}

impl<T: Lane> Attractor<T> {
    #[inline(always)]
    fn add_to(&self, body: &Body<T>, state: &State<T>, effect: &mut Effect<T>) {
        match &body.mass {
            Mass::Points(points) => self.add_to_points(points, state, effect),
            Mass::Multipole(multipole) => self.add_to_multipole(multipole, state, effect),
        }
    }

    #[inline(always)]
    fn add_to_points(&self, points: &[Point<T>], state: &State<T>, effect: &mut Effect<T>) {
        let zero = self.gm.constant(0.0);
        let zero = Vector::new(zero, zero, zero);
        let (mut force, mut torque) = (zero, zero);
        for Point { mass, position } in points {
            let arm = state.attitude * *position;
            let pull = self.acceleration(state.position + arm) * *mass;
            force = force + pull;
            torque = torque + arm.cross(pull);
        }
        effect.force = effect.force + force;
        effect.moment = effect.moment + state.attitude.tr_mul(torque);
    }

    /// The source acts on the mass, and its monopole on the quadrupole.
    #[inline(always)]
    fn add_to_multipole(&self, multipole: &Multipole<T>, state: &State<T>, effect: &mut Effect<T>) {
        let force = self.acceleration(state.position) * multipole.strength;
        let e = state.attitude.tr_mul(self.center - state.position);
        let a = multipole.aspherical(e) * self.gm;
        effect.force = effect.force + (force - state.attitude * a);
        effect.moment = effect.moment + a.cross(e);
    }

    /// The acceleration in the inertial frame.
    #[inline(always)]
    fn acceleration(&self, place: Vector<T>) -> Vector<T> {
        match &self.placement {
            None => self.own_acceleration(place),
            Some((position, attitude)) => {
                let d = attitude.tr_mul(place - *position);
                *attitude * self.own_acceleration(d)
            }
        }
    }

    /// The acceleration in the attractor's own frame.
    #[inline(always)]
    fn own_acceleration(&self, d: Vector<T>) -> Vector<T> {
        acceleration(self.gm, self.second.as_ref(), d)
    }

    #[inline(always)]
    fn entered(&self, body: &Body<T>, state: &State<T>) -> u32 {
        let d = match &self.placement {
            None => state.position,
            Some((position, _)) => state.position - *position,
        };
        d.norm_squared().sqrt().below(self.radius + body.radius)
    }
}

#[inline(always)]
fn add_uniform<T: Lane>(
    acceleration: Vector<T>,
    body: &Body<T>,
    state: &State<T>,
    effect: &mut Effect<T>,
) {
    let zero = acceleration.x.constant(0.0);
    let zero = Vector::new(zero, zero, zero);
    let (mut force, mut torque) = (zero, zero);
    match &body.mass {
        Mass::Points(points) => {
            for Point { mass, position } in points {
                let arm = state.attitude * *position;
                let pull = acceleration * *mass;
                force = force + pull;
                torque = torque + arm.cross(pull);
            }
            torque = state.attitude.tr_mul(torque);
        }
        Mass::Multipole(multipole) => force = acceleration * multipole.strength,
    }
    effect.force = effect.force + force;
    effect.moment = effect.moment + torque;
}
