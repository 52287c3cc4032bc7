use lgvi_scene::Scene;

use crate::maneuvers::{ROCK, text};
use crate::{assert_refused, with};

const DISTURBANCE: &str = r#"
[disturbance]
seed = 12
force_error = 0.01
moment_error = 0.02
position = 0.001
velocity = 0.002
attitude = 0.003
angular_velocity = 0.004
"#;

fn disturbed(disturbance: &str) -> String {
    format!("{}{disturbance}", text("", ROCK))
}

#[test]
fn only_the_maneuverd_body_starts_elsewhere_and_the_plan_from_the_nominal_state() {
    let nominal = Scene::parse("test", &disturbed("")).unwrap();
    let scene = Scene::parse("test", &disturbed(DISTURBANCE)).unwrap();
    assert_eq!(scene.bodies, nominal.bodies);
    let [craft, rock] = scene.initial_states()[..] else {
        panic!("two bodies")
    };
    assert_eq!(rock, scene.bodies[1].state);
    let difference = lgvi_control::miss(&scene.bodies[0].state, &craft);
    // Mass 2 and inertia up to 2.5: nonzero and within 5 standard deviations.
    for (which, deviation) in [0.001, 2.0 * 0.002, 0.003, 2.5 * 0.004]
        .into_iter()
        .enumerate()
    {
        for axis in 0..3 {
            let found = difference[3 * which + axis].abs();
            assert!(
                found > 1e-3 * deviation && found < 5.0 * deviation,
                "{difference}"
            );
        }
    }
    let (body, errors) = scene.actuator_errors().unwrap();
    assert_eq!(body, 0);
    assert!(
        errors
            .force
            .iter()
            .all(|factor| (factor - 1.0).abs() < 0.05)
    );
    // The flight starts from the disturbed state, the plan from the nominal one.
    let simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    assert_eq!(simulation.states()[0], craft);
    let plan = lgvi_control::shooting::integrate(
        &scene.transfer().unwrap().unwrap(),
        &nalgebra::SVector::zeros(),
    );
    assert_eq!(plan.unwrap().states[0], nominal.bodies[0].state);
}

#[test]
fn wrong_disturbances_are_refused_by_key_and_value() {
    let names = [
        "force_error",
        "moment_error",
        "position",
        "velocity",
        "attitude",
        "angular_velocity",
    ];
    for (name, line) in names.into_iter().zip(DISTURBANCE.lines().skip(3)) {
        for (wrong, shown) in [("-0.1", "-0.1"), ("nan", "NaN"), ("inf", "inf")] {
            let disturbance = with(DISTURBANCE, line, &format!("{name} = {wrong}"));
            let key = format!("`disturbance.{name}` is {shown}");
            assert_refused(&disturbed(&disturbance), &[&key, "a finite number ≥ 0"]);
        }
    }
    let changes = [
        (
            "attitude = 0.003",
            "attitude = 3.15",
            "`disturbance.attitude` is 3.15, expected a standard deviation of at most half a turn",
        ),
        ("seed = 12", "seed = 18446744073709551616", "seed"),
        ("seed = 12\n", "", "missing field `seed`"),
        ("seed = 12", "seed = -1", "`-1`"),
        ("seed = 12", "seeed = 1", "unknown field `seeed`"),
    ];
    for (line, instead, expected) in changes {
        assert_refused(&disturbed(&with(DISTURBANCE, line, instead)), &[expected]);
    }
}

