use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use crate::drag::Drag;
use crate::{BodyError, BodyState, Inertia, Load, RigidBody};

/// Bodies that are parts of wholes. A whole is a body by itself or several bodies that are joined.
#[derive(Clone)]
pub(super) struct Assembly {
    /// The bodies that are parts.
    parts: Vec<RigidBody>,
    /// Index of the whole of each part, and the pose of the part in it, or `None` if the part is the whole.
    seats: Vec<(usize, Option<Pose>)>,
    wholes: Vec<RigidBody>,
}

/// The pose of a part in the frame of a whole.
#[derive(Clone, Copy)]
struct Pose {
    /// `d`: from the center of mass of the whole.
    position: Vector3<f64>,
    /// `A`: rotation matrix from the frame of the part to that of the whole.
    rotation: Matrix3<f64>,
}

impl Assembly {
    /// Bodies that are not joined.
    pub(super) fn apart(parts: &[RigidBody]) -> Self {
        Self {
            parts: parts.to_vec(),
            seats: (0..parts.len()).map(|whole| (whole, None)).collect(),
            wholes: parts.to_vec(),
        }
    }

    /// The bodies that are parts.
    pub(super) fn parts(&self) -> &[RigidBody] {
        &self.parts
    }

    /// The wholes, in the order of their first parts.
    pub(super) fn wholes(&self) -> &[RigidBody] {
        &self.wholes
    }

    /// The whole that a part belongs to.
    pub(super) fn whole(&self, part: usize) -> usize {
        self.seats[part].0
    }

    /// The first part of a whole.
    pub(super) fn first_part(&self, whole: usize) -> usize {
        let mut seats = self.seats.iter();
        seats.position(|seat| seat.0 == whole).unwrap_or(whole)
    }

    /// Joins the wholes of two parts in the relative pose that they have in `states`, and sets these to the states after
    /// joining. `wholes` are the states of the wholes.
    ///
    /// Returns the loss of kinetic energy.
    pub(super) fn join(
        &mut self,
        pair: [usize; 2],
        states: &mut [BodyState],
        wholes: &mut Vec<BodyState>,
    ) -> Result<f64, BodyError> {
        let [one, other] = pair.map(|part| self.whole(part));
        let (kept, removed) = (one.min(other), one.max(other));
        let seats = self.seats.iter().enumerate();
        let members = seats.filter(|(_, seat)| [kept, removed].contains(&seat.0));
        let members: Vec<_> = members.map(|(part, _)| part).collect();
        let (body, state, poses) = self.compose(&members, states)?;
        self.wholes[kept] = body;
        self.wholes.remove(removed);
        wholes[kept] = state;
        wholes.remove(removed);
        for seat in &mut self.seats {
            seat.0 = match seat.0 {
                whole if whole == removed => kept,
                whole => whole - usize::from(whole > removed),
            };
        }
        let mut loss = 0.0;
        for (part, pose) in members.into_iter().zip(poses) {
            self.seats[part].1 = Some(pose);
            let before = std::mem::replace(&mut states[part], self.state(part, &wholes[kept]));
            let body = &self.parts[part];
            let linear = before.linear_momentum - states[part].linear_momentum;
            let angular = before.angular_momentum - states[part].angular_momentum;
            loss += 0.5 * linear.norm_squared() / body.mass()
                + 0.5 * angular.dot(&(body.inertia().inverse() * angular));
        }
        Ok(loss)
    }

