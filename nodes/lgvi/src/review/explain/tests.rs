use std::ops::ControlFlow;

use lgvi_common::{WarningCode, load_scene};

use super::*;

/// Explains a scene, with the choice of an automatic integrator.
fn of(scene: &Scene) -> Explanation {
    let choice = scene.undecided().map(|tolerance| {
        let choice = scene.choice(tolerance, &mut |_| ControlFlow::Continue(()));
        choice.unwrap()
    });
    Explanation::of(scene, choice.as_ref()).unwrap()
}

const TEXT: &str = r#"
    title = "A top and its planet"
    [units]
    length = "10 m"
    time = "2 s"
    [run]
    duration = 1.0
    steps = 50
    integrator = "lgvi"
    [gravity.central]
    gm = 8.0
    [[bodies]]
    name = "top"
    mass = 1.0
    inertia = [2, 2, 3]
    position = [3, 0, 0]
    velocity = [0, 1, 0]
    attitude = { w = 1, x = 0, y = 0, z = 0 }
    angular_velocity = [0, 0, 5]
"#;

#[test]
fn an_engine_is_told_in_si() {
    let engine = "angular_velocity = [0, 0, 5]\n[bodies.propellant]\nmass = 0.5\n[bodies.engine]\nthrust = 2.0\nexhaust_velocity = 30.0";
    let text = explained("angular_velocity = [0, 0, 5]", engine).to_string();
    let expected = "engine      of top: thrust 5 N, exhaust velocity 150 m/s";
    assert!(text.contains(expected), "{text}");
}

fn explained(line: &str, instead: &str) -> Explanation {
    assert!(TEXT.contains(line), "{line}");
    let scene = Scene::parse("test", &TEXT.replace(line, instead)).unwrap();
    of(&scene)
}

#[test]
fn a_scene_is_explained_in_si() {
    let explanation = explained("", "");
    let json = serde_json::to_value(&explanation).unwrap();
    assert_eq!(json["duration"], 2.0);
    assert_eq!(json["gravity"]["central"]["gm"], 2000.0);
    assert_eq!(json["bodies"][0]["kind"], "axisymmetric");
    assert_eq!(json["integrator"]["order"], 2);
    assert_eq!(json["integrator"]["step_size"], 0.04);
    assert!((explanation.integrator.largest_turn - 0.1).abs() < 1e-12);
    assert_eq!(json["integrator"]["turn_limit"], 1.0);
    assert_eq!(json["warnings"].as_array().map(Vec::len), Some(0));
    let text = explanation.to_string();
    for part in [
        "A top",
        "top: axisymmetric, free, a point",
        "GM = 2e3 m³/s²",
        "LGVI",
    ] {
        assert!(text.contains(part), "{part:?} is missing in {text}");
    }
}

#[test]
fn sensors_are_explained_in_a_line() {
    let sensor = r#"angular_velocity = [0, 0, 5]
    [[bodies.sensors]]
    name = "gyro"
    kind = "imu"
    period = 0.2
    delay = 0.1
    seed = 5
    "#;
    let explanation = explained("angular_velocity = [0, 0, 5]", sensor);
    let json = serde_json::to_value(&explanation).unwrap();
    assert_eq!(json["sensors"][0]["seed"], 5);
    assert_eq!(json["sensors"][0]["period"], 0.4);
    let text = explanation.to_string();
    let said = "\n  sensor      imu gyro of top in frame top, every 0.4 s, 0.2 s late\n";
    assert!(text.contains(said), "{text}");
}

#[test]
fn dockings_are_explained_in_si() {
    let docking = r#"[[bodies]]
    name = "ring"
    mass = 1.0
    inertia = [2, 2, 3]
    position = [-3, 0, 0]
    velocity = [0, 1, 0]
    attitude = { w = 1, x = 0, y = 0, z = 0 }
    angular_velocity = [0, 0, 5]
    [[docking]]
    ports = [
        { body = "top", position = [0, 0, 1], axis = [0, 0, 1] },
        { body = "ring", position = [0, 0, 0], axis = [0, 0, -1] },
    ]
    distance = 0.5
    rate = 3.0
    [[bodies]]"#;
    let explanation = explained("[[bodies]]", docking);
    let json = serde_json::to_value(&explanation).unwrap();
    let found = &json["docking"][0];
    assert_eq!(found["bodies"], serde_json::json!(["top", "ring"]));
    assert_eq!(found["distance"], 5.0);
    assert_eq!(found["speed"], serde_json::Value::Null);
    assert_eq!(found["rate"], 1.5);
    let text = explanation.to_string();
    let said = "docking     top and ring join when their ports are within 5 m and 5.000°, at 1.5 rad/s at most";
    assert!(text.contains(said), "{text}");
}

