//! What a flight costs the allocator on the thread of its loop.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use allocation_counter::{AllocationInfo, measure};
use lgvi_common::{Feedback, Gain, Limits, control_sequence};
use lgvi_dynamics::Load;
use lgvi_propagator::{Controls, Flight};
use lgvi_scene::Scene;

const SCENE: &str = r#"
title = "A craft in free space"
[run]
duration = 100.0
steps = 1000
integrator = "lgvi"
[[bodies]]
name = "craft"
mass = 1.5
inertia = [1.0, 2.0, 2.5]
position = [0, 0, 0]
velocity = [0, 0, 0]
attitude = { w = 1, x = 0, y = 0, z = 0 }
angular_velocity = [0, 0.1, 0]
[maneuver]
body = "craft"
[maneuver.target]
position = [1, 0, 0]
velocity = [0, 0, 0]
attitude = { w = 1, x = 0, y = 0, z = 0 }
angular_velocity = [0, 0, 0]
[disturbance]
seed = 1
force_error = 0.01
"#;

fn controls(scene: &Scene, first_step: u64) -> Arc<Controls> {
    let intervals = 1000;
    let law = Feedback {
        reference: &vec![scene.bodies[0].state; intervals],
        gains: &vec![Gain::from_element(1e-3); intervals],
        limits: &Limits::NONE,
    };
    let loads = vec![Load::default(); intervals];
    let message = control_sequence(scene, 0, first_step, &loads, Some(law)).unwrap();
    let controls = Controls::of_message(scene, &message).unwrap();
    assert!(controls.law.is_some());
    Arc::new(controls)
}

#[test]
fn a_flight_under_feedback_leaves_the_allocator_alone() {
    let scene = Scene::parse("test", SCENE).unwrap();
    let mut flight = Flight::new(&scene).unwrap();
    // As the node's other thread does, this holds each sequence until the flight has let go of it.
    let sequences: Vec<_> = (0..5).map(|n| controls(&scene, 10 * n)).collect();
    let taken = measure(|| {
        for sequence in &sequences {
            flight.accept(Arc::clone(sequence)).unwrap();
            for _ in 0..10 {
                flight.advance().unwrap();
            }
        }
    });
    assert_eq!(taken, AllocationInfo::default());
    let held = sequences.iter().map(Arc::strong_count);
    assert_eq!(held.collect::<Vec<_>>(), [1, 1, 1, 2, 2]);
}
