use std::f64::consts::PI;

use lgvi_dynamics::Load;
use lgvi_dynamics::docking::{Docking, Port};
use lgvi_scene::Scene;
use nalgebra::Vector3;

use crate::shipped::shipped;
use crate::{BODY, RUN, assert_refused, with};

const DOCKING: &str = r#"
[[docking]]
ports = [
    { body = "station", position = [1.0, 0.0, 0.5], axis = [2.0, 0.0, 0.0] },
    { body = "craft", position = [0.0, 0.0, -1.0], axis = [0.0, 0.0, -1.0] },
]
distance = 0.25
angle = "3 deg"
speed = 0.5
rate = 0.125
"#;

fn text(docking: &str) -> String {
    let body = |name: &str| format!("\n[[bodies]]\nname = \"{name}\"{BODY}");
    format!("{RUN}{}{}{docking}", body("craft"), body("station"))
}

#[test]
fn a_docking_is_two_ports_and_limits() {
    let scene = Scene::parse("test", &text(DOCKING)).unwrap();
    let port = |body, position: [f64; 3], axis| Port {
        body,
        position: position.into(),
        axis,
    };
    let expected = Docking {
        ports: [
            port(1, [1.0, 0.0, 0.5], Vector3::x()),
            port(0, [0.0, 0.0, -1.0], -Vector3::z()),
        ],
        distance: 0.25,
        angle: 3.0 * (PI / 180.0),
        speed: 0.5,
        rate: 0.125,
    };
    assert_eq!(scene.docking, [expected]);
    let limits = "angle = \"3 deg\"\nspeed = 0.5\nrate = 0.125\n";
    let scene = Scene::parse("test", &text(&with(DOCKING, limits, ""))).unwrap();
    let any = Docking {
        angle: 5.0 * (PI / 180.0),
        speed: f64::INFINITY,
        rate: f64::INFINITY,
        ..expected
    };
    assert_eq!(scene.docking, [any]);
    let two = format!("{DOCKING}{DOCKING}");
    assert_eq!(Scene::parse("test", &text(&two)).unwrap().docking.len(), 2);
    assert_eq!(Scene::parse("test", &text("")).unwrap().docking, []);
}

#[test]
fn mistakes_in_dockings_are_named() {
    for (line, instead, parts) in [
        (
            "body = \"craft\"",
            "body = \"carft\"",
            &[
                "line 30",
                "`docking[0].ports[1].body` is \"carft\"",
                "craft",
            ][..],
        ),
        (
            "body = \"craft\"",
            "body = \"station\"",
            &["`docking[0].ports[1].body` is \"station\"", "other than"],
        ),
        (
            "axis = [2.0, 0.0, 0.0]",
            "axis = [0.0, 0.0, 0.0]",
            &["line 29", "`docking[0].ports[0].axis`", "not all 0"],
        ),
        (
            "position = [0.0, 0.0, -1.0]",
            "position = [0.0, inf, -1.0]",
            &["`docking[0].ports[1].position`", "inf", "finite"],
        ),
        (
            "distance = 0.25",
            "distance = 0.0",
            &["line 32", "`docking[0].distance` is 0.0", "> 0"],
        ),
        ("distance = 0.25\n", "", &["missing field `distance`"]),
        (
            "angle = \"3 deg\"",
            "angle = 25",
            &["`docking[0].angle` is 25", "\"25 deg\""],
        ),
        (
            "angle = \"3 deg\"",
            "angle = \"200 deg\"",
            &["`docking[0].angle`", "half a turn"],
        ),
        (
            "angle = \"3 deg\"",
            "angle = \"3 degrees\"",
            &["`docking[0].angle` is \"3 degrees\"", "25 deg"],
        ),
        (
            "angle = \"3 deg\"",
            "angle = 0",
            &["`docking[0].angle` is 0", "above 0"],
        ),
        (
            "speed = 0.5",
            "speed = -0.5",
            &["`docking[0].speed` is -0.5", "> 0"],
        ),
        (
            "rate = 0.125",
            "rates = 0.125",
            &["unknown field `rates`", "did you mean `rate`?"],
        ),
    ] {
        assert_refused(&text(&with(DOCKING, line, instead)), parts);
    }
    let one = "    { body = \"craft\", position = [0.0, 0.0, -1.0], axis = [0.0, 0.0, -1.0] },\n";
    assert_refused(&text(&with(DOCKING, one, "")), &["array of length 2"]);
    let still = with(
        BODY,
        "velocity = [0.0, 0.5, 0.0]\n",
        "mobility = \"fixed\"\n",
    );
    let still = with(&still, "angular_velocity = [0.1, 0.2, 0.3]\n", "");
    let station = "name = \"station\"";
    let held = with(
        &text(DOCKING),
        &format!("{station}{BODY}"),
        &format!("{station}{still}"),
    );
    assert_refused(
        &held,
        &["`docking[0].ports[0].body` is \"station\"", "a free body"],
    );
    for (run, parts) in [
        ("integrator = \"auto\"", &["`run.integrator`", "rehearses"]),
        (
            "integrator = \"lgvi\"\nskip = { tolerance = 1e-6 }",
            &["`run.skip` is 1e-6", "\"exact\" or \"nothing\""],
        ),
    ] {
        let text = with(&text(DOCKING), "integrator = \"lgvi\"", run);
        assert_refused(&text, parts);
    }
}

/// The chaser docks on its way, at a speed and an angle that the ports allow, and both turn as one from then on.
#[test]
fn the_shipped_chaser_docks() {
    let scene = shipped("docking");
    let mut flight = scene.simulation(scene.scheme().unwrap()).unwrap();
    let start = flight.invariants();
    let mut joined = None;
    while flight.step() < scene.steps {
        flight.advance(&[Load::default(); 2]).unwrap();
        let [station, chaser] = flight.states() else {
            panic!("two bodies")
        };
        let r = station.attitude.transpose();
        let pose = (
            r * (chaser.position - station.position),
            r * chaser.attitude,
        );
        if !flight.docked().is_empty() {
            let (place, attitude) = *joined.get_or_insert(pose);
            // Positions on an orbit of 7000 km are rounded to 1e-9 m.
            assert!((pose.0 - place).norm() < 5e-9);
            assert!((pose.1 - attitude).norm() < 1e-14);
        }
    }
    let [docked] = flight.docked() else {
        panic!("{:?}", flight.docked())
    };
    assert!((150..300).contains(&docked.step), "{docked:?}");
    assert!((1.0..10.0).contains(&docked.energy_loss), "{docked:?}");
    let change = (flight.invariants().energy - start.energy) / start.energy;
    assert!(change.abs() < 1e-9, "{change:e}");
    // About the pole of the oblate Earth.
    let end = flight.invariants().angular_momentum;
    let change = (end - start.angular_momentum).z / start.angular_momentum.z;
    assert!(change.abs() < 1e-13, "{change:e}");
}
