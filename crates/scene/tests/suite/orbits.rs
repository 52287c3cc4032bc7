//! Initial states by orbital elements.

use std::f64::consts::{PI, TAU};

use lgvi_scene::Scene;
use nalgebra::Vector3;

use crate::{RUN, assert_refused};

const REST: &str = "mass = 2.0\ninertia = [1.0, 2.0, 2.5]\nattitude = { w = 1, x = 0, y = 0, z = 0 }\nangular_velocity = [0, 0, 0]\n";

fn text(gm: f64, orbit: &str) -> String {
    format!(
        "{RUN}\n[gravity.central]\ngm = {gm:e}\n[[bodies]]\nname = \"craft\"\n{REST}orbit = {{ {orbit} }}\n"
    )
}

/// Returns position and velocity on an orbit.
fn state(gm: f64, orbit: &str) -> [Vector3<f64>; 2] {
    let text = text(gm, orbit);
    let scene = Scene::parse("test", &text).unwrap_or_else(|error| panic!("{text}: {error}"));
    let craft = &scene.bodies[0];
    [craft.state.position, craft.state.velocity(&craft.body)]
}

/// The elements of a state, by the vectors of angular momentum, node and eccentricity.
struct Inverse {
    semi_major_axis: f64,
    eccentricity: f64,
    inclination: f64,
    raan: f64,
    argument_of_periapsis: f64,
    true_anomaly: f64,
    mean_anomaly: f64,
}

fn inverse(gm: f64, [r, v]: [Vector3<f64>; 2]) -> Inverse {
    let h = r.cross(&v);
    let node = Vector3::z().cross(&h);
    let e = v.cross(&h) / gm - r.normalize();
    // The angle from one vector to the other about the orbit's normal.
    let angle = |from: &Vector3<f64>, to: &Vector3<f64>| {
        let sine = from.cross(to).dot(&h.normalize());
        sine.atan2(from.dot(to)).rem_euclid(TAU)
    };
    let axis = 1.0 / (2.0 / r.norm() - v.norm_squared() / gm);
    // e cos E = 1 − r/a and e sin E = r·v/√(GM a), or their hyperbolic likes.
    let (along, across) = (1.0 - r.norm() / axis, r.dot(&v) / (gm * axis.abs()).sqrt());
    let mean = if axis > 0.0 {
        across.atan2(along) - across
    } else {
        across - (across / e.norm()).asinh()
    };
    Inverse {
        semi_major_axis: axis,
        eccentricity: e.norm(),
        inclination: (h.z / h.norm()).acos(),
        raan: node.y.atan2(node.x).rem_euclid(TAU),
        argument_of_periapsis: angle(&node, &e),
        true_anomaly: angle(&e, &r),
        mean_anomaly: mean,
    }
}

#[track_caller]
fn assert_same_angle(found: f64, given: f64) {
    let off = (found - given + PI).rem_euclid(TAU) - PI;
    assert!(off.abs() < 1e-9, "{found}, {given} was given");
}