    /// The rigid body that parts in these states form, its state, and their poses in it. Its axes are those of the first
    /// part.
    fn compose(
        &self,
        members: &[usize],
        states: &[BodyState],
    ) -> Result<(RigidBody, BodyState, Vec<Pose>), BodyError> {
        let first = states[members[0]];
        let each = || {
            members
                .iter()
                .map(|part| (&self.parts[*part], &states[*part]))
        };
        let mass: f64 = each().map(|(body, _)| body.mass()).sum();
        // Differences of positions keep more digits than positions, which may be those of orbits.
        let from_first = |state: &BodyState| state.position - first.position;
        let center = each().map(|(body, state)| body.mass() * from_first(state));
        let center = center.sum::<Vector3<f64>>() / mass;
        let linear_momentum: Vector3<f64> = each().map(|(_, state)| state.linear_momentum).sum();
        let velocity = linear_momentum / mass;

        let (mut poses, mut inertia) = (Vec::new(), Matrix3::zeros());
        let mut angular_momentum = Vector3::zeros();
        for (part, (body, state)) in each().enumerate() {
            let arm = from_first(state) - center;
            let relative = state.linear_momentum - body.mass() * velocity;
            angular_momentum += arm.cross(&relative) + state.attitude * state.angular_momentum;
            let pose = Pose {
                position: first.attitude.tr_mul(&arm),
                rotation: match part {
                    0 => Matrix3::identity(),
                    _ => first.attitude.tr_mul(&state.attitude),
                },
            };
            let (a, d) = (&pose.rotation, hat(&pose.position));
            inertia += a * body.inertia().matrix() * a.transpose() - body.mass() * d * d;
            poses.push(pose);
        }
        let mut body = RigidBody::new(mass, Inertia::new(inertia)?, Vec::new())?;
        let drags = members.iter().filter_map(|part| self.parts[*part].drag());
        body.drag = drags.cloned().reduce(Drag::and).map(Box::new);
        let state = BodyState {
            position: first.position + center,
            linear_momentum,
            attitude: first.attitude,
            angular_momentum: first.attitude.tr_mul(&angular_momentum),
        };
        Ok((body, state, poses))
    }

    /// The state of a part of a whole in this state.
    fn state(&self, part: usize, of: &BodyState) -> BodyState {
        let (whole, pose) = &self.seats[part];
        let Some(pose) = pose else {
            return *of;
        };
        let (position, attitude) = pose.of(of);
        let whole = &self.wholes[*whole];
        let angular_velocity = of.angular_velocity(whole);
        let turning = angular_velocity.cross(&pose.position);
        BodyState::from_velocities(
            &self.parts[part],
            position,
            of.velocity(whole) + of.attitude * turning,
            attitude,
            pose.rotation.tr_mul(&angular_velocity),
        )
    }

    /// Sets the states of the parts to those in the wholes.
    pub(super) fn spread(&self, wholes: &[BodyState], states: &mut [BodyState]) {
        for (part, state) in states.iter_mut().enumerate() {
            *state = self.state(part, &wholes[self.whole(part)]);
        }
    }

    /// Sets position and attitude of the parts to those in the wholes.
    pub(super) fn place(&self, wholes: &[BodyState], states: &mut [BodyState]) {
        for ((whole, pose), state) in self.seats.iter().zip(states) {
            let of = &wholes[*whole];
            (state.position, state.attitude) = match pose {
                Some(pose) => pose.of(of),
                None => (of.position, of.attitude),
            };
        }
    }

    /// Adds the loads on the parts to those on the wholes: `F += F_i`, `M += A M_i + d × Rᵀ F_i`.
    pub(super) fn gather(&self, wholes: &[BodyState], loads: &[Load], sums: &mut [Load]) {
        for ((whole, pose), load) in self.seats.iter().zip(loads) {
            sums[*whole] += match pose {
                None => *load,
                Some(pose) => {
                    let force = wholes[*whole].attitude.tr_mul(&load.force);
                    Load {
                        force: load.force,
                        moment: pose.rotation * load.moment + pose.position.cross(&force),
                    }
                }
            };
        }
    }
}

impl Pose {
    /// Position and attitude of the part of a whole in this state.
    fn of(&self, whole: &BodyState) -> (Vector3<f64>, Matrix3<f64>) {
        let r = &whole.attitude;
        (whole.position + r * self.position, r * self.rotation)
    }
}
