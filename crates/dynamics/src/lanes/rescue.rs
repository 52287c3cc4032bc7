use super::body::State;
use super::end::Ends;
use super::flight::Batch;
use crate::StepError;
use crate::lane::Lane;
use crate::rotation::FreeRotations;

/// Lanes in which the iteration did not find a body's rotation.
pub(super) struct Unsolved<'a> {
    pub(super) batch: &'a Batch<'a>,
    /// Mask whose bit k is set for lane k.
    pub(super) lanes: u32,
    pub(super) body: usize,
    /// Duration of the drift.
    pub(super) h: f64,
}

/// Solves each of these lanes individually, given the state before the rotation and a guess, and stores the state after
/// the rotation and the correction. If no solution exists, the flight of the lane ends.
#[cold]
#[inline(never)]
pub(super) fn rescue<T: Lane>(
    unsolved: &Unsolved,
    (state, guess): (&State<T>, &T),
    (next, correction): (&mut State<T>, &mut T),
    ends: &mut Ends,
) {
    for k in (0..T::COUNT).filter(|k| unsolved.lanes & (1 << k) != 0) {
        let body = &unsolved.batch.members[k].system.bodies()[unsolved.body];
        let p = state.angular_momentum.lane(k);
        match (body.inertia().rotation).find(unsolved.h, &p, guess.lane(k)) {
            Ok(found) => {
                let (attitude, momentum) = found.rotation.carry(&state.attitude.lane(k), &p);
                next.attitude.set_lane(k, &attitude);
                next.angular_momentum.set_lane(k, &momentum);
                correction.set_lane(k, found.correction);
            }
            Err(error) => ends.fail(k, StepError::of_rotation(unsolved.body, error)),
        }
    }
}

/// Sets `next` to `state` rotated freely over `h`, in each of `lanes` individually.
#[cold]
#[inline(never)]
pub(super) fn turn_each<T: Lane>(
    rotation: &FreeRotations<T>,
    state: &State<T>,
    next: &mut State<T>,
    h: f64,
    lanes: u32,
) {
    for k in (0..T::COUNT).filter(|k| lanes & (1 << k) != 0) {
        let (r, p) = (state.attitude.lane(k), state.angular_momentum.lane(k));
        let (attitude, momentum) = rotation.lane(k, &r, &p, h);
        next.attitude.set_lane(k, &attitude);
        next.angular_momentum.set_lane(k, &momentum);
    }
}
