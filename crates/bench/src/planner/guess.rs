//! The cold guess of the structured solver at all steps, for solvers that need one: a cubic path between both ends, the
//! momenta of its steps, and the controls that fly it.

use lgvi_dynamics::gravity::Field;
use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_lie::{exp, log, right_jacobian_inverse, vee};
use nalgebra::{Matrix3, Vector3};

/// States at `0 … N` and controls `u_1 … u_N`.
pub(crate) struct Guess {
    pub states: Vec<BodyState>,
    pub controls: Vec<Load>,
}

/// The path from one state to the other in `intervals` steps of `h`.
pub(crate) fn cold(
    body: &RigidBody,
    field: &impl Field,
    h: f64,
    intervals: usize,
    from: &BodyState,
    to: &BodyState,
) -> Guess {
    let path = hermite(body, h * intervals as f64, intervals, from, to);
    let turns: Vec<_> = path
        .windows(2)
        .map(|pair| pair[0].1.tr_mul(&pair[1].1))
        .collect();
    let mut states: Vec<_> = path
        .windows(2)
        .zip(&turns)
        .map(|(pair, turn)| {
            let moved = turn * body.inertia().nonstandard();
            BodyState {
                position: pair[0].0,
                linear_momentum: (body.mass() / h) * (pair[1].0 - pair[0].0),
                attitude: pair[0].1,
                angular_momentum: vee(&(moved - moved.transpose())) / h,
            }
        })
        .collect();
    states[0] = *from;
    states.push(*to);
    let controls = states
        .windows(2)
        .zip(&turns)
        .map(|(pair, turn)| {
            let [state, next] = [&pair[0], &pair[1]];
            let gravity = field.load(body, &next.position, &next.attitude);
            let carried = turn.tr_mul(&state.angular_momentum);
            Load {
                force: (next.linear_momentum - state.linear_momentum) / h - gravity.force,
                moment: (next.angular_momentum - carried) / h - gravity.moment,
            }
        })
        .collect();
    Guess { states, controls }
}

/// Position and attitude at `0 … N`: Hermite's cubics, the attitude's in the rotation vector from the first.
fn hermite(
    body: &RigidBody,
    duration: f64,
    intervals: usize,
    from: &BodyState,
    to: &BodyState,
) -> Vec<(Vector3<f64>, Matrix3<f64>)> {
    let cubic = |t: f64, ends: [Vector3<f64>; 2], rates: [Vector3<f64>; 2]| {
        let (s, r) = (t * t, 1.0 - t);
        let rise = s * (3.0 - 2.0 * t);
        (1.0 - rise) * ends[0] + rise * ends[1] + duration * t * r * (r * rates[0] - t * rates[1])
    };
    let rotation = log(&from.attitude.tr_mul(&to.attitude));
    let velocities = [from.velocity(body), to.velocity(body)];
    let spins = [
        from.angular_velocity(body),
        right_jacobian_inverse(&rotation) * to.angular_velocity(body),
    ];
    (0..=intervals)
        .map(|k| {
            let t = k as f64 / intervals as f64;
            let position = cubic(t, [from.position, to.position], velocities);
            let turned = cubic(t, [Vector3::zeros(), rotation], spins);
            (position, from.attitude * exp(&turned))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use lgvi_dynamics::gravity::Central;
    use lgvi_dynamics::{Load, Simulation};

    use super::cold;
    use crate::planner::case::Case;

    #[test]
    fn its_controls_fly_its_states_from_the_first_step_to_the_target() {
        for scene in crate::planner::SCENES {
            let case = Case::load(scene).unwrap().with_steps(100);
            let (named, target) = (case.body().unwrap(), case.target().unwrap());
            let field = Central {
                gm: case.attractor().unwrap().gm,
            };
            let h = case.scene.h();
            let guess = cold(&named.body, &field, h, 100, &named.state, &target);
            let method = case.scene.scheme().unwrap().method;
            let states = vec![guess.states[1]];
            let mut flight = Simulation::new(case.scene.system(), states, method, h).unwrap();
            for control in &guess.controls[1..] {
                let controls: [Load; 1] = [*control];
                flight.advance(&controls).unwrap();
            }
            let missed = lgvi_control::miss(&target, &flight.states()[0]);
            assert!(missed.norm() < 1e-12, "{scene}: {missed}");
        }
    }
}
