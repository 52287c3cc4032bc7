//! Skipped computations of scenes, and comparisons with full flights.

use lgvi_dynamics::Accuracy;
use lgvi_dynamics::gravity::Level;
use lgvi_dynamics::skip::{Rotation, Translation};
use lgvi_dynamics::{Load, Method, Simulation, Skip};
use lgvi_scene::{Scene, Scheme, Skipping};

use crate::shipped::{all, shipped};
use crate::{BODY, RUN, assert_refused, with};

/// Number of steps flown in a scene with expensive gravity.
const MOST: u64 = 150;
const DEAR: f64 = 500.0;

fn fly(scene: &Scene, scheme: Scheme, steps: u64) -> Simulation {
    let mut simulation = scene.simulation(scheme).unwrap();
    let controls = vec![Load::default(); scene.bodies.len()];
    for _ in 0..steps {
        simulation.advance(&controls).unwrap();
    }
    simulation
}

/// Compares whole flights (shorter ones with expensive gravity) without controls. The results are the same bits unless
/// the rotor is exact or a tolerance allows skips, equal except for rounding errors with an exact rotor, and within the
/// tolerance otherwise.
#[test]
fn every_shipped_scene_flies_as_without_skips() {
    for scene in all() {
        let scheme = scene.scheme().unwrap();
        let full = Scheme {
            skip: Skip::Nothing,
            ..scheme
        };
        let steps = if scene.system().cost() > DEAR {
            MOST
        } else {
            scene.steps
        };
        let [full, skipped] = [full, scheme].map(|scheme| fly(&scene, scheme, steps));
        let states: Vec<_> = scene.bodies.iter().map(|body| body.state).collect();
        let accuracy = Accuracy::new(full.system().bodies(), &states);
        let error = accuracy.error(skipped.states(), full.states());
        let exact = matches!(scheme.method, Method::Nystrom { .. });
        let allowed = match scene.skipping {
            Skipping::Nothing => 0.0,
            Skipping::Exact if exact => 1e-12,
            Skipping::Exact => 0.0,
            Skipping::Within(tolerance) => tolerance,
        };
        println!("{}: {error:.1e} of {allowed:.0e} after {steps}", scene.name);
        assert!(error <= allowed, "{}: {error:e}", scene.name);
        if allowed == 0.0 {
            assert_eq!(skipped.states(), full.states(), "{}", scene.name);
        }
    }
}

/// Most of the rocks do not influence each other, and their rotation is free.
#[test]
fn rocks_round_an_asteroid_are_mostly_alone() {
    let scene = shipped("rocks");
    let scheme = scene.scheme().unwrap();
    let Skip::Within(_) = scheme.skip else {
        panic!("{:?}", scheme.skip);
    };
    let plan = scene.summary(scheme);
    let dropped = plan
        .interactions
        .iter()
        .filter(|one| one.level == Level::Dropped);
    let pairs = plan.interactions.len();
    assert_eq!(pairs, 64 * 63 / 2);
    let dropped = dropped.count();
    assert!(dropped > 1200, "{dropped} of {pairs}");
    assert!(plan.bound() <= 1e-6, "{}", plan.bound());
    assert!(plan.costs[1] < 0.5 * plan.costs[0], "{:?}", plan.costs);
    let rocks = &plan.bodies[1..];
    assert!(
        rocks
            .iter()
            .all(|rock| rock.rotation == Rotation::Once && !rock.moment)
    );
    assert!(plan.bodies[0].moment && plan.bodies[0].rotation == Rotation::Staged);
}

