use super::run::J2000;
use super::*;

const SCENE: &str = r#"
title = "A dumbbell round a planet"

[units]
length = "7000 km"
mass = "100 kg"
time = "10 min"

[run]
epoch = 2026-01-01T00:00:00Z
duration = 2.0
steps = 100
integrator = "lie_euler"

[gravity.central]
gm = 1.0

[[bodies]]
name = "spacecraft"
mass = 1.0
inertia = [0.009, 0.0315, 0.0315]
points = [{ mass = 0.5, position = [0.15, 0, 0] }, { mass = 0.5, position = [-0.15, 0, 0] }]
position = [1.0, 0.0, 0.0]
velocity = [0.0, 0.983, 0.0]
attitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
angular_velocity = [0, 0, 0.983]

[maneuver]
body = "spacecraft"
force_weight = 2.0

[maneuver.target]
position = [0, 1, 0]
velocity = [-0.983, 0, 0]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
angular_velocity = [0, 0, 0]
"#;

fn scene_with(line: &str, instead: &str) -> Result<Scene, SceneError> {
    assert!(SCENE.contains(line), "{line}");
    Scene::parse("test", &SCENE.replace(line, instead))
}

#[test]
fn a_scene_is_compiled_to_its_simulation_and_its_transfer() {
    let scene = Scene::parse("test", SCENE).unwrap();
    assert_eq!(scene.h(), 0.02);
    assert_eq!(scene.stamp(0), 1_767_225_600_000_000_000);
    assert_eq!(scene.stamp(100) - scene.stamp(0), 1_200_000_000_000);
    let simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    assert_eq!(simulation.states()[0].angular_momentum.z, 0.0315 * 0.983);
    assert_eq!(scene.transfer().unwrap().unwrap().intervals(), 100);
    let actuation = scene.maneuver.unwrap().actuation;
    assert_eq!(
        actuation.weight().diagonal().as_slice()[..6],
        [2.0, 2.0, 2.0, 1.0, 1.0, 1.0]
    );
}

#[test]
fn the_epoch_is_j2000_unless_said() {
    let scene = scene_with("epoch = 2026-01-01T00:00:00Z\n", "").unwrap();
    assert_eq!(scene.epoch, J2000);
}

