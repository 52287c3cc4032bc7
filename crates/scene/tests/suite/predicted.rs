//! Targets and constraints relative to another body, whose motion is predicted.

use std::any::{Any, TypeId};

use lgvi_control::constraint::{Corridor, KeepOutCone, KeepOutSphere, Moving, StateConstraint};
use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::{Scene, Seen};
use nalgebra::{Matrix3, Vector3};

use crate::{assert_refused, with};

const REST: &str = "attitude = { w = 1, x = 0, y = 0, z = 0 }\nangular_velocity = [0, 0, 0]\n";
const TARGET: &str = "relative_to = { body = \"target\", axes = \"body\" }\nposition = [0.3, -0.2, 0.1]\nvelocity = [0.05, 0.02, -0.04]\n\
    attitude = { w = 0.6, x = 0.8, y = 0, z = 0 }\nangular_velocity = [0.4, 0.1, -0.2]\n";

/// A maneuver beside a target that tumbles on an ellipse, a beacon that is driven and a tower that stands.
fn text(keys: &str, target: &str) -> String {
    format!(
        "title = \"Predicted\"\n[run]\nduration = 1.0\nsteps = 50\nintegrator = \"lgvi\"\n[gravity.central]\ngm = 2.0\n\
         [[bodies]]\nname = \"craft\"\nmass = 2.0\ninertia = [1.0, 2.0, 2.5]\nposition = [2, 0, 0]\nvelocity = [0, 1, 0]\n{REST}\
         [[bodies]]\nname = \"target\"\nmass = 3.0\ninertia = [1.0, 2.0, 2.5]\nposition = [1.1, 0.4, 0.3]\n\
         velocity = [-0.3, 0.9, 0.4]\nattitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]\nangular_velocity = [0.3, -1.2, 0.7]\n\
         [[bodies]]\nname = \"beacon\"\nmass = 1.0\ninertia = [1, 1, 1]\nposition = [0, 3, 0]\n\
         attitude = {{ w = 1, x = 0, y = 0, z = 0 }}\nmobility = {{ circle = {{ rate = [0, 0, 0.5], spin = [1, 0, 0] }} }}\n\
         [[bodies]]\nname = \"tower\"\nmass = 1.0\ninertia = [1, 1, 1]\nposition = [0, 0, 3]\nmobility = \"fixed\"\n\
         attitude = {{ w = 1, x = 0, y = 0, z = 0 }}\n\
         [maneuver]\nbody = \"craft\"\n{keys}\n[maneuver.target]\n{target}"
    )
}