#[test]
fn scenes_say_what_may_be_left_out() {
    let text = format!("{RUN}\n[[bodies]]\nname = \"body\"{BODY}");
    let skipping = |lines: &str| {
        let text = with(&text, "integrator = \"lgvi\"", lines);
        Scene::parse("test", &text).map(|scene| scene.skipping)
    };
    for (lines, expected) in [
        ("integrator = \"lgvi\"", Skipping::Exact),
        ("integrator = \"lgvi\"\nskip = \"exact\"", Skipping::Exact),
        (
            "integrator = \"lgvi\"\nskip = \"nothing\"",
            Skipping::Nothing,
        ),
        (
            "integrator = \"lgvi\"\nskip = { tolerance = 1e-9 }",
            Skipping::Within(1e-9),
        ),
        (
            "integrator = { name = \"auto\", tolerance = 1e-8 }\nskip = \"exact\"",
            Skipping::Exact,
        ),
    ] {
        assert_eq!(skipping(lines), Ok(expected), "{lines}");
    }
    let Ok(Skipping::Within(tolerance)) =
        skipping("integrator = { name = \"auto\", tolerance = 1e-8 }")
    else {
        panic!("a tolerance");
    };
    assert!((tolerance - 1e-9).abs() < 1e-20);
    for (lines, parts) in [
        (
            "skip = { tolerance = 0.5 }",
            ["run.skip.tolerance", "0.5", "1e-14 to 0.1"],
        ),
        (
            "skip = { tolerance = nan }",
            ["run.skip.tolerance", "NaN", "1e-14 to 0.1"],
        ),
        ("skip = \"some\"", ["some", "nothing", "tolerance"]),
        ("skip = { nothing = {} }", ["skip", "nothing", "tolerance"]),
    ] {
        let lines = format!("integrator = \"lgvi\"\n{lines}");
        assert_refused(&with(&text, "integrator = \"lgvi\"", &lines), &parts);
    }
}

/// A free body moves uniformly. A tolerance then has nothing to skip, which is known without a pilot flight.
#[test]
fn free_bodies_move_uniformly() {
    let text = format!("{RUN}\n[[bodies]]\nname = \"body\"{BODY}");
    let text = with(
        &text,
        "integrator = \"lgvi\"",
        "integrator = \"lgvi\"\nskip = { tolerance = 1e-9 }",
    );
    let scene = Scene::parse("test", &text).unwrap();
    let scheme = scene.scheme().unwrap();
    assert_eq!(scheme.skip, Skip::Exact);
    let plan = scene.summary(scheme);
    assert_eq!(plan.bodies[0].translation, Translation::Uniform);
    assert_eq!(plan.bodies[0].rotation, Rotation::Staged);
    assert!(plan.interactions.is_empty() && plan.costs == [0.0; 2]);
}

/// Two bodies meet in the middle of the only step of their run. The method and skips are those that `auto` chooses.
#[test]
fn an_automatic_choice_sees_a_meeting_within_a_step() {
    let body = |name: &str, mass: f64, motion: &str| {
        let half = 0.5 * mass;
        format!(
            "[[bodies]]\nname = \"{name}\"\nmass = {mass:?}\ninertia = [3e3, 4e3, 5e3]\n\
             points = [ {{ mass = {half:?}, position = [0.2, 0, 0] }}, {{ mass = {half:?}, position = [-0.2, 0, 0] }} ]\n\
             attitude = {{ w = 0.8, x = 0.6, y = 0, z = 0 }}\nangular_velocity = [0, 0, 0]\n{motion}\n"
        )
    };
    let text = format!(
        "title = \"Two that meet\"\n[run]\nduration = 60.0\nsteps = 1\n\
         integrator = {{ name = \"auto\", tolerance = 1e-6 }}\n[gravity.mutual]\nconstant = 0.2\n{}{}",
        body(
            "passing",
            1.0,
            "position = [-60, 1.5, 0]\nvelocity = [2, 0, 0]"
        ),
        body(
            "passed",
            2.0,
            "position = [0, 0, 0]\nvelocity = [0, 0.1, 0]"
        ),
    );
    let scene = Scene::parse("test", &text).unwrap();
    let scheme = scene.scheme().unwrap();
    assert!(matches!(scheme.skip, Skip::Within(_)), "{scheme:?}");
    let full = Scheme {
        skip: Skip::Nothing,
        ..scheme
    };
    let [full, skipped] = [full, scheme].map(|scheme| fly(&scene, scheme, 1));
    let states: Vec<_> = scene.bodies.iter().map(|body| body.state).collect();
    let accuracy = Accuracy::new(full.system().bodies(), &states);
    let error = accuracy.error(skipped.states(), full.states());
    assert!(error <= 1e-7, "{scheme}: {error:e}");
    assert!(skipped.switches() > 0);
}
