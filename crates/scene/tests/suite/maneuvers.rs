use lgvi_control::shooting;
use lgvi_dynamics::Method;
use lgvi_dynamics::integrator::Rotor;
use lgvi_scene::{Integration, Scene};
use nalgebra::SVector;

use crate::{BODY, RUN, assert_refused, with};

const MANEUVER: &str = r#"
[maneuver]
body = "craft"
[maneuver.target]
position = [3.2, 0.6, 0.1]
velocity = [0.0, 0.6, 0.0]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
angular_velocity = [0.0, 0.0, 0.0]
"#;

pub(crate) const ROCK: &str = r#"
[[bodies]]
name = "rock"
mass = 5.0
multipole = { order = 4, ellipsoid = [1.0, 0.8, 0.6] }
mobility = "fixed"
position = [0.0, 0.0, 0.0]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
"#;

pub(crate) fn text(gravity: &str, rock: &str) -> String {
    let run = with(RUN, "\"lgvi\"", "\"lie_euler\"");
    format!("{run}\n{gravity}\n[[bodies]]\nname = \"craft\"{BODY}{rock}{MANEUVER}")
}

/// Checks that the simulation of the plan, with the scene's own gravity, ends in the planned state.
fn assert_flown_as_planned(text: &str) {
    let scene = Scene::parse("test", text).unwrap();
    assert_eq!(scene.flown_otherwise(scene.scheme().unwrap()), None);
    let maneuver = scene.maneuver.as_ref().unwrap();
    let transfer = scene.transfer().unwrap().unwrap();
    let plan = shooting::solve(
        &transfer,
        SVector::zeros(),
        &maneuver.solver.shooting(),
        |_| true,
    )
    .unwrap();
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let mut controls = vec![Default::default(); scene.bodies.len()];
    for control in &plan.extremal.controls {
        controls[maneuver.body] = *control;
        simulation.advance(&controls).unwrap();
    }
    let miss = scene.miss(&simulation.states()[maneuver.body]).unwrap();
    assert!(miss.norm() < 1e-11, "{miss}");
}

#[test]
fn the_planner_knows_every_fixed_field() {
    assert_flown_as_planned(&text("[gravity.mutual]\nconstant = 1.0", ROCK));
    let planet = "[gravity.central]\ngm = 5.0\nj2 = 0.02\nreference_radius = 1.0\npole = [0, 1, 1]\n[gravity.uniform]\nacceleration = [0, 0, -0.3]";
    assert_flown_as_planned(&text(planet, ""));
}

#[test]
fn an_automatic_integrator_of_a_maneuver_is_that_of_the_plan() {
    let text = with(&text("", ""), "\"lie_euler\"", "\"auto\"");
    let scene = Scene::parse("test", &text).unwrap();
    let expected = Method::Lgvi(Rotor::default());
    assert_eq!(scene.integration, Integration::Method(expected));
}

#[test]
fn the_planner_refuses_fields_that_move() {
    let mutual = "[gravity.mutual]\nconstant = 1.0";
    let spinning = "mobility = { uniform = { spin = [0, 0, 1] } }";
    let spinning = with(ROCK, "mobility = \"fixed\"", spinning);
    let parts = [
        "`gravity.mutual.constant` is 1.0",
        "fixed",
        "rock would move",
    ];
    assert_refused(&text(mutual, &spinning), &parts);
    let free = "velocity = [0, 0, 0]\nangular_velocity = [0, 0, 0]";
    let free = with(ROCK, "mobility = \"fixed\"", free);
    assert_refused(&text(mutual, &free), &parts);
    // A body that does not attract others may move.
    Scene::parse("test", &text("", &spinning)).unwrap();
    let pivoted = text("", ROCK);
    let pivoted = with(
        &pivoted,
        "velocity = [0.0, 0.5, 0.0]\n",
        "mobility = \"pivoted\"\n",
    );
    let parts = ["`maneuver.body` is \"craft\"", "free to move"];
    assert_refused(&pivoted, &parts);
}
