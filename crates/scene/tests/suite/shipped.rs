use std::path::PathBuf;

use lgvi_dynamics::{Invariants, Load, Simulation};
use lgvi_scene::Scene;
use lgvi_truth::Case;

fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes"))
}

pub(crate) fn shipped_text(name: &str) -> String {
    let path = folder().join(name).with_extension("toml");
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"))
}

pub(crate) fn shipped(name: &str) -> Scene {
    Scene::parse(name, &shipped_text(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Returns all shipped scenes.
pub(crate) fn all() -> Vec<Scene> {
    let entries = std::fs::read_dir(folder()).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let scenes = paths.filter(|path| path.extension().is_some_and(|ending| ending == "toml"));
    let scenes = scenes.map(|path| shipped(&path.file_stem().unwrap().to_string_lossy()));
    let scenes: Vec<_> = scenes.collect();
    assert!(scenes.len() >= 8);
    scenes
}

fn start(scene: &Scene) -> Simulation {
    scene.simulation(scene.scheme().unwrap()).unwrap()
}

fn fly(simulation: &mut Simulation, steps: u64) {
    let controls = vec![Load::default(); simulation.states().len()];
    for _ in 0..steps {
        simulation.advance(&controls).unwrap();
    }
}

/// Every scene can be flown without controls and conserves its energy unless a body is driven.
#[test]
fn every_shipped_scene_flies() {
    for scene in all() {
        let mut simulation = start(&scene);
        let Invariants { energy, .. } = simulation.invariants();
        fly(&mut simulation, 500.min(scene.steps));
        let end = simulation.invariants();
        assert!(end.orthogonality_error < 1e-14);
        let driven = |body: &lgvi_scene::NamedBody| body.body.mobility().is_given();
        if scene.maneuver.is_none() && !scene.bodies.iter().any(driven) {
            let change = (end.energy - energy) / energy;
            assert!(
                change.abs() < 1e-4,
                "{}: energy changed by {change:e}",
                scene.name
            );
        }
    }
}

/// The scenes start in the states of the reference cases and follow them as closely as their steps allow.
#[test]
fn scenes_of_the_references_follow_them() {
    for (name, case, until, bound) in [
        // h = 5 ms, second order: an error of (h × 8 rad/s)²/24 per radian, over 8 rad.
        ("pendulum", "c3_3d_pendulum_regular_small", 1.0, 1e-3),
        // In meters. At order 8, only rounding errors remain.
        ("binary_asteroid", "e_kw4_like", 86_400.0, 1e-5),
    ] {
        let scene = shipped(name);
        let case = Case::load(case).unwrap();
        let (system, states) = case.system().unwrap();
        for ((named, body), state) in scene.bodies.iter().zip(system.bodies()).zip(&states) {
            assert_eq!(named.state, *state, "{name}");
            assert_eq!(named.body.distribution(), body.distribution(), "{name}");
            assert_eq!(named.body.inertia(), body.inertia(), "{name}");
        }
        let mut simulation = start(&scene);
        fly(&mut simulation, (until / scene.h()).round() as u64);
        let errors = case.errors(until, simulation.system().bodies(), simulation.states());
        let largest = errors.unwrap().greatest();
        assert!(largest < bound, "{name}: {largest:e}");
    }
}

/// A sun-synchronous orbit turns by one revolution per year, 0.9856° per day, and gravity keeps the satellite upright.
#[test]
fn the_oblate_earth_turns_the_orbit_with_the_sun() {
    let scene = shipped("oblate_orbit");
    let mut simulation = start(&scene);
    let normal = |simulation: &Simulation| {
        let state = &simulation.states()[0];
        state.position.cross(&state.linear_momentum)
    };
    let before = normal(&simulation);
    let mut tilt = 0.0_f64;
    for _ in 0..scene.steps {
        fly(&mut simulation, 1);
        let state = &simulation.states()[0];
        let up = state.position.normalize();
        tilt = tilt.max(up.cross(&state.attitude.column(0).into_owned()).norm());
    }
    let after = normal(&simulation);
    let turned = before.xy().perp(&after.xy()) / (before.xy().norm() * after.xy().norm());
    let degrees = turned.to_degrees();
    assert!((degrees - 0.9856).abs() < 0.02, "{degrees}");
    assert!(tilt < 0.15, "{tilt}");
}

/// Around an asteroid of 535 m, the spacecraft neither falls nor escapes, on an orbit far from Keplerian.
#[test]
fn the_orbiter_stays_with_its_asteroid() {
    let scene = shipped("asteroid_orbiter");
    let mut simulation = start(&scene);
    let mut range = [f64::INFINITY, 0.0];
    for _ in 0..scene.steps {
        fly(&mut simulation, 1);
        let distance = simulation.states()[1].position.norm();
        range = [range[0].min(distance), range[1].max(distance)];
    }
    assert!(range[0] > 500.0 && range[1] < 1200.0, "{range:?}");
}

/// After an orbit the chaser is back where it began relative to the satellite, but for the drift by the oblate Earth.
#[test]
fn the_relative_ellipse_closes_and_the_satellite_looks_down() {
    let scene = shipped("relative_orbit");
    let mut simulation = start(&scene);
    let seen = |simulation: &Simulation| {
        let [satellite, chaser] = simulation.states() else {
            panic!("two bodies")
        };
        let out = satellite.position.normalize();
        let normal = satellite
            .position
            .cross(&satellite.linear_momentum)
            .normalize();
        let arm = chaser.position - satellite.position;
        let down = satellite.attitude.column(2).into_owned();
        (
            [out.dot(&arm), normal.cross(&out).dot(&arm)],
            down.angle(&-out),
        )
    };
    let ([height, along], tilt) = seen(&simulation);
    assert!((height - 100.0).abs() < 1e-6 && along.abs() < 1e-6 && tilt < 1e-7);
    let (mut least, mut most) = ([0.0_f64; 2], [0.0_f64; 2]);
    let mut largest = 0.0_f64;
    for _ in 0..scene.steps {
        fly(&mut simulation, 1);
        let (place, tilt) = seen(&simulation);
        largest = largest.max(tilt);
        for axis in 0..2 {
            least[axis] = least[axis].min(place[axis]);
            most[axis] = most[axis].max(place[axis]);
        }
    }
    let ratio = (most[1] - least[1]) / (most[0] - least[0]);
    assert!((ratio - 2.0).abs() < 0.05, "{ratio}");
    let ([height, along], _) = seen(&simulation);
    assert!(
        (height - 100.0).abs() < 3.0 && along.abs() < 10.0,
        "{height} {along}"
    );
    assert!(largest < 0.2, "{largest}");
}
