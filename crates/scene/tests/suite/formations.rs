//! Several bodies that are planned together.

use lgvi_control::{NewtonSettings, solve_together};
use lgvi_scene::Scene;

use crate::{assert_refused, with};

/// Two bodies without gravity that exchange places, past a marker.
const TEXT: &str = r#"
    title = "Together"
    [run]
    duration = 10.0
    steps = 20
    integrator = "lgvi"
    [[bodies]]
    name = "marker"
    mobility = "fixed"
    mass = 1.0
    inertia = [1, 1, 1]
    position = [0, 9, 0]
    attitude = { w = 1, x = 0, y = 0, z = 0 }
    [[bodies]]
    name = "left"
    mass = 2.0
    inertia = [1, 1, 1]
    position = [-5, 0, 0]
    velocity = [0, 0, 0]
    attitude = { w = 1, x = 0, y = 0, z = 0 }
    angular_velocity = [0, 0, 0]
    [[bodies]]
    name = "right"
    mass = 3.0
    inertia = [1, 1, 1]
    position = [5, 0, 0]
    velocity = [0, 0, 0]
    attitude = { w = 1, x = 0, y = 0, z = 0 }
    angular_velocity = [0, 0, 0]
    [maneuver]
    body = "left"
    motion = "translation"
    separation = 2.0
    [maneuver.target]
    position = [5, 0, 0]
    velocity = [0, 0, 0]
    [[maneuver.companions]]
    body = "right"
    motion = "translation"
    [maneuver.companions.target]
    position = [-5, 0, 0]
    velocity = [0, 0, 0]
"#;

#[track_caller]
fn refused(from: &str, to: &str, parts: &[&str]) {
    assert_refused(&with(TEXT, from, to), parts);
}

/// The bodies are planned in the order of the file, and arrive in the flight.
#[test]
fn companions_are_planned_and_arrive() {
    let scene = Scene::parse("test", TEXT).unwrap();
    let maneuver = scene.maneuver.as_ref().unwrap();
    let bodies: Vec<_> = maneuver.planned().map(|planned| planned.body).collect();
    assert_eq!((bodies, maneuver.separation), (vec![1, 2], Some(2.0)));
    assert_eq!(scene.planned_name(1), "right");
    let transfers = scene.transfers().unwrap().unwrap();
    let found = solve_together(&transfers, 2.0, &[], &NewtonSettings::default(), |_| true).unwrap();
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let mut nearest = f64::INFINITY;
    for step in 0..20 {
        let mut loads = vec![Default::default(); 3];
        for (planned, plan) in maneuver.planned().zip(&found.plans) {
            loads[planned.body] = plan.controls[step];
        }
        simulation.advance(&loads).unwrap();
        let [one, other] = [1, 2].map(|body| simulation.states()[body].position);
        nearest = nearest.min((one - other).norm());
    }
    assert!(nearest > 2.0 * (1.0 - 1e-7), "{nearest}");
    let misses = scene.misses(simulation.system().bodies(), simulation.states());
    assert_eq!(misses.len(), 2);
    assert!(
        misses
            .iter()
            .all(|miss| miss.is_some_and(|miss| miss.norm() < 1e-11)),
        "{misses:?}"
    );
}

const SEPARATION: &str = "separation = 2.0";
const COMPANION: &str = "body = \"right\"";

#[test]
fn a_separation_needs_companions_that_it_can_keep_apart() {
    let key = "`maneuver.separation`";
    refused(SEPARATION, "", &[key, "is missing", "the least distance"]);
    refused(SEPARATION, "separation = 0.0", &[key, "is 0.0"]);
    let at_start = [
        key,
        "is 10.5",
        "at most 10, the distance of left and right at the start",
    ];
    refused(SEPARATION, "separation = 10.5", &at_start);
    let crossing = "[maneuver.companions.target]\n    position = [-5, 0, 0]";
    let beside = "[maneuver.companions.target]\n    position = [5, 1, 0]";
    let at_end = [
        key,
        "is 2.0",
        "at most 1, the distance of left and right at the end",
    ];
    refused(crossing, beside, &at_end);
    let companions = TEXT.find("    [[maneuver.companions]]").unwrap();
    let expected = [key, "is 2.0", "none without `maneuver.companions`"];
    assert_refused(&TEXT[..companions], &expected);
}

#[test]
fn mistakes_of_companions_have_their_keys() {
    let key = "`maneuver.companions[0].body`";
    refused(
        COMPANION,
        "body = \"left\"",
        &[key, "\"left\"", "not planned yet"],
    );
    refused(COMPANION, "body = \"rihgt\"", &[key, "\"rihgt\"", "right"]);
    refused(
        COMPANION,
        "body = \"marker\"",
        &[key, "\"marker\"", "free to move"],
    );
    let weight = format!("{COMPANION}\n    force_weight = -1.0");
    let key = "`maneuver.companions[0].force_weight`";
    refused(COMPANION, &weight, &[key, "symmetric positive definite"]);
    for unknown in [
        "final_time = { min = 1.0 }",
        "feedback = true",
        "separation = 1.0",
    ] {
        let name = unknown.split(' ').next().unwrap();
        let keys = format!("{COMPANION}\n    {unknown}");
        refused(COMPANION, &keys, &["unknown field", name]);
    }
    let rotation = "body = \"right\"\n    motion = \"rotation\"\n    [maneuver.companions.target]\n    attitude = { w = 1, x = 0, y = 0, z = 0 }\n";
    let start = TEXT.find("    body = \"right\"").unwrap();
    let text = format!("{}{rotation}", &TEXT[..start]);
    assert_refused(&text, &["`maneuver.companions[0].motion`", "rotation"]);
}

#[test]
fn options_of_one_body_are_refused_beside_companions() {
    for (option, key) in [
        ("final_time = { min = 5.0 }", "final_time"),
        ("search = { starts = 3 }", "search"),
        ("confidence = 0.9", "confidence"),
    ] {
        let keys = format!("{SEPARATION}\n    {option}");
        let key = format!("`maneuver.{key}`");
        refused(
            SEPARATION,
            &keys,
            &[&key, "is \"given\"", "beside `maneuver.companions`"],
        );
    }
    let fuel = format!(
        "{SEPARATION}\n    cost = \"fuel\"\n    [[maneuver.constraints]]\n    kind = \"force_norm\"\n    limit = 9.0"
    );
    refused(
        SEPARATION,
        &fuel,
        &["`maneuver.cost`", "\"energy\" of bodies"],
    );
    let seen = "position = [5, 0, 0]\n    velocity = [0, 0, 0]\n    [[maneuver.companions]]";
    let relative = format!("relative_to = {{ body = \"right\", axes = \"body\" }}\n    {seen}");
    let key = "`maneuver.target.relative_to.body`";
    refused(seen, &relative, &[key, "\"right\"", "not known beforehand"]);
    let dispersed = format!("{TEXT}\n[ensemble]\nsamples = 8\nseed = 1\n");
    assert_refused(&dispersed, &["`ensemble.samples`", "is 8", "of one body"]);
}
