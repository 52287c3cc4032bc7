//! The atmosphere and drag of a scene.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use lgvi_dynamics::Method;
use lgvi_scene::{Chosen, Scene};
use nalgebra::Vector3;

use crate::{BODY, RUN, assert_refused, with};

const AIR: &str = "[gravity.central.atmosphere]\nbody = \"earth\"\n";
const DRAG: &str = "drag = { area = 2.0 }\n";

fn text(units: &str, central: &str, air: &str, body: &str) -> String {
    format!(
        "{RUN}[units]\n{units}\n[gravity.central]\n{central}\n{air}[[bodies]]\nname = \"body\"{body}"
    )
}

fn scene(text: &str) -> Scene {
    Scene::parse("test", text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// A body at 400 km on the x axis that moves along the y axis.
fn low(length: f64) -> String {
    let place = (6_371_008.4 + 400e3) / length;
    let body = with(BODY, "[3.0, 0.0, 0.0]", &format!("[{place:?}, 0.0, 0.0]"));
    let speed = format!("[0.0, {:?}, 0.0]", 7670.0 / length);
    with(&body, "[0.0, 0.5, 0.0]", &speed) + DRAG
}

/// `½ ρ C_D A v²` with the density of the table, the usual coefficient, and the velocity relative to air that turns once in a
/// sidereal day.
#[test]
fn the_earths_air_drags_in_any_units() {
    let expected = {
        let wind = TAU / 86_164.1 * 6_771_008.4;
        let relative = 7670.0 - wind;
        0.5 * 3.725e-12 * 2.2 * 2.0 * relative * relative
    };
    for (units, length, mass) in [
        ("", 1.0, 1.0),
        ("length = \"1 km\"", 1e3, 1.0),
        ("length = \"7000 km\"\nmass = \"3 t\"", 7e6, 3e3),
    ] {
        let area = format!("drag = {{ area = {:?} }}\n", 2.0 / length / length);
        let body = with(&low(length), DRAG, &area);
        let scene = scene(&text(units, "body = \"earth\"", AIR, &body));
        let body = &scene.bodies[0];
        let force = body.body.drag_force(&body.state) * (mass * length);
        let error = (force + Vector3::new(0.0, expected, 0.0)).norm() / expected;
        assert!(error < 1e-6, "{units}: {error:e}");
    }
    let retrograde = "[0.0, -7670.0, 0.0]";
    let body = with(&low(1.0), "[0.0, 7670.0, 0.0]", retrograde);
    let scene = scene(&text("", "body = \"earth\"", AIR, &body));
    let body = &scene.bodies[0];
    assert!(body.body.drag_force(&body.state).y > 1.2 * expected);
}

#[test]
fn an_atmosphere_of_ones_own_is_as_dense_as_the_scene_says() {
    let air = "[gravity.central.atmosphere]\nradius = 1.0\ndensity = [[0.5, 8.0], [2.5, 2.0]]\nscale_height = 0.7\n";
    let drag = "drag = { area = 3.0, coefficient = 0.5 }\n";
    let scene = scene(&text("", "gm = 1.0", air, &format!("{BODY}{drag}")));
    let body = &scene.bodies[0];
    // Three quarters of the way down from 8 to 2, in logarithms, at the speed 0.5.
    let density = 8.0 * 0.25_f64.powf(0.75);
    let expected = 0.5 * density * 1.5 * 0.25;
    let force = body.body.drag_force(&body.state);
    assert!(
        (force + Vector3::new(0.0, expected, 0.0)).norm() < 1e-14,
        "{force}"
    );
    let turning = format!("{air}rotation = [0.0, 0.0, {:?}]\n", 0.5 / 3.0);
    let scene = self::scene(&text("", "gm = 1.0", &turning, &format!("{BODY}{drag}")));
    let force = scene.bodies[0].body.drag_force(&scene.bodies[0].state);
    assert!(force.norm() < 1e-15, "{force}");
}

#[test]
fn what_is_no_drag_is_refused() {
    let of = |central: &str, air: &str, body: &str| text("", central, air, body);
    let body = format!("{BODY}{DRAG}");
    let earth = "body = \"earth\"";
    for (text, parts) in [
        (
            of(earth, "", &low(1.0)),
            &["`gravity.central.atmosphere` is missing", "`drag`"][..],
        ),
        (
            of("gm = 1.0", AIR, &body),
            &["`gravity.central.atmosphere.radius` is missing"],
        ),
        (
            of(earth, "[gravity.central.atmosphere]\n", &low(1.0)),
            &["`gravity.central.atmosphere.density` is missing"],
        ),
        (
            of(
                earth,
                "[gravity.central.atmosphere]\ndensity = [[0.0, 1.0]]\n",
                &low(1.0),
            ),
            &["`gravity.central.atmosphere.scale_height` is missing"],
        ),
        (
            of(earth, &format!("{AIR}scale_height = -1.0\n"), &low(1.0)),
            &["`gravity.central.atmosphere.scale_height` is -1"],
        ),
        (
            of(
                earth,
                &format!("{AIR}scale_height = 1.0\ndensity = [[1.0, 1.0], [1.0, 0.5]]\n"),
                &low(1.0),
            ),
            &["`gravity.central.atmosphere.density[1]` is 1", "altitude"],
        ),
        (
            of(
                earth,
                &format!("{AIR}scale_height = 1.0\ndensity = [[1.0, 0.0]]\n"),
                &low(1.0),
            ),
            &["`gravity.central.atmosphere.density[0]` is 0", "density"],
        ),
        (
            of(
                earth,
                &format!("{AIR}scale_height = 1.0\ndensity = []\n"),
                &low(1.0),
            ),
            &["`gravity.central.atmosphere`", "no densities"],
        ),
        (
            of(earth, AIR, &with(&low(1.0), "area = 2.0", "area = 0.0")),
            &["`bodies[0].drag.area` is 0"],
        ),
        (
            of(
                earth,
                AIR,
                &with(&low(1.0), "area = 2.0", "area = 2.0, coefficient = nan"),
            ),
            &["`bodies[0].drag.coefficient` is NaN"],
        ),
        (
            with(
                &of(earth, AIR, &low(1.0)),
                "velocity = [0.0, 7670.0, 0.0]\n",
                "mobility = \"pivoted\"\n",
            ),
            &["`bodies[0].drag`", "free body"],
        ),
        (
            with(
                &of(earth, AIR, &low(1.0)),
                "\"lgvi\"",
                "{ name = \"nystrom\", order = 6 }",
            ),
            &["`run.integrator`", "has drag", "composition"],
        ),
    ] {
        assert_refused(&text, parts);
    }
}

#[test]
fn shooting_is_refused_beside_drag() {
    let maneuver = "[maneuver]\nbody = \"body\"\ndynamics = \"lie_euler\"\n[maneuver.solver]\nmethod = \"shooting\"\n[maneuver.target]\nposition = [6771008.4, 7000.0, 0.0]\nvelocity = [0.0, 7670.0, 0.0]\nattitude = { w = 1.0, x = 0.0, y = 0.0, z = 0.0 }\nangular_velocity = [0.0, 0.0, 0.0]\n";
    let text = text("", "body = \"earth\"", AIR, &low(1.0)) + maneuver;
    assert_refused(&text, &["`bodies[0].drag`", "shooting"]);
}

/// The automatic choice writes a composition, which a scene without drag never gets.
#[test]
fn the_automatic_choice_of_a_scene_with_drag_is_read_again() {
    let text = with(
        &text("", "body = \"earth\"", AIR, &low(1.0)),
        "integrator = \"lgvi\"",
        "integrator = { name = \"auto\", tolerance = 1e-9 }",
    );
    let text = with(
        &text,
        "duration = 1.0\nsteps = 100",
        "duration = 21600.0\nsteps = 180",
    );
    let scene = scene(&text);
    let choice = scene
        .choice(1e-9, &mut |_| ControlFlow::Continue(()))
        .unwrap();
    assert!(choice.method.carries_drag(), "{}", choice.method);
    let compositions = choice.candidates.iter();
    let mut compositions =
        compositions.filter(|candidate| matches!(candidate.method, Method::Composition { .. }));
    let composed = compositions.next().unwrap();
    let chosen = Chosen {
        method: composed.method,
        ..Chosen::from(&choice)
    };
    let decided = scene.decided(&chosen.to_string()).unwrap();
    assert_eq!(decided.chosen, Some(chosen));
}
