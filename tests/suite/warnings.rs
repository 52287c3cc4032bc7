//! What is said of flights that nothing has failed in, and what `--strict` makes of it.

use lgvi_tests::{World, edited, scene};
use serde_json::Value;

/// Ten steps a day for an orbit of 99 minutes: the satellite escapes.
const FEW: [(&str, &str); 1] = [("steps = 8640", "steps = 10")];

fn codes(said: &Value) -> Vec<&str> {
    let warnings = said["warnings"].as_array().unwrap();
    let codes = warnings.iter().map(|warning| {
        assert!(!warning["message"].as_str().unwrap().is_empty());
        warning["code"].as_str().unwrap()
    });
    codes.collect()
}

#[test]
fn steps_that_are_too_long_are_warned_of_and_are_an_error_where_that_is_asked_for() {
    let world = World::new();
    let few = edited(&world, "oblate_orbit", &FEW);
    let few = few.to_str().unwrap();
    for (strict, code) in [(None, 0), (Some("--strict"), 3)] {
        let explained = world.lgvi(["explain", "--json", few].into_iter().chain(strict));
        let explained: Value = explained.finish().expect(code).json();
        assert_eq!(codes(&explained), ["long_step", "changed_energy"]);

        let bag = world.path(&format!("bag{code}"));
        let line = [
            "run",
            "--json",
            "--no-plot",
            few,
            "--bag",
            bag.to_str().unwrap(),
        ];
        let flown: Value = world
            .lgvi(line.into_iter().chain(strict))
            .finish()
            .expect(code)
            .json();
        assert_eq!(codes(&flown), ["long_step", "changed_energy"]);
        assert!(flown["failure"].is_null() && flown["lost"] == 0, "{flown}");
    }
}

#[test]
fn a_sound_flight_is_not_warned_of() {
    let world = World::new();
    let sound = scene("free_body");
    let sound = sound.to_str().unwrap();
    let explained = world.lgvi(["explain", "--strict", sound]);
    assert!(!explained.finish().expect(0).stdout.contains("warning"));
    let bag = world.path("bag");
    let line = [
        "run",
        "--strict",
        "--no-plot",
        sound,
        "--bag",
        bag.to_str().unwrap(),
    ];
    assert!(
        !world
            .lgvi(line)
            .finish()
            .expect(0)
            .stdout
            .contains("warning")
    );
}

/// Half a turn of a ball may be about any axis across: the plans of least cost are a family, and none is a strict minimum.
const HALF_A_TURN: &str = r#"
title = "Half a turn"

[run]
duration = 10.0
steps = 50
integrator = "lgvi"

[[bodies]]
name = "ball"
mass = 1.0
inertia = [1.0, 1.0, 1.0]
position = [0.0, 0.0, 0.0]
velocity = [0.0, 0.0, 0.0]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
angular_velocity = [0.0, 0.0, 0.0]

[maneuver]
body = "ball"
motion = "rotation"

[maneuver.target]
spin_axis = { axis = [1.0, 0.0, 0.0], direction = [-1.0, 0.0, 0.0] }
angular_velocity = [0.0, 0.0, 0.0]
"#;

#[test]
fn a_plan_that_is_not_known_to_be_a_minimum_is_warned_of() {
    let world = World::new();
    let path = world.path("half_a_turn.toml");
    std::fs::write(&path, HALF_A_TURN).unwrap();
    for (strict, code) in [(None, 0), (Some("--strict"), 3)] {
        let bag = world.path(&format!("bag{code}"));
        let line = [
            "run",
            "--json",
            "--no-plot",
            path.to_str().unwrap(),
            "--bag",
            bag.to_str().unwrap(),
        ];
        let flown = world.lgvi(line.into_iter().chain(strict));
        let flown: Value = flown.finish().expect(code).json();
        assert_eq!(codes(&flown), ["not_minimum"]);
    }
}
