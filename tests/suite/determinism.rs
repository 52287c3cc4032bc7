//! The same scene gives the same bits, and `lgvi verify` sees every bit that is another.

use std::path::PathBuf;

use lgvi_msgs::msg::{ControlSequence, Scene, SystemState};
use lgvi_tests::{Recording, World, scene};

const STATE: &str = "/lgvi_propagator/state";

/// The number that differs from `value` in its last bit.
fn flip(value: &mut f64) {
    *value = f64::from_bits(value.to_bits() ^ 1);
}

#[test]
fn one_flipped_bit_of_a_state_is_found_and_named() {
    type Pick = fn(&mut SystemState) -> &mut f64;
    let cases: [(usize, &str, &str, Pick); 6] = [
        (0, "dumbbell1", "position[0]", |state| {
            &mut state.bodies[0].position[0]
        }),
        (1, "dumbbell2", "position[2]", |state| {
            &mut state.bodies[1].position[2]
        }),
        (777, "dumbbell1", "linear_momentum[1]", |state| {
            &mut state.bodies[0].linear_momentum[1]
        }),
        (8_000, "dumbbell2", "attitude[8]", |state| {
            &mut state.bodies[1].attitude[8]
        }),
        (15_000, "dumbbell2", "angular_momentum[2]", |state| {
            &mut state.bodies[1].angular_momentum[2]
        }),
        (42, "the system's", "time", |state| &mut state.time),
    ];
    let world = World::new();
    let (_, bag) = world.fly(&scene("two_dumbbells"), "flight");
    let flight = Recording::read(&bag);
    for (step, body, field, pick) in cases {
        let mut altered = flight.clone();
        altered.edit::<SystemState>(STATE, step, |state| flip(pick(state)));
        let bag = world.path(&format!("step_{step}"));
        altered.write(&bag);
        let verdict = world.verify(&bag, 1);
        let found = verdict.difference.unwrap();
        let expected = (step as u64, body, field);
        assert_eq!(
            (found.step, found.body.as_str(), found.field.as_str()),
            expected
        );
    }

    let arguments = [PathBuf::from("verify"), world.path("step_777")];
    let spoken = world.lgvi(arguments);
    let spoken = spoken.finish().expect(1).stdout;
    assert!(
        spoken.contains("differs at step 777 (state 778): dumbbell1 linear_momentum[1] is"),
        "{spoken}"
    );
}

#[test]
fn an_altered_control_or_scene_is_found() {
    let world = World::new();
    let (_, bag) = world.fly(&scene("inclination_change"), "flight");
    let flight = Recording::read(&bag);

    let mut control = flight.clone();
    control.edit(
        "/lgvi_propagator/flown_control",
        0,
        |sequence: &mut ControlSequence| {
            sequence.force[300].x *= 1.0 + 1e-9;
        },
    );
    control.write(&world.path("control"));
    let difference = world.verify(&world.path("control"), 1).difference.unwrap();
    assert_eq!(difference.step, 301);
    assert_eq!(difference.field, "linear_momentum[0]");

    let mut scene = flight;
    scene.edit("/lgvi_propagator/scene", 0, |scene: &mut Scene| {
        scene.text = scene.text.replace("gm = 1.0", "gm = 1.000000001");
    });
    scene.write(&world.path("scene"));
    let difference = world.verify(&world.path("scene"), 1).difference.unwrap();
    assert_eq!(difference.step, 1);
}
