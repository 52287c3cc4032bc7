//! Initial states relative to another body.

use lgvi_dynamics::{BodyState, Load, Simulation};
use lgvi_lie::{exp, vee};
use lgvi_scene::{NamedBody, Scene};
use nalgebra::{Matrix3, Vector3};

use crate::assert_refused;

const MASSES: &str = "mass = 2.0\ninertia = [1.0, 2.0, 2.5]\n";

/// A target on an ellipse, tumbling, and what else is there.
fn text(steps: u32, duration: f64, more: &str) -> String {
    format!(
        "title = \"Relative\"\n[run]\nduration = {duration:e}\nsteps = {steps}\n\
         integrator = {{ name = \"composition\", order = 6 }}\n[gravity.central]\ngm = 2.0\nposition = [0.1, -0.2, 0.3]\n\
         [[bodies]]\nname = \"target\"\n{MASSES}position = [1.1, 0.4, 0.3]\nvelocity = [-0.3, 0.9, 0.4]\n\
         attitude = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]\nangular_velocity = [0.3, -1.2, 0.7]\n{more}"
    )
}

fn chaser(axes: &str) -> String {
    format!(
        "[[bodies]]\nname = \"chaser\"\n{MASSES}relative_to = {{ {axes} }}\nposition = [0.3, -0.2, 0.1]\n\
         velocity = [0.05, 0.02, -0.04]\nattitude = {{ w = 0.6, x = 0.8, y = 0, z = 0 }}\n\
         angular_velocity = [0.4, 0.1, -0.2]\n"
    )
}