/// The splittings evaluate gravity once a kick that is not shared with the next step.
#[test]
fn evaluations_of_gravity_are_counted() {
    for (integrator, order, evaluations) in [
        ("\"lgvi\"", 2, 1.0),
        ("\"lie_euler\"", 1, 1.0),
        ("{ name = \"composition\", order = 4 }", 4, 5.0),
        ("{ name = \"nystrom\", order = 4 }", 4, 6.0),
        ("\"runge_kutta4\"", 4, 4.0),
    ] {
        let explained = explained("\"lgvi\"", integrator).integrator;
        assert_eq!(explained.order, Some(order), "{integrator}");
        assert!(
            (explained.evaluations - evaluations).abs() < 0.05,
            "{integrator}: {}",
            explained.evaluations
        );
    }
    let free = explained("[gravity.central]\n    gm = 8.0\n", "");
    assert_eq!(free.integrator.evaluations, 0.0);
}

#[test]
fn a_choice_is_given_with_its_reasons() {
    let explanation = explained("\"lgvi\"", "{ name = \"auto\", tolerance = 1e-8 }");
    let Integrator {
        method,
        substeps,
        choice,
        ..
    } = &explanation.integrator;
    let choice = choice.as_ref().unwrap();
    let first = &choice.candidates[0];
    assert_eq!((&first.method, first.substeps), (method, *substeps));
    assert!(first.error.is_some_and(|error| error <= 1e-8) && choice.candidates.len() > 1);
    let text = explanation.to_string();
    assert!(
        text.contains(&choice.outlook) && text.contains("candidates"),
        "{text}"
    );
    for candidate in &choice.candidates {
        assert!(text.contains(&candidate.method), "{text}");
    }
}

#[test]
fn turns_that_are_too_far_are_warned_of() {
    let warnings = |speed: &str| explained("[0, 0, 5]", speed).warnings;
    let far = warnings("[0, 0, 20]");
    assert!(
        far.len() == 1 && far[0].message.contains("0.40 rad"),
        "{far:?}"
    );
    let unsolvable = warnings("[0, 0, 100]");
    assert!(
        unsolvable[0].message.contains("2.00 rad") && unsolvable[0].message.contains("1.00 rad")
    );
    assert!(
        unsolvable[1].message.contains("step 0: top: "),
        "{unsolvable:?}"
    );
    let exact = TEXT
        .replace("[0, 0, 5]", "[0, 0, 100]")
        .replace("\"lgvi\"", "{ name = \"nystrom\", order = 4 }");
    let scene = Scene::parse("test", &exact).unwrap();
    assert!(of(&scene).warnings.is_empty());
    let substeps = TEXT
        .replace("[0, 0, 5]", "[0, 0, 20]")
        .replace("\"lgvi\"", "\"lgvi\"\n    substeps = 4");
    let scene = Scene::parse("test", &substeps).unwrap();
    let explanation = of(&scene);
    assert_eq!(explanation.integrator.step_size, 0.01);
    assert!(
        explanation.warnings.is_empty(),
        "{:?}",
        explanation.warnings
    );
}

#[test]
fn a_plan_that_is_flown_otherwise_is_warned_of() {
    let maneuver = "angular_velocity = [0, 0, 5]\n    [maneuver]\n    body = \"top\"\n    [maneuver.target]\n    position = [3, 1, 0]\n    velocity = [0, 1, 0]\n    attitude = { w = 1, x = 0, y = 0, z = 0 }\n    angular_velocity = [0, 0, 0]\n";
    let planned = |integrator: &str| {
        let text = TEXT.replace("angular_velocity = [0, 0, 5]\n", maneuver);
        let scene = Scene::parse("test", &text.replace("\"lgvi\"", integrator)).unwrap();
        of(&scene)
    };
    let otherwise = planned("\"runge_kutta4\"");
    assert_eq!(otherwise.maneuver.as_ref().unwrap().body, "top");
    let json = serde_json::to_value(&otherwise.warnings).unwrap();
    assert_eq!(json[0]["code"], "flown_otherwise");
    assert!(
        otherwise
            .to_string()
            .contains("\n  warning     the maneuver is planned in LGVI steps")
    );
    assert!(otherwise.warnings[0].message.contains("miss its target"));
    for (integrator, steps) in [("\"lgvi\"", "LGVI"), ("\"lie_euler\"", "Lie–Euler")] {
        let explanation = planned(integrator);
        assert!(explanation.warnings.is_empty());
        let text = explanation.to_string();
        let part = format!(
            "of top to a position and velocity, an attitude and angular velocity: full motion, planned in {steps} steps"
        );
        assert!(text.contains(&part), "{text}");
    }
}