/// Random ellipses and hyperbolas in meters about the Earth and in normalized units have the elements that they are
/// given by, in radians and degrees.
#[test]
fn states_have_the_elements_that_are_given() {
    let mut random = fastrand::Rng::with_seed(18);
    for sample in 0..400 {
        let (gm, size) = if sample % 2 == 0 {
            (3.986e14, 7e6)
        } else {
            (1.0, 1.0)
        };
        let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
        let hyperbola = sample % 4 > 1;
        let eccentricity = if hyperbola {
            between(1.05, 5.0)
        } else {
            between(0.05, 0.95)
        };
        let periapsis = size * between(1.0, 3.0);
        let [i, node, peri] = [between(0.1, 3.0), between(0.0, TAU), between(0.0, TAU)];
        let angles = format!(
            "inclination = \"{} deg\", raan = {node}, argument_of_periapsis = \"{} deg\"",
            i.to_degrees(),
            peri.to_degrees()
        );
        let axis = periapsis / (1.0 - eccentricity);
        let limit = if hyperbola {
            (-1.0 / eccentricity).acos() - 0.05
        } else {
            PI
        };
        let anomaly = between(-limit, limit);
        let mean = between(-10.0, 10.0);
        for (orbit, anomalies) in [
            (
                format!("periapsis = {periapsis}, true_anomaly = {anomaly}"),
                [Some(anomaly), None],
            ),
            (
                format!("semi_major_axis = {axis}, mean_anomaly = {mean}"),
                [None, Some(mean)],
            ),
        ] {
            let orbit = format!("{orbit}, eccentricity = {eccentricity}, {angles}");
            let found = inverse(gm, state(gm, &orbit));
            assert!((found.semi_major_axis / axis - 1.0).abs() < 1e-9, "{orbit}");
            assert!((found.eccentricity - eccentricity).abs() < 1e-9, "{orbit}");
            assert_same_angle(found.inclination, i);
            assert_same_angle(found.raan, node);
            assert_same_angle(found.argument_of_periapsis, peri);
            if let Some(anomaly) = anomalies[0] {
                assert_same_angle(found.true_anomaly, anomaly);
            }
            if let Some(mean) = anomalies[1] {
                if hyperbola {
                    assert!((found.mean_anomaly - mean).abs() < 1e-8, "{orbit}");
                } else {
                    assert_same_angle(found.mean_anomaly, mean);
                }
            }
        }
    }
}

/// Vallado, Fundamentals of Astrodynamics and Applications, example 2-6, and Curtis, Orbital Mechanics for Engineering
/// Students, example 4.7 (a hyperbola), in km.
#[test]
fn published_states_are_met() {
    let e = 0.832_85;
    let vallado = state(
        398_600.441_8,
        &format!(
            "semi_major_axis = {}, eccentricity = {e}, inclination = \"87.87 deg\", raan = \"227.89 deg\", \
             argument_of_periapsis = \"53.38 deg\", true_anomaly = \"92.335 deg\"",
            11_067.790 / (1.0 - e * e)
        ),
    );
    let expected = [
        Vector3::new(6525.344, 6861.535, 6449.125),
        Vector3::new(4.902_276, 5.533_124, -1.975_709),
    ];
    assert!((vallado[0] - expected[0]).norm() < 2.0, "{vallado:?}");
    assert!((vallado[1] - expected[1]).norm() < 2e-3, "{vallado:?}");

    let curtis = state(
        398_600.0,
        &format!(
            "periapsis = {}, eccentricity = 1.4, inclination = \"30 deg\", raan = \"40 deg\", \
             argument_of_periapsis = \"60 deg\", true_anomaly = \"30 deg\"",
            80_000.0 * 80_000.0 / 398_600.0 / 2.4
        ),
    );
    let expected = [
        Vector3::new(-4040.0, 4815.0, 3629.0),
        Vector3::new(-10.39, -4.772, 1.744),
    ];
    assert!((curtis[0] - expected[0]).norm() < 1.0, "{curtis:?}");
    assert!((curtis[1] - expected[1]).norm() < 1e-2, "{curtis:?}");
}

#[test]
fn a_parabola_has_the_speed_of_escape_and_a_circle_needs_one_number() {
    let [r, v] = state(4.0, "periapsis = 2.0, eccentricity = 1, true_anomaly = 2.0");
    assert!((v.norm_squared() - 8.0 / r.norm()).abs() < 1e-14);
    assert!((r.cross(&v).norm() - 4.0).abs() < 1e-14);
    let circle = state(4.0, "semi_major_axis = 4.0");
    assert_eq!(circle, [Vector3::x() * 4.0, Vector3::y()]);
}