#[test]
fn what_disturbs_too_much_or_nothing_at_all_is_refused() {
    let far = with(DISTURBANCE, "position = 0.001", "position = 1e90");
    let far = with(
        &disturbed(&far),
        "[run]",
        "[units]\nlength = \"1e230 m\"\nmass = \"1e-200 kg\"\n[run]",
    );
    assert_refused(&far, &["`disturbance.seed` is 12", "in SI"]);

    let near = with(DISTURBANCE, "position = 0.001", "position = 0.5");
    let near = format!("{}{near}", text("[gravity.mutual]\nconstant = 1e-3", ROCK));
    let near = with(&near, "name = \"rock\"", "name = \"rock\"\nradius = 2.9");
    let near = with(&near, "seed = 12", "seed = 15");
    let parts = [
        "`disturbance.seed` is 15",
        "craft would start at a distance of",
        "2.9",
    ];
    assert_refused(&near, &parts);

    let run = crate::RUN;
    let lone = format!(
        "{run}\n[[bodies]]\nname = \"craft\"{}{DISTURBANCE}",
        crate::BODY
    );
    assert_refused(
        &lone,
        &["`disturbance.seed` is 12", "none without a `maneuver`"],
    );
}

#[test]
fn a_seed_is_any_integer_of_64_bits() {
    for seed in [0, i64::MAX.cast_unsigned() + 1, u64::MAX] {
        let disturbance = with(DISTURBANCE, "seed = 12", &format!("seed = {seed}"));
        let scene = Scene::parse("test", &disturbed(&disturbance)).unwrap();
        assert_eq!(scene.disturbance.unwrap().seed, seed);
    }
}

/// [`disturbed`] beside a rock that is free to move.
fn beside_free_rock(disturbance: &str) -> String {
    with(
        &disturbed(disturbance),
        "mobility = \"fixed\"\nposition = [0.0, 0.0, 0.0]",
        "position = [0.0, 0.0, 0.0]\nvelocity = [0.0, 0.0, 0.0]\nangular_velocity = [0.1, 0.0, 0.2]",
    )
}

const OTHER: &str = "[[disturbance.bodies]]\nbody = \"rock\"\nposition = 0.01\nattitude = 0.02\nangular_velocity = 0.03\n";

#[test]
fn other_bodies_start_elsewhere_and_the_maneuvered_one_where_it_did() {
    let scene = |text: &str| Scene::parse("test", &beside_free_rock(text)).unwrap();
    let plain = scene(DISTURBANCE).initial_states();
    let both = scene(&format!("{DISTURBANCE}{OTHER}"));
    let states = both.initial_states();
    assert_eq!(states[0], plain[0]);
    let difference = lgvi_control::miss(&both.bodies[1].state, &states[1]);
    let (body, nominal) = (&both.bodies[1].body, &both.bodies[1].state);
    let rate = states[1].angular_velocity(body) - nominal.angular_velocity(body);
    let found = [
        (difference.fixed_rows::<3>(0).into_owned(), 0.01),
        (difference.fixed_rows::<3>(6).into_owned(), 0.02),
        (rate, 0.03),
    ];
    for (found, deviation) in found {
        let sizes = found.map(f64::abs);
        assert!(sizes.min() > 1e-3 * deviation && sizes.max() < 5.0 * deviation);
    }
    assert_eq!(states[1].linear_momentum, nominal.linear_momentum);
}

#[test]
fn wrong_deviations_of_other_bodies_are_refused_by_key_and_value() {
    for (from, to, parts) in [
        (
            "\"rock\"",
            "\"rok\"",
            ["bodies[0].body` is \"rok\"", "did you mean rock?"],
        ),
        (
            "\"rock\"",
            "\"craft\"",
            ["bodies[0].body` is \"craft\"", "other than that"],
        ),
        (
            "position = 0.01",
            "position = -1.0",
            ["bodies[0].position` is -1", "≥ 0"],
        ),
        (
            "attitude = 0.02",
            "attitude = 3.2",
            ["bodies[0].attitude` is 3.2", "half a turn"],
        ),
    ] {
        assert_refused(
            &beside_free_rock(&format!("{DISTURBANCE}{}", with(OTHER, from, to))),
            &parts,
        );
    }
    let twice = format!("{DISTURBANCE}{OTHER}{OTHER}");
    assert_refused(
        &beside_free_rock(&twice),
        &["bodies[1].body` is \"rock\"", "tables before"],
    );
    let fixed = disturbed(&format!("{DISTURBANCE}{OTHER}"));
    assert_refused(&fixed, &["bodies[0].body` is \"rock\"", "free to move"]);
}
