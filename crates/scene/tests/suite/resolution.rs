//! Warnings about steps that are too long, before and after a flight.

use lgvi_dynamics::Load;
use lgvi_scene::{Energies, Rates, Scene};

use crate::shipped::{all, shipped};

/// Two bodies that fall towards each other from a large distance, with a fixed step.
const APPROACH: &str = r#"
title = "A close passage"
[run]
duration = 20.0
steps = 400
integrator = "lgvi"
[gravity.mutual]
constant = 1.0
[[bodies]]
name = "one"
mass = 1.0
inertia = [1.0, 1.0, 1.0]
position = [2.0, 0.0, 0.0]
velocity = [0.0, 0.005, 0.0]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
angular_velocity = [0.0, 0.0, 0.0]
[[bodies]]
name = "other"
mass = 1.0
inertia = [1.0, 1.0, 1.0]
position = [-2.0, 0.0, 0.0]
velocity = [0.0, -0.005, 0.0]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
angular_velocity = [0.0, 0.0, 0.0]
"#;

/// Returns the warnings about a scene's flight without controls: about turns, orbits and energy.
fn said(scene: &Scene, most: u64) -> [Option<String>; 3] {
    let scheme = scene.scheme().unwrap();
    let mut simulation = scene.simulation(scheme).unwrap();
    let controls = vec![Load::default(); scene.bodies.len()];
    let energies = |simulation: &lgvi_dynamics::Simulation| {
        Energies::of(simulation.system(), simulation.states())
    };
    let start = energies(&simulation);
    let mut rates = Rates::default();
    for _ in 0..scene.steps.min(most) {
        rates = rates.max(scene.rates(simulation.system(), simulation.states()));
        simulation.advance(&controls).unwrap();
    }
    [
        scene.long_turn(scheme, rates),
        scene.long_orbit(scheme, rates),
        scene.changed_energy([start, energies(&simulation)]),
    ]
}

fn with(text: &str, changes: &[(&str, &str)]) -> Scene {
    let mut text = text.to_owned();
    for (line, instead) in changes {
        assert!(text.contains(line), "{line}");
        text = text.replace(line, instead);
    }
    Scene::parse("test", &text).unwrap()
}

#[test]
fn nothing_is_said_of_the_shipped_scenes() {
    for scene in all() {
        assert_eq!(said(&scene, 500), [None, None, None], "{}", scene.name);
    }
}

#[test]
fn ten_steps_a_day_are_too_few_for_an_orbit_of_99_minutes() {
    let oblate = shipped("oblate_orbit");
    let few = with(&oblate.text, &[("steps = 8640", "steps = 10")]);
    let [turn, orbit, energy] = said(&few, 10);
    assert_eq!(turn, None, "the rotor is exact");
    let orbit = orbit.unwrap();
    assert!(
        orbit.contains("0.7 steps to an orbit")
            && orbit.contains("7 that Nyström splitting of order 6"),
        "{orbit}"
    );
    assert!(energy.unwrap().contains("what was bound has come loose"));
}

#[test]
fn a_passage_that_the_steps_do_not_resolve_is_told_by_the_energy() {
    let [turn, orbit, energy] = said(&with(APPROACH, &[]), 400);
    assert_eq!(turn, None);
    assert!(orbit.unwrap().contains("`subdivide` where they are needed"));
    let energy = energy.unwrap();
    assert!(
        energy.contains("J, what was bound has come loose"),
        "{energy}"
    );

    // With subdivision where needed, the bodies of the same passage stay bound, though the flight is not very accurate.
    let cut = with(APPROACH, &[("steps = 400", "steps = 400\nsubdivide = 20")]);
    let [turn, orbit, energy] = said(&cut, 400);
    assert_eq!([turn, orbit], [None, None]);
    assert!(energy.is_none_or(|said| !said.contains("loose")));
}

/// Methods with error control give no warning, and neither do driven bodies, whose energy may change.
#[test]
fn methods_that_measure_their_error_are_believed_and_driven_bodies_may_work() {
    let oblate = shipped("oblate_orbit").text;
    let method = "integrator = { name = \"nystrom\", order = 6 }";
    let adaptive = "integrator = { name = \"dormand_prince853\", tolerance = 1e-10 }";
    let changes = [("steps = 8640", "steps = 10"), (method, adaptive)];
    assert_eq!(said(&with(&oblate, &changes), 10), [None, None, None]);

    let driven = "angular_velocity = [0.0, 0.0, 0.0]\n[[bodies]]";
    let spinning = APPROACH.replacen(
        driven,
        "mobility = { uniform = { velocity = [0.0, 3.0, 0.0] } }\n[[bodies]]",
        1,
    );
    let spinning = spinning.replacen("velocity = [0.0, 0.005, 0.0]\n", "", 1);
    assert_eq!(said(&with(&spinning, &[]), 400)[2], None);
}
