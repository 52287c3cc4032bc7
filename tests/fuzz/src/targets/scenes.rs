//! Scene files.

use lgvi_scene::{Integration, Scene, Skipping};

/// Work up to which a step is flown, as substeps times bodies: more takes longer, and finds no more.
const MOST: usize = 64;

/// The text is a scene: it is parsed, and what comes of that compiled to what is flown, and one step flown.
pub fn scene(data: &[u8]) {
    let Ok(text) = str::from_utf8(data) else {
        return;
    };
    if is_slow(text) {
        return;
    }
    let scene = match Scene::parse("fuzz", text) {
        Ok(scene) => scene,
        Err(error) => {
            let _ = error.to_string();
            return;
        }
    };
    for step in [0, 1, scene.steps] {
        assert!(scene.stamp(step) >= 0, "at step {step}");
        assert!(scene.seconds(step).is_finite(), "at step {step}");
    }
    for body in &scene.bodies {
        assert!(scene.body_index(&body.name).is_some());
        assert!(body.shape().extent() >= 0.0, "{}", body.name);
    }
    let states = scene.initial_states();
    assert_eq!(states.len(), scene.bodies.len());
    if let Some(Err(error)) = scene.transfer() {
        panic!("a scene whose maneuver is refused: {error}");
    }
    let _ = (scene.actuator_errors(), scene.miss(&states[0]));
    let Integration::Method(method) = scene.integration else {
        return;
    };
    if let Skipping::Within(_) = scene.skipping
        && states.len() > MOST
    {
        return;
    }
    let scheme = scene.scheme_by(method, scene.substeps);
    let _ = (scene.flown_otherwise(scheme), scheme.to_string());
    let mut simulation = match scene.simulation(scheme) {
        Ok(simulation) => simulation,
        Err(error) => panic!("a scene whose integrator is refused: {error}"),
    };
    let work = scheme.substeps as usize * states.len();
    if scene.subdivide == 0 && work <= MOST {
        match simulation.advance(&[]) {
            Ok(_) => assert!(simulation.states().iter().all(|state| state.is_finite())),
            Err(error) => drop(error.to_string()),
        }
    }
}

/// Fine meshes take their time, and more of it here, as they are asked to.
fn is_slow(text: &str) -> bool {
    let given = |key| {
        let rests = text.split(key).skip(1);
        rests.map(|rest: &str| rest.trim_start_matches(['"', '\'', ' ', '\t', '=']))
    };
    given("polyhedron").count() > 4
        || given("subdivisions").any(|value| !value.starts_with(['0', '1', '2']))
        || given("degree").any(|value| !value.starts_with(['0', '1', '2', '3', '4']))
}
