//! What is in sight, and where.

use super::*;

const ZERO: [f64; 3] = [0.0; 3];

/// What the only sensor reads at the beginning.
fn first(text: &str) -> Option<Truth> {
    let readings = Run::new(text).begin();
    readings.first().map(|reading| reading.truth)
}

/// A star tracker that looks along the z axis, 1 m up, with these keys, and what else is in the scene.
fn tracked(keys: &str, rest: &str) -> Option<Truth> {
    let tracker = sensor(
        "star_tracker",
        "stars",
        &format!("frame = \"top\"\nperiod = 1.0\n{keys}"),
    );
    let craft = body("craft", &place(ZERO, ZERO, [0.0, 0.0, 0.5]), &tracker);
    let top = "[[frames]]\nname = \"top\"\nparent = \"craft\"\nposition = [0, 0, 1]\n";
    first(&run(1.0, &format!("{craft}{rest}{top}")))
}

/// A direction that is so far from the z axis.
fn direction(degrees: f64) -> String {
    let (sin, cos) = degrees.to_radians().sin_cos();
    format!("direction = [{sin:?}, 0.0, {cos:?}]")
}

#[test]
fn a_boresight_is_out_of_its_cones_or_dazzled() {
    let cone = |of: &str| format!("exclusions = [{{ {of}, half_angle = \"40 deg\" }}]");
    for (degrees, sees) in [(39.99, false), (40.01, true), (0.0, false), (180.0, true)] {
        let found = tracked(&cone(&direction(degrees)), "");
        assert_eq!(found.is_some(), sees, "{degrees}");
    }
    // One of two is enough.
    let two = "exclusions = [{ direction = [1, 0, 0], half_angle = 1.0 }, { direction = [0, 0, 1], half_angle = 0.1 }]";
    assert_eq!(tracked(two, ""), None);
    // The limb of a sphere of radius 5 in a distance of 10 is 30° from its center.
    for (degrees, sees) in [(69.9, false), (70.1, true)] {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let center = [10.0 * sin, 0.0, 1.0 + 10.0 * cos];
        let moon =
            body("moon", &place(center, ZERO, ZERO), "").replace("mass", "radius = 5.0\nmass");
        let found = tracked(&cone("body = \"moon\""), &moon);
        assert_eq!(found.is_some(), sees, "{degrees} of a body");
        let attractor =
            format!("[gravity.central]\ngm = 1e-3\nradius = 5.0\nposition = {center:?}\n");
        let keys = "exclusions = [{ half_angle = \"40 deg\" }]";
        assert_eq!(
            tracked(keys, &attractor).is_some(),
            sees,
            "{degrees} of the attractor"
        );
    }
}

#[test]
fn a_star_tracker_that_turns_too_fast_sees_nothing() {
    assert_eq!(tracked("max_rate = 0.49", ""), None);
    let attitude = Matrix3::identity();
    assert_eq!(
        tracked("max_rate = 0.51", ""),
        Some(Truth::Attitude(attitude))
    );
}

#[test]
fn an_antenna_moves_with_its_lever() {
    let antenna = sensor("gnss", "gnss", "frame = \"arm\"\nperiod = 1.0");
    let start = place([7.0, 8.0, 9.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]);
    let craft = body("craft", &start, &antenna);
    let found = first(&run(0.01, &format!("{craft}{}", arm([0.5, 0.0, 0.25]))));
    let expected = Truth::Motion {
        position: Vector3::new(7.5, 8.0, 9.25),
        velocity: Vector3::new(0.0, 2.0, 0.0),
    };
    assert_eq!(found, Some(expected));
}

/// A camera in the frame `arm` at (1, 0, 0), which looks along −y, and a target at this place; others in the rest.
fn seen(keys: &str, target: [f64; 3], rest: &str) -> Option<Truth> {
    let keys = format!("frame = \"arm\"\nperiod = 1.0\ntarget = \"target\"\n{keys}");
    let craft = body(
        "craft",
        &place(ZERO, ZERO, ZERO),
        &sensor("relative_pose", "camera", &keys),
    );
    let target = body("target", &place(target, ZERO, ZERO), "");
    first(&run(
        0.01,
        &format!("{craft}{target}{rest}{}", arm([1.0, 0.0, 0.0])),
    ))
}

#[test]
fn a_target_is_in_sight_within_its_field_of_view_and_range() {
    // x, z and −y of the body.
    let found = seen("", [2.0, -5.0, 3.0], "");
    let Some(Truth::Pose { position, attitude }) = found else {
        panic!("{found:?}")
    };
    assert!((position - Vector3::new(1.0, 3.0, 5.0)).norm() < 1e-15);
    let to_axes = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
    assert!((attitude - to_axes).norm() < 1e-15, "{attitude}");
    for (keys, target, sees) in [
        ("", [1.0, 5.0, 0.0], true),
        ("field_of_view = \"45 deg\"", [1.0, -5.0, 4.99], true),
        ("field_of_view = \"45 deg\"", [1.0, -5.0, 5.01], false),
        ("field_of_view = \"135 deg\"", [1.0, 5.0, 5.01], true),
        ("field_of_view = \"135 deg\"", [1.0, 5.0, 4.99], false),
        ("min_range = 5.0\nmax_range = 7.0", [1.0, -4.99, 0.0], false),
        ("min_range = 5.0\nmax_range = 7.0", [1.0, -5.01, 0.0], true),
        ("min_range = 5.0\nmax_range = 7.0", [1.0, -7.01, 0.0], false),
    ] {
        assert_eq!(seen(keys, target, "").is_some(), sees, "{keys} {target:?}");
    }
}

#[test]
fn a_target_behind_something_is_hidden() {
    let target = [1.0, -10.0, 0.0];
    for (center, sees) in [
        ([2.01, -5.0, 0.0], true),
        ([1.99, -5.0, 0.0], false),
        ([1.0, -5.0, -0.5], false),
        // Beside the line, but before or behind both.
        ([1.0, 1.01, 0.0], true),
        ([1.0, -11.01, 0.0], true),
    ] {
        let rock =
            body("rock", &place(center, ZERO, ZERO), "").replace("mass", "radius = 1.0\nmass");
        assert_eq!(seen("", target, &rock).is_some(), sees, "{center:?}");
        let planet = format!("[gravity.central]\ngm = 1e-3\nradius = 1.0\nposition = {center:?}\n");
        // The craft itself may not be in the planet.
        if center[1] < 0.0 {
            assert_eq!(
                seen("", target, &planet).is_some(),
                sees,
                "planet at {center:?}"
            );
        }
    }
}
