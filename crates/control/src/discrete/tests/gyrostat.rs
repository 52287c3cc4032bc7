//! Steps of a body with wheels.

use std::sync::Arc;

use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use nalgebra::Vector3;
use num_dual::HyperDual64;

use super::model::{H, State, scenes};
use super::{assert_same, control, differentiated, found, random};
use crate::discrete::stored::SPINNING;
use crate::discrete::{DiscreteDynamics, KickDriftKick, Within};
use crate::problem::Dynamics;
use crate::{Actuation, Transfer};

/// The step as it is defined, with a momentum that the wheels store.
#[test]
fn steps_of_gyrostats_have_the_derivatives_of_steps_made_of_potentials() {
    let mut rng = fastrand::Rng::with_seed(38);
    for scene in scenes(&mut rng).iter().step_by(3) {
        let wheels = (0..4).map(|_| ReactionWheel::new(random::<3>(&mut rng, 1.0), 0.01));
        let wheels = Wheels::new(wheels.collect()).unwrap();
        let actuation = Actuation::wheels(&wheels, &[1.0, 2.0, 1.5, 0.7]).unwrap();
        let ends: Vec<Vector3<f64>> = (0..4)
            .map(|_| scene.state.position + random::<3>(&mut rng, 0.1))
            .collect();
        let plain = scene.transfer(Dynamics::Lgvi);
        let transfer = Transfer {
            actuation: actuation.exchanging(),
            orbit: Some(Arc::from(ends.clone())),
            ..plain
        };
        let steps = KickDriftKick::gyrostat(&transfer).unwrap();
        let (command, lambda) = (
            random::<SPINNING>(&mut rng, 0.5),
            random::<12>(&mut rng, 1.0),
        );
        for slow in [1.0, 1e-6] {
            let mut state = scene.state;
            let size = scene.body.inertia().matrix().trace();
            state.linear_momentum = random(&mut rng, size);
            state.angular_momentum *= slow;
            let (end, derivatives) = found(&steps, 1, &state, &command, &lambda);
            let load = transfer
                .actuation
                .matrix()
                .fixed_columns::<SPINNING>(0)
                .into();
            let expected = differentiated::<12, SPINNING>(&lambda, |mut z, v| {
                // The position is no coordinate.
                z[..3].fill(HyperDual64::from(0.0));
                let mut moved = State::of(&state).moved(z);
                let control = control(&load, &command, v);
                for (end, position) in ends[1..3].iter().enumerate() {
                    moved.x = State::of(&lgvi_dynamics::BodyState {
                        position: *position,
                        ..state
                    })
                    .x;
                    let gravity = scene.load(&moved);
                    for i in 0..3 {
                        moved.gamma[i] += control[i] * (0.5 * H);
                        moved.pi[i] += (gravity[3 + i] + control[3 + i]) * (0.5 * H);
                    }
                    if end == 0 {
                        let stored = moved.gamma;
                        moved.turn_with(scene.body.inertia().matrix(), stored);
                    }
                }
                let mut all = moved.minus(&State::of(&end));
                all[..3].fill(HyperDual64::from(0.0));
                all
            });
            let mut derivatives = derivatives;
            derivatives.a.fixed_view_mut::<3, 3>(0, 0).fill(0.0);
            assert_same(&derivatives, &expected, &format!("{}, {slow}", scene.name));
        }
    }
}

/// Motions within steps of another number follow the same orbit as the steps themselves.
#[test]
fn motions_within_steps_follow_the_resampled_orbit() {
    let mut rng = fastrand::Rng::with_seed(39);
    let scene = &scenes(&mut rng)[0];
    let wheels = (0..4).map(|_| ReactionWheel::new(random::<3>(&mut rng, 1.0), 0.01));
    let wheels = Wheels::new(wheels.collect()).unwrap();
    let actuation = Actuation::wheels(&wheels, &[1.0, 2.0, 1.5, 0.7]).unwrap();
    let line = |k: usize| scene.state.position + k as f64 * Vector3::new(0.1, 0.2, -0.3);
    for intervals in [4, 8, 12] {
        let transfer = Transfer {
            actuation: actuation.exchanging(),
            orbit: Some((0..=8).map(line).collect()),
            intervals,
            ..scene.transfer(Dynamics::Lgvi)
        };
        let steps = KickDriftKick::gyrostat(&transfer).unwrap();
        let mut states = vec![scene.state];
        for k in 0..intervals {
            let none = nalgebra::SVector::<f64, SPINNING>::zeros();
            states.push(steps.next(k, &states[k], &none).unwrap());
        }
        let motions = Within::all(&transfer, &states);
        assert_eq!(motions.len(), intervals);
        for (step, motion) in motions.iter().enumerate() {
            for part in [0.0, 0.5, 1.0] {
                let passed = (step as f64 + part) * 8.0 / intervals as f64;
                let expected = scene.state.position + passed * Vector3::new(0.1, 0.2, -0.3);
                let apart = (motion.at(part).position - expected).norm();
                assert!(apart < 1e-12, "{step} of {intervals}: {apart:e}");
            }
        }
    }
}
