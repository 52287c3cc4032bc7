use super::body::{Body, Effect, Motion, Point, State};
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
                let radius = placement.as_ref().map_or(0.0, |placement| placement.radius);
                Self::Attractor(Attractor {
                    gm: T::splat(token, gm),
                    second,
                    placement: placement.as_ref().map(|placement| {
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
        let zero = self.gm.constant(0.0);
        let zero = Vector::new(zero, zero, zero);
        let (mut force, mut torque) = (zero, zero);
        for Point { mass, position } in &body.points {
            let arm = state.attitude * *position;
            let pull = self.acceleration(state.position + arm) * *mass;
            force = force + pull;
            torque = torque + arm.cross(pull);
        }
        effect.force = effect.force + force;
        effect.moment = effect.moment + state.attitude.tr_mul(torque);
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

    /// The acceleration in the attractor's own frame: `−GM d/r³`, plus the quadrupole term as in
    /// `Harmonic::acceleration`.
    #[inline(always)]
    fn own_acceleration(&self, d: Vector<T>) -> Vector<T> {
        let squared = d.norm_squared();
        let by_r2 = squared.constant(1.0) / squared;
        let root = squared.sqrt();
        let pull = self.gm * (by_r2 * by_r2) * root;
        let straight = d * -pull;
        let Some(second) = &self.second else {
            return straight;
        };
        let by_r5 = by_r2 * root * by_r2 * by_r2;
        let u = *second * d;
        let along = d * (d.dot(u) * 5.0 * by_r2);
        straight + (u * u.x.constant(2.0) - along) * by_r5
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
    for Point { mass, position } in &body.points {
        let arm = state.attitude * *position;
        let pull = acceleration * *mass;
        force = force + pull;
        torque = torque + arm.cross(pull);
    }
    effect.force = effect.force + force;
    effect.moment = effect.moment + state.attitude.tr_mul(torque);
}
