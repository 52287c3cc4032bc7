use std::f64::consts::TAU;

use lgvi_dynamics::Load;
use lgvi_scene::{CentralAttractor, Scene};
use nalgebra::Vector3;

use crate::{BODY, RUN, assert_refused, with};

fn text(gravity: &str) -> String {
    format!("{RUN}\n{gravity}\n[[bodies]]\nname = \"body\"{BODY}")
}

/// Returns the force on the body of mass 2 at (3, 0, 0).
fn force(gravity: &str) -> Vector3<f64> {
    let scene = Scene::parse("test", &text(gravity)).unwrap();
    let mut loads = [Load::default()];
    scene.system().loads(&[scene.bodies[0].state], &mut loads);
    loads[0].force
}

/// In the plane of the equator an oblate planet pulls with `GM/r² (1 + 3/2 J₂ (a/r)²)`, above the pole with
/// `GM/r² (1 − 3 J₂ (a/r)²)`.
#[test]
fn fields_are_where_and_as_strong_as_the_scene_says() {
    let point = "[gravity.central]\ngm = 9.0\n";
    assert_eq!(force(point), Vector3::new(-2.0, 0.0, 0.0));
    let placed = "[gravity.central]\ngm = 9.0\nposition = [3, 3, 0]\n";
    assert_eq!(force(placed), Vector3::new(0.0, 2.0, 0.0));
    let planet = format!("{point}j2 = 0.06\nreference_radius = 1.5\n");
    let pull = 2.0 * (1.0 + 1.5 * 0.06 * 0.25);
    assert!((force(&planet) - Vector3::new(-pull, 0.0, 0.0)).norm() < 1e-15);
    let tipped = format!("{planet}pole = [-7, 0, 0]\n");
    let pull = 2.0 * (1.0 - 3.0 * 0.06 * 0.25);
    assert!((force(&tipped) - Vector3::new(-pull, 0.0, 0.0)).norm() < 1e-15);
    let both = format!("{point}[gravity.uniform]\nacceleration = [0, 0, -9.81]\n");
    assert_eq!(force(&both), Vector3::new(-2.0, 0.0, -19.62));
}

fn central(units: &str, keys: &str) -> CentralAttractor {
    let run = format!("{RUN}[units]\n{units}\n");
    let body = with(BODY, "position = [3.0, 0.0, 0.0]", "position = [1e9, 0, 0]");
    let text = format!("{run}[gravity.central]\n{keys}\n[[bodies]]\nname = \"body\"{body}");
    let scene = Scene::parse("test", &text).unwrap_or_else(|error| panic!("{text}: {error}"));
    scene.gravity.central.unwrap()
}

/// What is known of the bodies otherwise: the day at 42164 km, Gauss's constant, the month, the pole of the Moon's mean
/// orbit, the seasons of Mars.
#[test]
fn bodies_of_the_solar_system_have_their_constants_in_any_units() {
    let earth = central("length = \"1 km\"\ntime = \"1 d\"", "body = \"earth\"");
    let day = TAU * (42_164.17_f64.powi(3) / earth.gm).sqrt();
    assert!((day - 86_164.09 / 86_400.0).abs() < 1e-5, "{day}");
    assert!((earth.radius - 6371.0).abs() < 0.1);
    let oblate = earth.oblateness.unwrap();
    // That of every model to five digits.
    assert!((oblate.j2 - 1.082_63e-3).abs() < 1e-8);
    assert!((oblate.reference_radius - 6378.137).abs() < 1e-3);
    assert_eq!(oblate.pole, Vector3::z());
    assert_eq!(earth.name, Some("Earth"));

    let sun = central("length = \"1 au\"\ntime = \"1 d\"", "body = \"sun\"");
    let gauss: f64 = 0.017_202_098_95;
    assert!((sun.gm / (gauss * gauss) - 1.0).abs() < 1e-9, "{}", sun.gm);
    let ecliptic = |pole: Vector3<f64>| {
        let tilt = 23.439_28_f64.to_radians();
        pole.angle(&Vector3::new(0.0, -tilt.sin(), tilt.cos()))
            .to_degrees()
    };
    assert!((ecliptic(sun.oblateness.unwrap().pole) - 7.25).abs() < 0.01);

    let si = "length = \"1 m\"";
    let moon = central(si, "body = \"moon\"");
    // The ratio of the masses, and Cassini's second law: 1.54° from the pole of the ecliptic.
    let earth = central(si, "body = \"earth\"");
    assert!((earth.gm / moon.gm - 81.3006).abs() < 1e-3);
    let tilt = ecliptic(moon.oblateness.unwrap().pole);
    assert!((tilt - 1.54).abs() < 0.05, "{tilt}");
    let mars = central(si, "body = \"mars\"");
    // Mars turns at 25.19° to its orbit, whose node is at 49.56° and whose inclination 1.85°.
    let (node, inclination) = (49.56_f64.to_radians(), 1.85_f64.to_radians());
    let orbit = Vector3::new(
        inclination.sin() * node.sin(),
        -inclination.sin() * node.cos(),
        inclination.cos(),
    );
    let tilt = 23.439_28_f64.to_radians();
    let orbit = Vector3::new(
        orbit.x,
        orbit.y * tilt.cos() - orbit.z * tilt.sin(),
        orbit.y * tilt.sin() + orbit.z * tilt.cos(),
    );
    let seasons = orbit.angle(&mars.oblateness.unwrap().pole).to_degrees();
    assert!((seasons - 25.19).abs() < 0.02, "{seasons}");
}