/// Two free bodies orbit each other by the sum of their masses, a free body orbits a fixed one by that one's mass.
#[test]
fn a_body_orbits_another_one_by_the_masses_that_move() {
    for (mobility, mass, velocity) in [
        (
            "\"free\"",
            5.0,
            "velocity = [0, 0, 1]\nangular_velocity = [0, 0, 0]\n",
        ),
        ("\"fixed\"", 3.0, ""),
    ] {
        let text = format!(
            "{RUN}\n[gravity.mutual]\nconstant = 0.5\n[[bodies]]\nname = \"moon\"\n{REST}\
             orbit = {{ about = \"planet\", semi_major_axis = 4.0, eccentricity = 0.2, true_anomaly = 1.0 }}\n\
             [[bodies]]\nname = \"planet\"\nmass = 3.0\ninertia = [1, 1, 1]\nposition = [1, 2, 3]\nmobility = {mobility}\n\
             attitude = {{ w = 1, x = 0, y = 0, z = 0 }}\n{velocity}"
        );
        let scene = Scene::parse("test", &text).unwrap_or_else(|error| panic!("{text}: {error}"));
        let [moon, planet] = scene.bodies.as_slice() else {
            panic!("two bodies")
        };
        let r = moon.state.position - planet.state.position;
        let v = moon.state.velocity(&moon.body) - planet.state.velocity(&planet.body);
        let found = inverse(0.5 * mass, [r, v]);
        assert!((found.semi_major_axis - 4.0).abs() < 1e-12, "{mobility}");
        assert!((found.eccentricity - 0.2).abs() < 1e-12, "{mobility}");
        assert_same_angle(found.true_anomaly, 1.0);
    }
}

#[test]
fn mistakes_in_elements_are_named() {
    for (orbit, parts) in [
        (
            "",
            &[
                "`bodies[0].orbit.semi_major_axis` is missing",
                "`periapsis`",
            ][..],
        ),
        (
            "semi_major_axis = 1, periapsis = 1",
            &["semi_major_axis` is 1.0", "none beside `periapsis`"],
        ),
        (
            "semi_major_axis = -1",
            &["semi_major_axis` is -1.0", "> 0 on an ellipse"],
        ),
        (
            "semi_major_axis = 1, eccentricity = 1.5",
            &["semi_major_axis` is 1.0", "< 0 on a hyperbola"],
        ),
        (
            "semi_major_axis = 1, eccentricity = 1",
            &["semi_major_axis` is 1.0", "none on a parabola"],
        ),
        (
            "periapsis = 0",
            &["bodies[0].orbit.periapsis` is 0.0", "> 0"],
        ),
        (
            "periapsis = 1, eccentricity = -0.1",
            &["eccentricity` is -0.1", "≥ 0"],
        ),
        (
            "periapsis = 1, inclination = \"30 degrees\"",
            &["inclination` is ", "30 degrees", "25 deg"],
        ),
        (
            "periapsis = 1, eccentricity = 2, true_anomaly = 2.5",
            &["true_anomaly` is 2.5", "2.09"],
        ),
        (
            "periapsis = 1, eccentricity = 1, mean_anomaly = 1",
            &["mean_anomaly` is ", "true_anomaly"],
        ),
        (
            "periapsis = 1, mean_anomaly = 1, true_anomaly = 1",
            &[
                "mean_anomaly` is ",
                "one of `true_anomaly` and `mean_anomaly`",
            ],
        ),
        (
            "periapsis = 1, inclinaton = 1",
            &["line ", "inclinaton", "did you mean `inclination`?"],
        ),
        (
            "periapsis = 1, about = \"crft\"",
            &["orbit.about` is \"crft\"", "did you mean craft?"],
        ),
    ] {
        assert_refused(&text(1.0, orbit), parts);
    }
    let orbit = "periapsis = 1";
    let beside = |more: &str| format!("{}{more}\n", text(1.0, orbit));
    assert_refused(
        &beside("position = [1, 0, 0]"),
        &["bodies[0].position`", "give `orbit` or `position`"],
    );
    assert_refused(
        &beside("velocity = [1, 0, 0]"),
        &["bodies[0].velocity`", "give `orbit` or `position`"],
    );
    let without = text(1.0, orbit).replace("[gravity.central]\ngm = 1e0\n", "");
    assert_refused(&without, &["orbit.about` is missing", "gravity.central"]);
    let alone = text(1.0, "periapsis = 1, about = \"craft\"");
    assert_refused(&alone, &["orbit.about` is \"craft\"", "does not depend"]);
}
