//! Plans of the shipped scenes of each class, flown as planned.

use lgvi_control::constraint::{ComponentLimit, Corridor, KeepOutCone, NormLimit};
use lgvi_control::{NewtonSettings, Plan, Start, solve};
use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::Scene;

use crate::shipped::shipped;

fn plan(scene: &Scene) -> Plan {
    let transfer = scene.transfer().unwrap().unwrap();
    let settings = NewtonSettings::default();
    solve(&transfer, Start::Cold, &settings, |_| true).unwrap_or_else(|error| panic!("{error}"))
}

/// Flies a plan by the scene's own integrator without disturbance and returns the planned body's states, one per step.
fn flown(scene: &Scene, plan: &Plan) -> Vec<BodyState> {
    let body = scene.maneuver.as_ref().unwrap().body;
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let mut loads = vec![Load::default(); scene.bodies.len()];
    let mut states = Vec::new();
    for control in &plan.controls {
        loads[body] = *control;
        simulation.advance(&loads).unwrap();
        states.push(simulation.states()[body]);
    }
    states
}

#[test]
fn the_telescope_turns_past_the_sun_within_the_moment_of_its_wheels() {
    let scene = shipped("slew_keep_out");
    let plan = plan(&scene);
    let states = flown(&scene, &plan);
    let miss = scene.miss(states.last().unwrap()).unwrap();
    assert!(miss.norm() < 1e-9, "{miss}");
    let constraints = &scene.maneuver.as_ref().unwrap().constraints;
    let cone: &KeepOutCone = constraints[0].downcast_ref().expect("a cone");
    let [axis, direction] = [cone.axis(), cone.direction()];
    let wheels: &ComponentLimit = constraints[1].downcast_ref().expect("limits");
    let limit = wheels.limit();
    let angles = states
        .iter()
        .map(|state| direction.angle(&(state.attitude * axis)));
    let nearest = angles.fold(f64::INFINITY, f64::min);
    // The shortest path leads straight through the cone, so the optimal path touches its surface.
    assert!((nearest - cone.half_angle()).abs() < 1e-4, "{nearest}");
    let largest = plan
        .controls
        .iter()
        .map(|u| u.moment.amax())
        .fold(0.0, f64::max);
    assert!((largest - limit.x).abs() < 1e-6, "{largest}");
    assert!(plan.controls.iter().all(|u| u.force.norm() == 0.0));
}

#[test]
fn the_chaser_stays_in_the_corridor_within_the_force_of_its_thrusters() {
    let scene = shipped("docking_corridor");
    let plan = plan(&scene);
    let states = flown(&scene, &plan);
    let miss = scene.miss(states.last().unwrap()).unwrap();
    assert!(miss.norm() < 1e-9, "{miss}");
    let constraints = &scene.maneuver.as_ref().unwrap().constraints;
    let corridor: &Corridor = constraints[0].downcast_ref().expect("a corridor");
    let [apex, axis] = [corridor.apex(), corridor.axis()];
    let thrusters: &NormLimit = constraints[1].downcast_ref().expect("a limit");
    let limit = thrusters.limit();
    let angles = states
        .iter()
        .map(|state| axis.angle(&(state.position - apex)));
    let widest = angles.fold(0.0, f64::max);
    assert!((widest - corridor.half_angle()).abs() < 1e-4, "{widest}");
    let largest = plan
        .controls
        .iter()
        .map(|u| u.force.norm())
        .fold(0.0, f64::max);
    assert!((largest - limit).abs() < 1e-6, "{largest}");
    assert!(plan.controls.iter().all(|u| u.moment.norm() == 0.0));
}