fn parse(text: &str) -> Scene {
    Scene::parse("test", text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// The axes of the target, by definitions of their own.
fn axes(name: &str, target: &BodyState) -> Matrix3<f64> {
    let arm = target.position - Vector3::new(0.1, -0.2, 0.3);
    let out = arm.normalize();
    let normal = arm.cross(&target.linear_momentum).normalize();
    match name {
        "rtn" => Matrix3::from_columns(&[out, normal.cross(&out), normal]),
        "lvlh" => Matrix3::from_columns(&[normal.cross(&out), -normal, -out]),
        "body" => target.attitude,
        _ => Matrix3::identity(),
    }
}

/// What is seen in the axes of the target: position and attitude.
fn seen(name: &str, states: &[BodyState]) -> (Vector3<f64>, Matrix3<f64>) {
    let axes = axes(name, &states[0]);
    (
        axes.tr_mul(&(states[1].position - states[0].position)),
        axes.tr_mul(&states[1].attitude),
    )
}

fn start(scene: &Scene) -> Simulation {
    scene.simulation(scene.scheme().unwrap()).unwrap()
}

/// What is seen in the axes is where the scene says, and moves from there as the scene says: differences of a flight by
/// the axes of the moving target.
#[test]
fn a_motion_that_is_given_in_axes_is_seen_in_them() {
    const H: f64 = 1e-3;
    for name in ["inertial", "rtn", "lvlh", "body"] {
        let given = chaser(&format!("body = \"target\", axes = \"{name}\""));
        let scene = parse(&text(2, 2.0 * H, &given));
        let mut simulation = start(&scene);
        let mut poses = vec![seen(name, simulation.states())];
        for _ in 0..2 {
            simulation.advance(&[Load::default(); 2]).unwrap();
            poses.push(seen(name, simulation.states()));
        }
        let [(x0, r0), (x1, r1), (x2, r2)] = poses[..] else {
            panic!("three poses")
        };
        assert!((x0 - Vector3::new(0.3, -0.2, 0.1)).norm() < 1e-14, "{name}");
        let attitude = exp(&Vector3::new(2.0 * 0.8_f64.asin(), 0.0, 0.0));
        assert!((r0 - attitude).norm() < 1e-14, "{name}");
        let velocity = (4.0 * x1 - 3.0 * x0 - x2) / (2.0 * H);
        let off = (velocity - Vector3::new(0.05, 0.02, -0.04)).norm();
        assert!(off < 1e-5, "{name}: {off:e}");
        let rate = r0.tr_mul(&((4.0 * r1 - 3.0 * r0 - r2) / (2.0 * H)));
        let rate = vee(&(0.5 * (rate - rate.transpose())));
        let off = (rate - Vector3::new(0.4, 0.1, -0.2)).norm();
        assert!(off < 1e-5, "{name}: {off:e}");
    }
}

/// With its own name a body is turned with its own orbit: at rest in the axes it turns at the rate of the orbit.
#[test]
fn an_attitude_is_given_in_the_axes_of_the_own_orbit() {
    let text = "title = \"Own\"\n[run]\nduration = 1.0\nsteps = 100\nintegrator = \"lgvi\"\n[gravity.central]\ngm = 2.0\n\
        [[bodies]]\nname = \"craft\"\nmass = 2.0\ninertia = [1.0, 2.0, 2.5]\n\
        orbit = { semi_major_axis = 2.0, eccentricity = 0.1, inclination = 1.2, true_anomaly = 0.7 }\n\
        relative_to = { body = \"craft\", axes = \"lvlh\" }\nattitude = { w = 1, x = 0, y = 0, z = 0 }\n\
        angular_velocity = [0, 0, 0]\n";
    let scene = parse(text);
    let NamedBody { body, state, .. } = &scene.bodies[0];
    let (r, v) = (state.position, state.velocity(body));
    assert!((r.norm() - 1.98 / (1.0 + 0.1 * 0.7_f64.cos())).abs() < 1e-14);
    let axes = state.attitude;
    assert!((axes.column(2) + r.normalize()).norm() < 1e-15);
    assert!((axes.column(1) + r.cross(&v).normalize()).norm() < 1e-15);
    let rate = axes * state.angular_velocity(body);
    assert!((rate - r.cross(&v) / r.norm_squared()).norm() < 1e-15);
}

/// After Clohessy and Wiltshire, a body that leaves a point above the target on a circle with `ẏ = −2 n x` draws an
/// ellipse, twice as long as it is high, that closes after an orbit, up to terms of second order in the distance.
#[test]
fn a_small_ellipse_around_the_target_closes_after_an_orbit() {
    const RADIUS: f64 = 7e6;
    const GM: f64 = 3.986e14;
    let rate = (GM / RADIUS).sqrt() / RADIUS;
    let period = std::f64::consts::TAU / rate;
    let miss = |x: f64, drift: f64| {
        let text = format!(
            "title = \"Ellipse\"\n[run]\nduration = {period}\nsteps = 2000\nintegrator = {{ name = \"nystrom\", order = 8 }}\n\
             [gravity.central]\ngm = {GM:e}\n[[bodies]]\nname = \"target\"\nmass = 1.0\ninertia = [1, 1, 1]\n\
             orbit = {{ semi_major_axis = {RADIUS}, inclination = \"51.6 deg\", raan = \"20 deg\" }}\n\
             attitude = {{ w = 1, x = 0, y = 0, z = 0 }}\nangular_velocity = [0, 0, 0]\n\
             [[bodies]]\nname = \"chaser\"\nmass = 1.0\ninertia = [1, 1, 1]\n\
             relative_to = {{ body = \"target\", axes = \"rtn\" }}\nposition = [{x}, 0, 0]\nvelocity = [0, {}, 0]\n\
             attitude = {{ w = 1, x = 0, y = 0, z = 0 }}\nangular_velocity = [0, 0, 0]\n",
            -2.0 * rate * x + drift
        );
        let mut simulation = start(&parse(&text));
        let mut extent = Vector3::zeros();
        let mut place = Vector3::zeros();
        for _ in 0..2000 {
            simulation.advance(&[Load::default(); 2]).unwrap();
            let [target, chaser] = simulation.states() else {
                panic!("two bodies")
            };
            let out = target.position.normalize();
            let normal = target.position.cross(&target.linear_momentum).normalize();
            let frame = Matrix3::from_columns(&[out, normal.cross(&out), normal]);
            place = frame.tr_mul(&(chaser.position - target.position));
            extent = extent.sup(&place.abs());
        }
        (extent, (place - Vector3::x() * x).norm())
    };
    let (extent, near) = miss(100.0, 0.0);
    let ratio = extent.y / extent.x;
    assert!((ratio - 2.0).abs() < 1e-3, "{ratio}");
    // Second order: a few times 100² / 7e6 m.
    assert!(near < 50.0 * 1e4 / RADIUS, "{near}");
    let (_, far) = miss(1000.0, 0.0);
    assert!((70.0..130.0).contains(&(far / near)), "{far} {near}");
    // Another convention of the velocity would be off by n x.
    let (_, off) = miss(100.0, 1e-2 * rate * 100.0);
    assert!(off > 10.0 * near, "{off}");
}

/// States follow chains of references in any order, and driven and fixed bodies are placed too.
#[test]
fn references_may_be_chains() {
    let more = "[[bodies]]\nname = \"probe\"\nmass = 1.0\ninertia = [1, 1, 1]\nrelative_to = { body = \"arm\", axes = \"inertial\" }\n\
        position = [0, 0, 1]\nvelocity = [0, 1, 0]\nattitude = { w = 1, x = 0, y = 0, z = 0 }\nangular_velocity = [0, 0, 0]\n\
        [[bodies]]\nname = \"arm\"\nmass = 1.0\ninertia = [1, 1, 1]\nrelative_to = { body = \"target\", axes = \"body\" }\n\
        position = [1, 0, 0]\nattitude = { w = 1, x = 0, y = 0, z = 0 }\nmobility = { uniform = { velocity = [0, 0, 2] } }\n";
    let scene = parse(&text(10, 1.0, more));
    let position = |index: usize| scene.bodies[index].state.position;
    assert!((position(2) - position(0) - Vector3::y()).norm() < 1e-15);
    assert!((position(1) - position(2) - Vector3::z()).norm() < 1e-15);
    let velocity = scene.bodies[1].state.velocity(&scene.bodies[1].body);
    assert_eq!(velocity, Vector3::new(0.0, 1.0, 2.0));
    assert_eq!(
        scene.bodies[2].given.as_deref(),
        Some("body axes of target")
    );
    assert_eq!(scene.bodies[0].given, None);
}

#[test]
fn mistakes_in_references_are_named() {
    let mutual =
        "relative_to = { body = \"chaser\", axes = \"inertial\" }\nposition = [1.1, 0.4, 0.3]";
    let rtn = chaser("body = \"target\", axes = \"rtn\"");
    for (text, parts) in [
        (
            text(1, 1.0, &chaser("body = \"targt\", axes = \"rtn\"")),
            &[
                "bodies[1].relative_to.body` is \"targt\"",
                "did you mean target?",
            ][..],
        ),
        (
            text(1, 1.0, &chaser("body = \"target\", axes = \"rsw\"")),
            &["line ", "rsw", "rtn"],
        ),
        (
            text(
                1,
                1.0,
                &chaser("body = \"target\", axes = \"body\", about = \"target\""),
            ),
            &["relative_to.about`", "none beside body axes"],
        ),
        (
            text(1, 1.0, &chaser("body = \"chaser\", axes = \"body\"")),
            &["relative_to.axes` is \"body\"", "rtn or lvlh"],
        ),
        (
            text(1, 1.0, &rtn).replace("position = [1.1, 0.4, 0.3]", mutual),
            &["relative_to.body`", "does not depend"],
        ),
        (
            text(1, 1.0, &rtn).replace("velocity = [-0.3, 0.9, 0.4]", "velocity = [0, 0, 0]"),
            &["bodies[1].relative_to.body`", "moves around its center"],
        ),
        (
            text(1, 1.0, &rtn).replace(
                "[gravity.central]\ngm = 2.0\nposition = [0.1, -0.2, 0.3]\n",
                "",
            ),
            &["bodies[1].relative_to.about` is missing", "gravity.central"],
        ),
    ] {
        assert_refused(&text, parts);
    }
}