#[test]
fn keys_override_the_constants_of_a_body() {
    let known = central("", "body = \"mars\"");
    let gm = central(
        "",
        "body = \"mars\"\ngm = 4.3e13\nradius = 0\npole = [0, 0, 2]\nposition = [1, 2, 3]",
    );
    assert_eq!((gm.gm, gm.radius), (4.3e13, 0.0));
    assert_eq!(gm.position, Vector3::new(1.0, 2.0, 3.0));
    let [before, after] = [&known, &gm].map(|central| central.oblateness.unwrap());
    assert_eq!(after.pole, Vector3::z());
    assert_eq!(
        (after.j2, after.reference_radius),
        (before.j2, before.reference_radius)
    );
    let j2 = central("", "body = \"mars\"\nj2 = 1e-3\nreference_radius = 3e6");
    let oblate = j2.oblateness.unwrap();
    assert_eq!((oblate.j2, oblate.reference_radius), (1e-3, 3e6));
    assert_eq!(central("", "body = \"mars\"\nj2 = 0").oblateness, None);
}

#[test]
fn mistakes_in_gravity_are_named() {
    for (gravity, parts) in [
        (
            "[gravity.central]\nbody = \"pluto\"\n",
            &["line ", "pluto", "earth"][..],
        ),
        (
            "[gravity.central]\nradius = 1.0\n",
            &["`gravity.central.gm` is missing", "`body`"],
        ),
        (
            "[gravity.central]\ngm = -1.0\n",
            &["`gravity.central.gm` is -1.0", "> 0"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nj2 = 1e-3\n",
            &["`gravity.central.reference_radius` is missing", "`j2`"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nreference_radius = 1.0\n",
            &["`gravity.central.j2` is missing", "`reference_radius`"],
        ),
        (
            "[gravity.central]\ngm = 1.0\npole = [0, 0, 1]\n",
            &["`gravity.central.j2` is missing", "`pole`"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nj2 = 1.0\nreference_radius = 1\npole = [0, 0, 0]\n",
            &["`gravity.central.pole`", "[0.0, 0.0, 0.0]", "direction"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nj2 = nan\nreference_radius = 1\n",
            &["`gravity.central.j2` is NaN", "finite"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nradius = -2.0\n",
            &["`gravity.central.radius` is -2.0", "≥ 0"],
        ),
        (
            "[gravity.central]\ngm = 1.0\nradius = 5.0\n",
            &["`bodies[0].position` is 3.0", "at least 5", "attractor"],
        ),
        (
            "[gravity.uniform]\nacceleration = [0, inf, 0]\n",
            &["`gravity.uniform.acceleration`", "inf", "finite"],
        ),
        (
            "[gravity.uniform]\nacceleration = 9.81\n",
            &["9.81", "array of length 3"],
        ),
        (
            "[gravity.mutual]\nconstant = 0\n",
            &["`gravity.mutual.constant` is 0.0", "> 0"],
        ),
        (
            "[gravity.center]\ngm = 1.0\n",
            &[
                "unknown field `center`",
                "`central`",
                "`uniform`",
                "`mutual`",
            ],
        ),
    ] {
        assert_refused(&text(gravity), parts);
    }
}

#[test]
fn bodies_that_start_inside_each_other_are_refused() {
    let other = with(BODY, "[3.0, 0.0, 0.0]", "[3.5, 0.0, 0.0]");
    let other = with(&other, "mass = 2.0", "mass = 2.0\nradius = 0.6");
    let text = format!(
        "{}\n[[bodies]]\nname = \"other\"{other}",
        text("[gravity.mutual]\nconstant = 1.0")
    );
    let parts = ["`bodies[0].position` is 0.5", "at least 0.6", "other"];
    assert_refused(&text, &parts);
}
