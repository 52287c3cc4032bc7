use lgvi_scene::{Frame, Scene};
use nalgebra::{Matrix3, Vector3};

use crate::{BODY, RUN, assert_refused, refused, with};

/// A body `craft` with a boom, a port at its tip, and a mark in the inertial frame.
const FRAMES: &str = r#"
[[frames]]
name = "boom"
parent = "craft"
position = [2.0, 0.0, 0.0]
attitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]

[[frames]]
name = "port"
parent = "boom"
position = [1.0, 0.5, 0.25]

[[frames]]
name = "mark"
parent = "inertial"
attitude = { w = 0.0, x = 0.0, y = 0.0, z = 1.0 }
"#;

fn text(frames: &str) -> String {
    format!("{RUN}\n[[bodies]]\nname = \"craft\"{BODY}{frames}")
}

#[test]
fn frames_hang_on_bodies_on_the_inertial_frame_and_on_each_other() {
    let scene = Scene::parse("test", &text(FRAMES)).unwrap();
    let [boom, port, mark] = &scene.frames[..] else {
        panic!("{:?}", scene.frames)
    };
    let parents = [boom, port, mark].map(|frame| frame.parent.as_str());
    assert_eq!(parents, ["craft", "boom", "inertial"]);
    // The boom's x axis is the craft's y: its tip is 1 up from (2, 0, 0), and 0.5 aside to −x.
    let tip = boom.position + boom.attitude * port.position;
    assert_eq!(tip, Vector3::new(1.5, 1.0, 0.25));
    assert_eq!(port.attitude, Matrix3::identity());
    assert_eq!(
        mark.attitude,
        Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0))
    );
    assert_eq!(mark.position, Vector3::zeros());
    let without = Scene::parse("test", &text("")).unwrap();
    assert_eq!(without.frames, []);
}

#[test]
fn the_inertial_frame_may_hang_on_one_from_elsewhere() {
    let hung = "[[frames]]\nname = \"inertial\"\nparent = \"map\"\nposition = [1, 2, 3]\n";
    let scene = Scene::parse("test", &text(&format!("{hung}{FRAMES}"))).unwrap();
    let expected = Frame {
        name: "inertial".into(),
        parent: "map".into(),
        position: Vector3::new(1.0, 2.0, 3.0),
        attitude: Matrix3::identity(),
    };
    assert_eq!(scene.frames[0], expected);
    // The order of the frames does not matter to the children of the inertial frame.
    let last = Scene::parse("test", &text(&format!("{FRAMES}{hung}"))).unwrap();
    assert_eq!(last.frames[3], expected);
    for inside in ["craft", "inertial", "port"] {
        let hung = with(hung, "map", inside);
        let parts = [
            "`frames[0].parent`",
            inside,
            "outside of the scene",
            "hangs on inertial",
        ];
        assert_refused(&text(&format!("{hung}{FRAMES}")), &parts);
    }
    let parts = ["`frames[1].name`", "inertial", "no other frame"];
    assert_refused(&text(&format!("{hung}{hung}")), &parts);
}

#[test]
fn mistakes_in_frames_are_named() {
    for (line, instead, parts) in [
        (
            "parent = \"craft\"",
            "parent = \"carft\"",
            &["`frames[0].parent` is \"carft\"", "one of inertial, craft"][..],
        ),
        (
            "parent = \"craft\"",
            "parent = \"port\"",
            &["`frames[0].parent` is \"port\"", "earlier frame"],
        ),
        (
            "parent = \"boom\"",
            "parent = \"port\"",
            &[
                "`frames[1].parent` is \"port\"",
                "one of inertial, craft, boom",
            ],
        ),
        (
            "name = \"port\"",
            "name = \"boom\"",
            &["`frames[1].name` is \"boom\"", "no other frame"],
        ),
        (
            "name = \"port\"",
            "name = \"craft\"",
            &["`frames[1].name` is \"craft\"", "no body"],
        ),
        (
            "name = \"port\"",
            "name = \"/port\"",
            &["`frames[1].name` is \"/port\"", "letters"],
        ),
        (
            "[1.0, 0.5, 0.25]",
            "[1.0, nan, 0.25]",
            &["`frames[1].position`", "NaN", "finite"],
        ),
        (
            "attitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]",
            "attitude = [[0, 1, 0], [1, 0, 0], [0, 0, 1]]",
            &["`frames[0].attitude`", "reflection"],
        ),
        ("parent = \"boom\"\n", "", &["missing field `parent`"]),
        (
            "parent = \"boom\"",
            "parent = \"boom\"\nmass = 1.0",
            &["unknown field `mass`"],
        ),
    ] {
        assert_refused(&text(&with(FRAMES, line, instead)), parts);
    }
    let far = with(&text(FRAMES), "[1.0, 0.5, 0.25]", "[1e306, 0, 0]");
    let far = with(&far, "[run]", "[units]\nlength = \"1 km\"\n[run]");
    assert_refused(&far, &["`frames[1].position[0]`", "1e306", "1e100"]);
    let outside = text(&with(FRAMES, "\"inertial\"", "\"map\""));
    assert!(refused(&outside).contains("`frames[2].parent` is \"map\""));
}
