use lgvi_dynamics::{BodyState, RigidBody};
use lgvi_scene::{Ensemble, Scene};
use nalgebra::{Matrix3, Vector3};

use crate::{BODY, RUN, assert_refused, with};

const ENSEMBLE: &str = r#"
[ensemble]
samples = 100
seed = 5

[[ensemble.bodies]]
body = "second"
position = 0.1
velocity = 0.2
attitude = 0.05
angular_velocity = 0.3
mass = 0.04
inertia = 0.06
"#;

fn text(ensemble: &str) -> String {
    let second = with(BODY, "[3.0, 0.0, 0.0]", "[-3.0, 0.0, 0.0]");
    let body = |name: &str, body: &str| format!("[[bodies]]\nname = \"{name}\"\n{body}");
    format!(
        "{RUN}{}{}{ensemble}",
        body("first", BODY),
        body("second", &second)
    )
}

fn ensemble(scene: &Scene) -> &Ensemble {
    scene.ensemble.as_ref().unwrap()
}

/// Returns the second body and its state in sample k.
fn second(scene: &Scene, k: u64) -> (RigidBody, BodyState) {
    let (system, states) = ensemble(scene).sample(k).system(scene).unwrap();
    assert_eq!(states[0], scene.bodies[0].state);
    assert_eq!(system.bodies()[0], scene.bodies[0].body);
    (system.bodies()[1].clone(), states[1])
}

/// Recovers the drawn numbers from bodies and states, each component divided by its standard deviation.
fn recovered(scene: &Scene, k: u64) -> Vec<f64> {
    let (body, state) = second(scene, k);
    let (nominal, start) = (&scene.bodies[1].body, &scene.bodies[1].state);
    let d = |body: &RigidBody| {
        let j: &Matrix3<f64> = body.inertia().matrix();
        (Matrix3::from_diagonal_element(0.5 * j.trace()) - j).diagonal() / body.mass()
    };
    let turn = lgvi_lie::log(&start.attitude.tr_mul(&state.attitude));
    let mut all: Vec<f64> = Vec::new();
    let mut add = |v: Vector3<f64>, sigma: f64| all.extend((v / sigma).iter());
    add(state.position - start.position, 0.1);
    add(state.velocity(&body) - start.velocity(nominal), 0.2);
    add(turn, 0.05);
    let rates = state.angular_velocity(&body) - start.angular_velocity(nominal);
    add(rates, 0.3);
    let stretch = d(&body).component_div(&d(nominal));
    add(stretch.map(libm::log), 0.06);
    all.push(libm::log(body.mass() / nominal.mass()) / 0.04);
    all
}

/// The means, variances and covariances of 4000 samples, and the covariances with the respective next sample, are those
/// of independent standard normal numbers within 5 standard errors.
#[test]
fn samples_have_the_covariances_they_are_told() {
    let scene = Scene::parse("test", &text(ENSEMBLE)).unwrap();
    const COUNT: u64 = 4000;
    let samples: Vec<_> = (0..COUNT).map(|k| recovered(&scene, k)).collect();
    let width = samples[0].len();
    let count = COUNT as f64;
    for i in 0..width {
        let mean = samples.iter().map(|s| s[i]).sum::<f64>() / count;
        assert!(mean.abs() < 5.0 / count.sqrt(), "mean of {i}: {mean}");
        for j in 0..=i {
            let product = samples.iter().map(|s| s[i] * s[j]).sum::<f64>() / count;
            let (expected, error) = if i == j { (1.0, 2.0_f64) } else { (0.0, 1.0) };
            let miss = (product - expected).abs();
            assert!(miss < 5.0 * (error / count).sqrt(), "{i}, {j}: {product}");
        }
        let next = samples.windows(2).map(|s| s[0][i] * s[1][i]).sum::<f64>() / count;
        assert!(next.abs() < 5.0 / count.sqrt(), "{i} with the next: {next}");
    }
}

#[test]
fn a_sample_is_the_same_whatever_the_others_and_the_other_deviations_are() {
    let scene = Scene::parse("test", &text(ENSEMBLE)).unwrap();
    let more = Scene::parse("test", &text(&with(ENSEMBLE, "= 100", "= 9999"))).unwrap();
    assert_eq!(ensemble(&scene).sample(17), ensemble(&more).sample(17));
    assert_ne!(ensemble(&scene).sample(17), ensemble(&scene).sample(18));
    let other = Scene::parse("test", &text(&with(ENSEMBLE, "seed = 5", "seed = 6"))).unwrap();
    assert_ne!(ensemble(&scene).sample(17), ensemble(&other).sample(17));
    let fewer = with(ENSEMBLE, "velocity = 0.2", "velocity = 0.0");
    let fewer = Scene::parse("test", &text(&fewer)).unwrap();
    let [one, two] = [&scene, &fewer].map(|scene| ensemble(scene).sample(17).deviations[1]);
    assert_eq!(one.inertia, two.inertia);
    assert_eq!(two.velocity, Vector3::zeros());
}

/// Without deviations, the body is the nominal one to the last bit.
#[test]
fn without_deviations_a_sample_is_the_scene() {
    let table = "\n[ensemble]\nsamples = 3\nseed = 1\n";
    let scene = Scene::parse("test", &text(table)).unwrap();
    let (body, state) = second(&scene, 2);
    assert_eq!(body, scene.bodies[1].body);
    assert_eq!(state, scene.bodies[1].state);
}

#[test]
fn wrong_ensembles_are_refused_by_key_and_value() {
    for (line, instead, parts) in [
        (
            "samples = 100",
            "samples = 0",
            ["ensemble.samples", "0", "1 to"],
        ),
        ("seed = 5", "", ["ensemble", "seed", "missing"]),
        (
            "seed = 5",
            "seed = 5\nforce_error = 0.1",
            ["ensemble.force_error", "0.1", "maneuver"],
        ),
        (
            "\"second\"",
            "\"third\"",
            ["ensemble.bodies[0].body", "third", "first, second"],
        ),
        (
            "position = 0.1",
            "position = -0.1",
            ["ensemble.bodies[0].position", "-0.1", "≥ 0"],
        ),
        (
            "position = 0.1",
            "position = inf",
            ["ensemble.bodies[0].position", "inf", "finite"],
        ),
        (
            "mass = 0.04",
            "mass = 2.5",
            ["ensemble.bodies[0].mass", "2.5", "at most 2"],
        ),
        (
            "inertia = 0.06",
            "inertia = nan",
            ["ensemble.bodies[0].inertia", "NaN", "finite"],
        ),
        (
            "attitude = 0.05",
            "attitude = 4",
            ["ensemble.bodies[0].attitude", "4", "half a turn"],
        ),
        (
            "attitude = 0.05",
            "altitude = 4",
            ["altitude", "unknown field", "attitude"],
        ),
    ] {
        assert_refused(&text(&with(ENSEMBLE, line, instead)), &parts);
    }
    let twice = format!("{ENSEMBLE}{}", &ENSEMBLE[ENSEMBLE.find("[[").unwrap()..]);
    assert_refused(&text(&twice), &["ensemble.bodies[1].body", "second"]);
    let held = with(&text(ENSEMBLE), "velocity = [0.0, 0.5, 0.0]\n", "");
    let held = with(
        &held,
        "angular_velocity = [0.1, 0.2, 0.3]",
        "mobility = \"fixed\"",
    );
    assert_refused(
        &held,
        &["ensemble.bodies[0].velocity", "0.2", "not free to move"],
    );
}