/// Each invalid file is refused, and the error names the key, the value and the expected values.
#[test]
fn wrong_values_are_named() {
    let inertia = "inertia = [0.009, 0.0315, 0.0315]";
    let attitude = "attitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]";
    for (line, instead, key, value, expected) in [
        (
            "\"7000 km\"",
            "\"3 parsec\"",
            "units.length",
            "3 parsec",
            "m, km, au",
        ),
        ("\"100 kg\"", "\"100 s\"", "units.mass", "100 s", "kg, g, t"),
        (
            "duration = 2.0",
            "duration = -2.0",
            "run.duration",
            "-2.0",
            "> 0",
        ),
        (
            "duration = 2.0",
            "duration = nan",
            "run.duration",
            "NaN",
            "> 0",
        ),
        (
            "duration = 2.0",
            "duration = 1e9",
            "run.duration",
            "1000000000.0",
            "2038",
        ),
        ("steps = 100", "steps = 0", "run.steps", "0", "> 0"),
        ("steps = 100", "steps = 1", "run.steps", "1", "2 to 1000000"),
        (
            "2026-01-01T00:00:00Z",
            "2099-01-01T00:00:00Z",
            "run.epoch",
            "2099-01-01",
            "2038",
        ),
        (
            "2026-01-01T00:00:00Z",
            "1970-01-01T01:00:00+01:00",
            "run.epoch",
            "1970-01-01T01:00:00+01:00",
            "not the very start of 1970",
        ),
        (
            "2026-01-01T00:00:00Z",
            "2026-01-01",
            "run.epoch",
            "2026-01-01",
            "offset",
        ),
        ("gm = 1.0", "gm = inf", "gravity.central.gm", "inf", "> 0"),
        (
            inertia,
            "inertia = [1, 1, 3]",
            "bodies[0].inertia",
            "[1.0, 1.0, 3.0]",
            "triangle",
        ),
        (
            inertia,
            "inertia = [-1, 1, 1]",
            "bodies[0].inertia",
            "[-1.0, 1.0, 1.0]",
            "positive",
        ),
        (
            inertia,
            "inertia = [1, nan, 1]",
            "bodies[0].inertia",
            "NaN",
            "finite",
        ),
        (
            inertia,
            "inertia = [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]",
            "bodies[0].inertia",
            "0.1",
            "symmetric",
        ),
        (
            "mass = 1.0",
            "mass = 2.0",
            "bodies[0]",
            "spacecraft",
            "sum to 1",
        ),
        (
            attitude,
            "attitude = [[0, -1, 0], [1, 0.1, 0], [0, 0, 1]]",
            "bodies[0].attitude",
            "0.1",
            "rotation",
        ),
        (
            attitude,
            "attitude = [[0, 1, 0], [1, 0, 0], [0, 0, 1]]",
            "bodies[0].attitude",
            "1.0",
            "reflection",
        ),
        (
            attitude,
            "attitude = [[0, nan, 0], [1, 0, 0], [0, 0, 1]]",
            "bodies[0].attitude",
            "NaN",
            "rotation",
        ),
        (
            "w = 1.0",
            "w = 1.1",
            "maneuver.target.attitude",
            "1.1",
            "unit quaternion",
        ),
        (
            "position = [1.0, 0.0, 0.0]",
            "position = [nan, 0, 0]",
            "bodies[0].position",
            "NaN",
            "finite",
        ),
        (
            "name = \"spacecraft\"",
            "name = \"space craft\"",
            "bodies[0].name",
            "space craft",
            "letters",
        ),
        (
            "body = \"spacecraft\"",
            "body = \"moon\"",
            "maneuver.body",
            "moon",
            "one of spacecraft",
        ),
        (
            "\"100 kg\"",
            "\"1e300 kg\"",
            "units",
            "1e300",
            "derived units",
        ),
        (
            "velocity = [0.0, 0.983, 0.0]",
            "velocity = [1e200, 0, 0]",
            "bodies[0].velocity[0]",
            "1e200",
            "1e100",
        ),
        (
            "position = [1.0, 0.0, 0.0]",
            "position = [0, -0.15, 0]",
            "bodies",
            "inf",
            "finite energy",
        ),
        (
            "position = [1.0, 0.0, 0.0]",
            "position = [1e305, 0, 0]",
            "bodies[0].position[0]",
            "1e305",
            "1e100",
        ),
        (
            "duration = 2.0",
            "duration = 1e-320",
            "run.duration",
            "1e-320",
            "1e-100",
        ),
        (
            "name = \"spacecraft\"",
            "name = \"inertial\"",
            "bodies[0].name",
            "inertial",
            "inertial frame",
        ),
        (
            "force_weight = 2.0",
            "force_weight = -1.0",
            "maneuver.force_weight",
            "-1.0",
            "positive definite",
        ),
    ] {
        match scene_with(line, instead) {
            Err(error @ SceneError::Value { .. }) => {
                let text = error.to_string();
                assert!(text.contains(&format!("`{key}`")), "{instead}: {text}");
                assert!(
                    text.contains(value) && text.contains(expected),
                    "{instead}: {text}"
                );
            }
            other => panic!("{instead}: {other:?}"),
        }
    }
}

#[test]
fn wrong_forms_are_named_with_their_line() {
    for (line, instead, expected) in [
        (
            "mass = 1.0",
            "mass = 1.0\nmasss = 1.0",
            "unknown field `masss`",
        ),
        ("steps = 100", "steps = \"many\"", "string \"many\""),
        ("steps = 100", "steps = -5", "`-5`"),
        ("duration = 2.0\n", "", "missing field `duration`"),
        ("\"lie_euler\"", "\"euler\"", "unknown variant `euler`"),
        (
            "inertia = [0.009, 0.0315, 0.0315]",
            "inertia = [1, 2]",
            "three principal moments",
        ),
        ("[run]", "[run", "line "),
    ] {
        match scene_with(line, instead) {
            Err(SceneError::Syntax(text)) => {
                assert!(
                    text.contains(expected) && text.contains("line "),
                    "{instead}: {text}"
                );
            }
            other => panic!("{instead}: {other:?}"),
        }
    }
}

#[test]
fn every_shipped_scene_compiles() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");
    let mut compiled = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "toml") {
            let text = std::fs::read_to_string(&path).unwrap();
            Scene::parse("shipped", &text).unwrap_or_else(|error| panic!("{path:?}: {error}"));
            compiled += 1;
        }
    }
    assert!(compiled >= 4);
}
