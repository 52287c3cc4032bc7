//! The discretization error of a maneuver that replaces `auto` by the method of its plan.

use lgvi_dynamics::{Load, Method};
use lgvi_scene::Scene;
use nalgebra::Vector3;

/// A CubeSat that performs a slew in a low orbit, in SI.
const SLEW: &str = r#"
title = "A slew in low orbit"
[run]
duration = 400.0
steps = 400
integrator = { name = "auto", tolerance = 1e-6 }
[gravity.central]
gm = 3.986004418e14
[[bodies]]
name = "cubesat"
mass = 4.0
inertia = [0.04, 0.045, 0.02]
position = [6.878e6, 0.0, 0.0]
velocity = [0.0, 7612.0, 0.0]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
angular_velocity = [0.0, 0.0, 0.0]
[maneuver]
body = "cubesat"
motion = "rotation"
[maneuver.target]
attitude = { w = 0.6, x = 0.0, y = 0.8, z = 0.0 }
angular_velocity = [0.0, 0.0, 0.0]
"#;

fn scene(change: [&str; 2]) -> Scene {
    let [line, instead] = change;
    assert!(SLEW.contains(line));
    Scene::parse("slew", &SLEW.replace(line, instead)).unwrap()
}

/// Returns controls that turn the satellite one way and back.
fn controls(steps: usize) -> Vec<Load> {
    let moment = |step: usize| if step < steps / 2 { 6e-7 } else { -6e-7 };
    let load = |step| Load {
        force: Vector3::zeros(),
        moment: Vector3::new(0.0, moment(step), 1e-7),
    };
    (0..steps).map(load).collect()
}

#[test]
fn a_slew_by_auto_ends_within_the_tolerance() {
    let scene = scene(["", ""]);
    let scheme = scene.scheme().unwrap();
    assert!(matches!(scheme.method, Method::Lgvi(_)));
    for controls in [Vec::new(), controls(400)] {
        let error = scene.discretization_error(scheme, &controls).unwrap();
        assert!(error < 1e-6, "{error:e}");
        assert_eq!(scene.coarse_steps(scheme, &controls), None);
    }
}

/// Reports the error of a first-order method on the orbit, and likewise that of a tolerance too tight for the steps.
#[test]
fn what_misses_the_tolerance_is_said() {
    let first_order = scene(["motion =", "dynamics = \"lie_euler\"\nmotion ="]);
    let fewer = scene(["tolerance = 1e-6", "tolerance = 1e-9"]);
    for (scene, part) in [
        (first_order, "the plan in steps of Lie–Euler ends off"),
        (fewer, "the plan in steps of LGVI ends off"),
    ] {
        let scheme = scene.scheme().unwrap();
        let said = scene.coarse_steps(scheme, &controls(400)).unwrap();
        assert!(said.starts_with(part), "{said}");
        let free = scene.coarse_steps(scheme, &[]).unwrap();
        assert!(
            free.starts_with("even without controls the flight"),
            "{free}"
        );
    }
    let asked_for = scene(["{ name = \"auto\", tolerance = 1e-6 }", "\"lie_euler\""]);
    let scheme = asked_for.scheme().unwrap();
    assert_eq!(asked_for.coarse_steps(scheme, &[]), None);
}

/// The recommended number of steps meets the tolerance.
#[test]
fn the_steps_that_are_said_to_do_do() {
    let of = |steps: usize| {
        let text = SLEW.replace("steps = 400", &format!("steps = {steps}"));
        Scene::parse("slew", &text.replace("1e-6", "1e-9")).unwrap()
    };
    let few = of(400);
    let scheme = few.scheme().unwrap();
    let said = few.coarse_steps(scheme, &controls(400)).unwrap();
    let (_, end) = said.split_once("about ").unwrap();
    let steps: usize = end.split_once(' ').unwrap().0.parse().unwrap();
    // The same controls, each held for several steps.
    let each = steps.div_ceil(400);
    let many = of(400 * each);
    let same = controls(400).into_iter();
    let same: Vec<_> = same
        .flat_map(|load| std::iter::repeat_n(load, each))
        .collect();
    assert_eq!(many.coarse_steps(scheme, &same), None, "{said}");
}

/// Halving the steps of a second-order method reduces the error to a quarter.
#[test]
fn the_error_is_that_of_the_method() {
    let error = |steps: usize| {
        let scene = scene(["steps = 400", &format!("steps = {steps}")]);
        let scheme = scene.scheme().unwrap();
        scene
            .discretization_error(scheme, &controls(steps))
            .unwrap()
    };
    let ratio = error(100) / error(200);
    assert!((3.9..4.1).contains(&ratio), "{ratio}");
}
