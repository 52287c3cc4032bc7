//! Scenes as users write them: their compilation, their flights, and the errors for mistakes.

#![allow(clippy::unwrap_used, clippy::panic)]

mod axes;
mod bodies;
mod chosen;
mod classes;
mod discretization;
mod disturbances;
mod dockings;
mod drag;
mod ensembles;
mod extremes;
mod formations;
mod frames;
mod gravity;
mod integrators;
mod low_orbit;
mod maneuvers;
mod orbits;
mod phases;
mod planned;
mod predicted;
mod resolution;
mod sensors;
mod shapes;
mod shipped;
mod skipping;

use lgvi_scene::{LONGEST, Scene, SceneError};

const RUN: &str = r#"
title = "Two bodies"

[run]
duration = 1.0
steps = 100
integrator = "lgvi"
"#;

const BODY: &str = r#"
mass = 2.0
inertia = [1.0, 2.0, 2.5]
position = [3.0, 0.0, 0.0]
velocity = [0.0, 0.5, 0.0]
attitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }
angular_velocity = [0.1, 0.2, 0.3]
"#;

/// Returns the text with `line` replaced by `instead`.
fn with(text: &str, line: &str, instead: &str) -> String {
    assert!(text.contains(line), "{line}");
    text.replace(line, instead)
}

/// Returns the error message of a text. Invalid values are reported by key, invalid syntax by line.
fn refused(text: &str) -> String {
    match Scene::parse("test", text) {
        Ok(scene) => panic!("{text}: {scene:?}"),
        Err(SceneError::Syntax(error)) => {
            assert!(error.contains("line "), "{error}");
            error
        }
        Err(error) => error.to_string(),
    }
}

/// Checks that the error message of a text contains all these parts.
fn assert_refused(text: &str, parts: &[&str]) {
    let said = refused(text);
    for part in parts {
        assert!(said.contains(part), "{part:?} is missing in: {said}");
    }
}

#[test]
fn a_text_beyond_all_measure_is_not_parsed() {
    assert_refused(&"\n".repeat(LONGEST + 1), &["longer than 4194304 bytes"]);
    assert_refused(&"\n".repeat(LONGEST), &["missing field"]);
}
