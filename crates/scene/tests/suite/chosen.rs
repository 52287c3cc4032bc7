//! The choice of an automatic integrator, stored with the scene.

use std::ops::ControlFlow;

use lgvi_scene::{Chosen, Scene};

use crate::{assert_refused, with};

const SCENE: &str = include_str!("../../../../scenes/two_dumbbells.toml");

fn automatic(tolerance: f64) -> String {
    let line = SCENE.lines().find(|line| line.starts_with("integrator"));
    let line = line.unwrap();
    with(
        SCENE,
        line,
        &format!("integrator = {{ name = \"auto\", tolerance = {tolerance:e} }}"),
    )
}

#[test]
fn a_decided_scene_is_flown_as_chosen_without_choosing_anew() {
    for tolerance in [1e-3, 1e-8] {
        let scene = Scene::parse("test", &automatic(tolerance)).unwrap();
        assert_eq!(scene.undecided(), Some(tolerance));
        let go_on = &mut |_| ControlFlow::Continue(());
        let choice = scene.choice(tolerance, go_on).unwrap();
        let chosen = Chosen {
            warning: Some("with \"quotes\"\nand lines".into()),
            ..Chosen::from(&choice)
        };
        let decided = scene.decided(&chosen.to_string()).unwrap();
        assert_eq!(decided.undecided(), None);
        assert_eq!(decided.chosen, Some(chosen));
        assert_eq!(decided.scheme().unwrap(), scene.scheme().unwrap());
        let again = Scene::parse("test", &decided.text).unwrap();
        assert_eq!(again.chosen, decided.chosen);
    }
}

#[test]
fn what_cannot_have_been_chosen_is_refused() {
    let text = automatic(1e-6);
    for (chosen, parts) in [
        (
            r#"{ integrator = "auto", substeps = 1 }"#,
            &["`chosen`", "not `auto`"][..],
        ),
        (
            r#"{ integrator = "closed_form", substeps = 1 }"#,
            &["`chosen`", "can fly"],
        ),
        (
            r#"{ integrator = "lgvi", substeps = 0 }"#,
            &["`chosen.substeps` is 0"],
        ),
    ] {
        assert_refused(&format!("chosen = {chosen}\n{text}"), parts);
    }
    let chosen = r#"chosen = { integrator = "lgvi", substeps = 1 }"#;
    assert_refused(&format!("{chosen}\n{SCENE}"), &["`chosen`", "not `auto`"]);
}
