//! What a flight costs the allocator on the thread of its loop.

#![allow(clippy::unwrap_used)]
#![allow(unsafe_code, reason = "an allocator that counts")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use lgvi_dynamics::Load;
use lgvi_msgs::shm::FeedbackHeader;
use lgvi_node::{Gain, Limits, feedback_sequence};
use lgvi_propagator::{Controls, Flight};
use lgvi_scene::Scene;

struct Counting;

thread_local! {
    /// Allocations and bytes given back on this thread.
    static COUNT: Cell<(usize, usize)> = const { Cell::new((0, 0)) };
}

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set((COUNT.get().0 + 1, COUNT.get().1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        COUNT.set((COUNT.get().0, COUNT.get().1 + layout.size()));
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

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
    let (reference, gain) = (scene.bodies[0].state, Gain::from_element(1e-3));
    let sequence = feedback_sequence(
        scene,
        0,
        first_step,
        &vec![Load::default(); intervals],
        &vec![reference; intervals],
        &vec![gain; intervals],
        &Limits::NONE,
    );
    let message = sequence.unwrap().to_message(scene).unwrap();
    assert!(FeedbackHeader::from_message(&message).unwrap().is_some());
    Arc::new(Controls::of_message(scene, &message).unwrap())
}

#[test]
fn a_flight_under_feedback_leaves_the_allocator_alone() {
    let scene = Scene::parse("test", SCENE).unwrap();
    let mut flight = Flight::new(&scene).unwrap();
    // As the node's other thread does, this holds each sequence until the flight has let go of it.
    let sequences: Vec<_> = (0..5).map(|n| controls(&scene, 10 * n)).collect();
    let before = COUNT.get();
    for sequence in &sequences {
        flight.accept(Arc::clone(sequence)).unwrap();
        for _ in 0..10 {
            flight.advance().unwrap();
        }
    }
    assert_eq!(COUNT.get(), before, "allocations and bytes given back");
    let held = sequences.iter().map(Arc::strong_count);
    assert_eq!(held.collect::<Vec<_>>(), [1, 1, 1, 2, 2]);
}