fn parse(text: &str) -> Scene {
    Scene::parse("test", text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// The states of all bodies in a flight without control.
fn flown(scene: &Scene) -> Vec<Vec<BodyState>> {
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let mut all = vec![simulation.states().to_vec()];
    for _ in 0..scene.steps {
        simulation.advance(&[Load::default(); 4]).unwrap();
        all.push(simulation.states().to_vec());
    }
    all
}

/// The axes of a body and their angular velocity (inertial frame), by definitions of their own.
fn axes(
    scene: &Scene,
    index: usize,
    state: &BodyState,
    name: &str,
) -> (Matrix3<f64>, Vector3<f64>) {
    let body = &scene.bodies[index].body;
    let (r, v) = (state.position, state.velocity(body));
    let (out, normal) = (r.normalize(), r.cross(&v).normalize());
    let orbital = r.cross(&v) / r.norm_squared();
    match name {
        "rtn" => (
            Matrix3::from_columns(&[out, normal.cross(&out), normal]),
            orbital,
        ),
        "lvlh" => (
            Matrix3::from_columns(&[normal.cross(&out), -normal, -out]),
            orbital,
        ),
        "body" => (
            state.attitude,
            state.attitude * state.angular_velocity(body),
        ),
        _ => (Matrix3::identity(), Vector3::zeros()),
    }
}

/// The target is where the other body's own flight will take it, whether that one is free, driven or fixed.
#[test]
fn a_relative_target_is_that_of_the_flown_body_at_the_end() {
    for (index, name, kinds) in [
        (1, "target", &["inertial", "rtn", "lvlh", "body"][..]),
        (2, "beacon", &["inertial", "rtn", "body"]),
        (3, "tower", &["inertial", "body"]),
    ] {
        for kind in kinds {
            let target = TARGET.replace("body = \"target\"", &format!("body = \"{name}\""));
            let target = target.replace("axes = \"body\"", &format!("axes = \"{kind}\""));
            let scene = parse(&text("", &target));
            let end = flown(&scene)[50][index];
            let (a, rate) = axes(&scene, index, &end, kind);
            let found = scene.maneuver.as_ref().unwrap().target.state().unwrap();
            let body = &scene.bodies[0].body;
            let arm = a * Vector3::new(0.3, -0.2, 0.1);
            let own = a * Vector3::new(0.05, 0.02, -0.04);
            let velocity = end.velocity(&scene.bodies[index].body) + own + rate.cross(&arm);
            assert!(
                (found.position - end.position - arm).norm() < 1e-14,
                "{name} {kind}"
            );
            assert!(
                (found.velocity(body) - velocity).norm() < 1e-14,
                "{name} {kind}"
            );
            let turn = lgvi_lie::exp(&Vector3::new(2.0 * 0.8_f64.asin(), 0.0, 0.0));
            assert!((found.attitude - a * turn).norm() < 1e-14, "{name} {kind}");
            let spin = found.attitude * found.angular_velocity(body) - rate;
            let given = found.attitude * Vector3::new(0.4, 0.1, -0.2);
            assert!((spin - given).norm() < 1e-14, "{name} {kind}");
        }
    }
}

/// Constraints are in the axes of the flown body at the end of every step, and the rest of a maneuver in those of then.
#[test]
fn relative_constraints_are_in_the_axes_of_the_flown_body() {
    let keys = "constraints = [\n\
        { kind = \"corridor\", relative_to = { body = \"target\", axes = \"body\" }, apex = [0, 0, 0], axis = [1, 0, 0], half_angle = \"80 deg\" },\n\
        { kind = \"keep_out_sphere\", relative_to = { body = \"target\", axes = \"rtn\" }, center = [1, 0, 0], radius = 0.1 },\n\
        { kind = \"keep_out_cone\", relative_to = { body = \"beacon\", axes = \"body\" }, axis = [1, 0, 0], direction = [0, 1, 0], half_angle = 0.2 }]\n";
    let scene = parse(&text(keys, TARGET));
    let states = flown(&scene);
    let constraints = &scene.maneuver.as_ref().unwrap().constraints;
    let expected = [
        (1, "body", TypeId::of::<Corridor>()),
        (1, "rtn", TypeId::of::<KeepOutSphere>()),
        (2, "body", TypeId::of::<KeepOutCone>()),
    ];
    for (constraint, (index, kind, inner)) in constraints.iter().zip(expected) {
        let moving: &Moving = constraint.downcast_ref().expect("a moving constraint");
        let found: &dyn Any = moving.constraint();
        assert_eq!(found.type_id(), inner, "{kind}");
        for (step, states) in states.iter().enumerate() {
            let (rotation, _) = axes(&scene, index, &states[index], kind);
            let pose = moving.pose(0.02 * step as f64);
            assert_eq!(pose.origin, states[index].position, "{kind}");
            assert!((pose.rotation - rotation).norm() < 1e-14, "{kind}");
        }
    }
}

/// A speed relative to axes is that of the point seen from them, as they move and turn at that time.
#[test]
fn a_relative_speed_is_seen_from_the_axes_of_the_flown_body() {
    let limit = 0.7;
    for (index, name, kinds) in [
        (1, "target", &["inertial", "rtn", "lvlh", "body"][..]),
        (2, "beacon", &["inertial", "rtn", "body"]),
        (3, "tower", &["inertial", "body"]),
    ] {
        for kind in kinds {
            let keys = format!(
                "constraints = [{{ kind = \"speed\", limit = {limit}, relative_to = {{ body = \"{name}\", axes = \"{kind}\" }} }}]\n"
            );
            let scene = parse(&text(&keys, "position = [3, 1, 0]\n"));
            let constraint = &scene.maneuver.as_ref().unwrap().constraints[0];
            let moving: &Moving = constraint.downcast_ref().expect("a moving constraint");
            let states = flown(&scene);
            for (step, pair) in states.windows(2).enumerate() {
                let [one, later] = [&pair[0], &pair[1]];
                let own = one[0];
                let body = &scene.bodies[index].body;
                let (a, rate) = axes(&scene, index, &one[index], kind);
                let arm = own.position - one[index].position;
                let own_velocity = own.velocity(&scene.bodies[0].body);
                let seen = own_velocity - one[index].velocity(body) - rate.cross(&arm);
                let there = moving.at(0.02 * step as f64).expect("a constraint of then");
                let expected = 0.5 * (seen.norm_squared() / (limit * limit) - 1.0);
                let error = there.value(&own) - expected;
                assert!(error.abs() < 1e-13, "{name} {kind} {step}: {error:e}");
                // It is how fast the coordinates in the axes change, to the first order of a step.
                let (b, _) = axes(&scene, index, &later[index], kind);
                let moved = later[0].position - later[index].position;
                let change = (b.tr_mul(&moved) - a.tr_mul(&arm)) / 0.02;
                assert!(
                    (change.norm() - seen.norm()).abs() < 0.1,
                    "{name} {kind} {step}"
                );
            }
        }
    }
}

/// What is predicted in flight is where another flight takes the other bodies, and the constraints after that step are in
/// their axes. Without anything relative there is nothing to predict.
#[test]
fn a_maneuver_seen_in_flight_is_that_of_the_flown_bodies() {
    let keys = "constraints = [\n\
        { kind = \"corridor\", relative_to = { body = \"target\", axes = \"body\" }, apex = [0, 0, 0], axis = [1, 0, 0], half_angle = \"80 deg\" },\n\
        { kind = \"keep_out_sphere\", relative_to = { body = \"target\", axes = \"rtn\" }, center = [1, 0, 0], radius = 0.1 }]\n";
    let expected = parse(&text(keys, TARGET));
    let start = &expected.maneuver.as_ref().unwrap().target;
    for seed in 1..=6 {
        let deviations = format!(
            "[disturbance]\nseed = {seed}\n[[disturbance.bodies]]\nbody = \"target\"\nposition = 0.02\nvelocity = 0.03\n\
             attitude = 0.2\nangular_velocity = 0.3\n"
        );
        let scene = parse(&format!("{}{deviations}", text(keys, TARGET)));
        let states = flown(&scene);
        assert_ne!(states[0][1], scene.bodies[1].state);
        let step = 7 * seed as usize;
        let at = |step: usize| Seen {
            step: step as u64,
            states: states[step].clone(),
        };
        let seen = scene.maneuver_seen(&[at(step)]);
        let seen = seen.unwrap().expect("a maneuver relative to a body");
        let (found, end) = (seen.target.state().unwrap(), states[50][1]);
        let body = &scene.bodies[1].body;
        let (a, rate) = axes(&scene, 1, &end, "body");
        let arm = a * Vector3::new(0.3, -0.2, 0.1);
        let own = a * Vector3::new(0.05, 0.02, -0.04);
        let velocity = end.velocity(body) + own + rate.cross(&arm);
        assert!((found.position - end.position - arm).norm() < 1e-13);
        assert!((found.velocity(&scene.bodies[0].body) - velocity).norm() < 1e-13);
        let moved = (found.position - start.state().unwrap().position).norm();
        assert!(moved > 1e-3, "{moved}");
        for (constraint, kind) in seen.constraints.iter().zip(["body", "rtn"]) {
            let moving: &Moving = constraint.downcast_ref().expect("a moving constraint");
            for (step, states) in states.iter().enumerate().skip(step) {
                let (rotation, _) = axes(&scene, 1, &states[1], kind);
                let pose = moving.pose(0.02 * step as f64);
                assert!((pose.origin - states[1].position).norm() < 1e-13);
                assert!((pose.rotation - rotation).norm() < 1e-13, "{kind} {step}");
            }
        }
        // Wherever it has been seen, a body is there.
        let often = scene.maneuver_seen(&[at(0), at(20), at(21), at(50)]);
        let often = often.unwrap().expect("a maneuver relative to a body");
        assert!(lgvi_control::miss(&often.target.state().unwrap(), &found).norm() < 1e-13);
        let poses: &Moving = often.constraints[0].downcast_ref().unwrap();
        for (step, states) in states.iter().enumerate() {
            let pose = poses.pose(0.02 * step as f64);
            assert!((pose.origin - states[1].position).norm() < 1e-13, "{step}");
        }
        // Arrived where the body itself is: the target of the flown body, not the expected one.
        let system = scene.system();
        let miss = scene.miss_among(system.bodies(), &states[50], &found);
        let miss = miss.unwrap().norm();
        assert!(miss < 1e-13, "{miss}");
        assert!(scene.miss(&found).unwrap().norm() > 1e-3);
    }
    let alone = parse(&text("", "position = [3, 1, 0]\n"));
    assert_eq!(alone.maneuver_seen(&[]), Ok(None));
    let end = alone.initial_states();
    let system = alone.system();
    let miss = alone.miss_among(system.bodies(), &end, &end[0]);
    assert_eq!(miss, alone.miss(&end[0]));
}

#[test]
fn mistakes_in_relative_maneuvers_are_named() {
    let sphere = "constraints = [{ kind = \"keep_out_sphere\", relative_to = { body = \"target\", axes = \"body\" }, center = [1, 0, 0], radius = 0.1 }]";
    let plain = "position = [3, 1, 0]\n";
    for (keys, target, parts) in [
        (
            "",
            with(TARGET, "\"target\"", "\"taget\""),
            &[
                "maneuver.target.relative_to.body` is \"taget\"",
                "did you mean target?",
            ][..],
        ),
        (
            "",
            with(TARGET, "\"target\"", "\"craft\""),
            &[
                "maneuver.target.relative_to.body` is \"craft\"",
                "other than the planned one",
            ],
        ),
        (
            "",
            with(
                TARGET,
                "axes = \"body\"",
                "axes = \"body\", about = \"tower\"",
            ),
            &[
                "maneuver.target.relative_to.about`",
                "none beside body axes",
            ],
        ),
        (
            "",
            format!("{TARGET}spin_axis = {{ axis = [1, 0, 0], direction = [1, 0, 0] }}\n"),
            &["maneuver.target.spin_axis`", "none beside `relative_to`"],
        ),
        (
            "final_time = { min = 0.5 }",
            TARGET.into(),
            &["maneuver.final_time`", "none beside `relative_to`"],
        ),
        (
            &format!("final_time = {{ min = 0.5 }}\n{sphere}"),
            plain.into(),
            &["maneuver.final_time`", "none beside `relative_to`"],
        ),
        (
            &sphere.replace("\"target\"", "\"craft\""),
            plain.into(),
            &[
                "maneuver.constraints[0].relative_to.body`",
                "other than the planned one",
            ],
        ),
        (
            &sphere.replace("\"target\", axes = \"body\"", "\"tower\", axes = \"rtn\""),
            plain.into(),
            &[
                "maneuver.constraints[0].relative_to.body`",
                "moves around its center",
            ],
        ),
    ] {
        assert_refused(&text(keys, &target), parts);
    }
    let fast = with(
        &text("", TARGET),
        "velocity = [-0.3, 0.9, 0.4]",
        "velocity = [0, 0, 0]",
    );
    let fast = with(&fast, "gm = 2.0", "gm = 2.0\nradius = 1.0");
    assert_refused(&fast, &["relative_to.body` is \"target\"", "predicted"]);
}