/// A top is a point to gravity unless it has points.
#[test]
fn half_a_motion_is_told_to_be_planned_whole_where_gravity_couples_it() {
    let last = "angular_velocity = [0, 0, 5]";
    let points = "points = [{ mass = 0.5, position = [0.5, 0, 0] }, { mass = 0.5, position = [-0.5, 0, 0] }]";
    let maneuver =
        "[maneuver]\nbody = \"top\"\nmotion = \"translation\"\ntarget.position = [3, 1, 0]";
    for (points, told) in [("", false), (points, true)] {
        let text = explained(last, &format!("{last}\n{points}\n{maneuver}")).to_string();
        assert!(text.contains("translation, planned in"), "{text}");
        let coupled = "with the rotation where gravity's coupling makes it miss";
        assert_eq!(text.contains(coupled), told, "{text}");
    }
}

#[test]
fn what_is_left_out_is_told_with_its_reason() {
    let explanation = explained("", "");
    let json = serde_json::to_value(&explanation.skips).unwrap();
    assert_eq!(json["allowed"], "exact");
    let one = &json["interactions"][0];
    assert_eq!(one["computed"], "monopole");
    assert_eq!(one["between"][1], "the attractor");
    assert_eq!(json["bodies"][0]["moment"], false);
    let text = explanation.to_string();
    for part in [
        "what makes no difference but rounding",
        "top: translation by the forces on it; rotation in every stage of a step, no moment",
        "top–the attractor: monopole, points of mass have no moment",
    ] {
        assert!(text.contains(part), "{part:?} is missing in {text}");
    }
    let nothing = explained("\"lgvi\"", "\"lgvi\"\n    skip = \"nothing\"").to_string();
    assert!(nothing.contains("nothing, as asked"), "{nothing}");
    let exact = explained("\"lgvi\"", "{ name = \"nystrom\", order = 6 }").to_string();
    assert!(
        exact.contains("rotation once a step in closed form"),
        "{exact}"
    );
}

/// A tolerance by which nothing is left out is told with its reason, and so is what is computed for lack of one.
#[test]
fn tolerances_that_leave_nothing_out_are_told_with_the_reason() {
    let refused = explained("\"lgvi\"", "\"lgvi\"\n    skip = { tolerance = 1e-6 }");
    let json = serde_json::to_value(&refused.skips).unwrap();
    assert_eq!(json["allowed"], "exact");
    let text = refused.to_string();
    assert!(
        text.contains("by the tolerance nothing: nothing would be negligible"),
        "{text}"
    );
    let planet = "points = [ { mass = 0.5, position = [0.1, 0, 0] }, { mass = 0.5, position = [-0.1, 0, 0] } ]\n    mass = 1.0";
    let text = explained("mass = 1.0", planet).to_string();
    assert!(text.contains("full, no tolerance is given"), "{text}");
    let text = explained("\"lgvi\"", "{ name = \"auto\", tolerance = 1e-5 }").to_string();
    assert!(!text.contains("0000002e-6"), "{text}");
}

/// Far pairs are told of by the distance that they would have to come nearer than.
#[test]
fn far_pairs_are_told_of_with_their_bounds() {
    let other = TEXT[TEXT.find("[[bodies]]").unwrap()..]
        .replace("top", "other")
        .replace("[3, 0, 0]", "[-3, 0, 0]");
    let text = format!("{TEXT}{other}")
        .replace("\"lgvi\"", "\"lgvi\"\n    skip = { tolerance = 1e-6 }")
        .replace(
            "gm = 8.0",
            "gm = 8.0\n    [gravity.mutual]\n    constant = 1e-9",
        );
    let scene = Scene::parse("test", &text).unwrap();
    let explanation = of(&scene);
    let json = serde_json::to_value(&explanation.skips).unwrap();
    let pair = &json["interactions"][2];
    assert_eq!(pair["computed"], "dropped", "{json}");
    let limit = pair["dropped_beyond"].as_f64().unwrap();
    let bound = pair["bound"].as_f64().unwrap();
    assert!(
        limit > 0.0 && limit < 60.0 && bound > 0.0 && bound < 1e-6,
        "{json}"
    );
    assert!(json["allowance"]["growth"].as_f64().unwrap() > 1.0);
    let text = explanation.to_string();
    assert!(
        text.contains("top–other: dropped, the distance makes the rest negligible (allowed beyond")
    );
    assert!(text.contains("1e-6 at most"), "{text}");
}

/// None of the shipped scenes is warned of without reason, and one is where its steps are too few.
#[test]
fn shipped_scenes_are_not_warned_of_and_steps_that_are_too_few_are() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut explained = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "toml") {
            continue;
        }
        let scene = load_scene(&path).unwrap();
        let warnings = of(&scene).warnings;
        assert!(warnings.is_empty(), "{path:?}: {warnings:?}");
        explained += 1;
        if scene.name == "oblate_orbit" {
            let few = scene.text.replace("steps = 8640", "steps = 10");
            let few = of(&Scene::parse("few", &few).unwrap());
            let codes: Vec<_> = few.warnings.iter().map(|warning| warning.code).collect();
            assert_eq!(codes, [WarningCode::LongStep, WarningCode::ChangedEnergy]);
        }
    }
    assert!(explained >= 13);
}
