//! Scenes that cannot be flown: said at once, with file, key, value and expectation, and nothing is started.

use std::path::Path;

use lgvi_tests::{World, edited};

const INERTIA: &str = "inertia = [0.009, 0.0315, 0.0315]";
const ATTITUDE: &str = "[0.0, -1.0, 0.0],\n    [1.0, 0.0, 0.0],\n    [0.0, 0.0, 1.0],";

#[track_caller]
fn refused(world: &World, scene: &Path, fragments: &[&str]) {
    let finished = world.start_flight(scene, "flight", &[]).finish().expect(2);
    finished.says(&[scene.to_str().unwrap()]);
    finished.says(fragments);
    assert!(!world.path("flight").exists(), "a bag was begun");
}

#[test]
fn a_scene_that_cannot_be_flown_is_refused_with_key_value_and_expectation() {
    let cases: [(&str, &str, &[&str]); 9] = [
        (
            "steps = 1000",
            "step = 1000",
            &[
                "unknown field `step`",
                "expected one of",
                "did you mean `steps`?",
            ],
        ),
        (
            "\"1 kg\"",
            "\"1 pound\"",
            &[
                "line 11: `units.mass`",
                "\"1 pound\"",
                "expected a number > 0 and a unit",
                "one of kg",
            ],
        ),
        (
            INERTIA,
            "inertia = [[0.009, 1e-3, 0.0], [0.0, 0.0315, 0.0], [0.0, 0.0, 0.0315]]",
            &[
                "`bodies[0].inertia`",
                "0.001",
                "expected the inertia of a rigid body",
                "symmetric",
            ],
        ),
        (
            INERTIA,
            "inertia = [0.009, -0.0315, 0.0315]",
            &[
                "`bodies[0].inertia`",
                "-0.0315",
                "expected the inertia of a rigid body",
                "positive",
            ],
        ),
        (
            INERTIA,
            "inertia = [0.009, 0.0315, 0.0415]",
            &[
                "`bodies[0].inertia`",
                "0.0415",
                "expected the inertia of a rigid body",
                "triangle",
            ],
        ),
        (
            ATTITUDE,
            "[0.0, -1.0, 0.0],\n    [1.0, 0.0, 0.0],\n    [0.0, 0.0, 1.1],",
            &["`bodies[0].attitude`", "1.1", "expected a rotation matrix"],
        ),
        (
            "velocity = [0.0, 0.983, 0.0]",
            "velocity = [0.0, nan, 0.0]",
            &[
                "`bodies[0].velocity`",
                "NaN",
                "expected three finite numbers",
            ],
        ),
        (
            "body = \"spacecraft\"",
            "body = \"moon\"",
            &["`maneuver.body`", "\"moon\"", "expected one of spacecraft"],
        ),
        (
            "duration = 0.902976",
            "duration = \"short\"",
            &["duration", "\"short\"", "expected"],
        ),
    ];
    let world = World::new();
    for (from, to, fragments) in cases {
        refused(
            &world,
            &edited(&world, "inclination_change", &[(from, to)]),
            fragments,
        );
    }
    refused(&world, &world.path("nowhere.toml"), &["No such file"]);
    refused(&world, &world.path(""), &["directory"]);
    refused(
        &world,
        Path::new("/dev/zero"),
        &["longer than 4194304 bytes"],
    );
    assert_eq!(world.shared_memory(), Vec::<std::path::PathBuf>::new());
}
