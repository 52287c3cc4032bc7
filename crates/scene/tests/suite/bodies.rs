use lgvi_dynamics::gravity::{Moments, Multipole};
use lgvi_dynamics::{Drive, MassDistribution, Mobility, RigidBody};
use lgvi_scene::{NamedBody, Scene};
use nalgebra::Vector3;

use crate::{BODY, RUN, assert_refused, with};

fn text(body: &str) -> String {
    format!("{RUN}\n[[bodies]]\nname = \"body\"{body}")
}

fn body(body: &str) -> NamedBody {
    let mut scene = Scene::parse("test", &text(body)).unwrap();
    scene.bodies.remove(0)
}

/// The body without what says how it moves.
fn still(mobility: &str) -> String {
    let text = with(BODY, "velocity = [0.0, 0.5, 0.0]\n", mobility);
    with(&text, "angular_velocity = [0.1, 0.2, 0.3]\n", "")
}

fn multipole(body: &RigidBody) -> &Multipole {
    match body.distribution() {
        MassDistribution::Multipole(multipole) => multipole,
        other => panic!("{other:?}"),
    }
}

#[test]
fn multipoles_come_from_inertia_ellipsoid_or_points() {
    let second = body(&with(
        BODY,
        "mass = 2.0\n",
        "mass = 2.0\nmultipole = { order = 2 }\n",
    ))
    .body;
    let expected = Multipole::of_inertia(2.0, second.inertia());
    assert_eq!(*multipole(&second), expected);

    let ellipsoid = "mass = 2.0\nmultipole = { order = 4, ellipsoid = [1.0, 0.8, 0.5] }\n";
    let shape = body(&with(BODY, "mass = 2.0\n", ellipsoid)).body;
    let expected = Multipole::of_moments(2.0, &Moments::of_ellipsoid(2.0, [1.0, 0.8, 0.5]));
    assert_eq!(*multipole(&shape), expected);
    assert_eq!(shape.inertia().matrix()[(0, 0)], 1.0);

    // J of a homogeneous ellipsoid is m/5 (b² + c², …)
    let own = with(BODY, "inertia = [1.0, 2.0, 2.5]\n", "");
    let own = body(&with(&own, "mass = 2.0\n", ellipsoid)).body;
    let expected = Vector3::new(0.89, 1.25, 1.64) * 0.4;
    assert!((own.inertia().matrix().diagonal() - expected).norm() < 1e-15);

    let points = "mass = 2.0\nmultipole = { order = 4 }\npoints = [{ mass = 1.0, position = [0.5, 0, 0] }, { mass = 1.0, position = [-0.5, 0, 0] }]\n";
    let dumbbell = body(&with(BODY, "mass = 2.0\n", points)).body;
    assert_eq!(multipole(&dumbbell).order(), 4);
}

#[test]
fn mobility_says_how_a_body_moves() {
    assert_eq!(*body(BODY).body.mobility(), Mobility::Free);
    let fixed = body(&still("mobility = \"fixed\"\n"));
    assert_eq!(*fixed.body.mobility(), Mobility::Fixed);
    assert_eq!(fixed.state.linear_momentum, Vector3::zeros());

    let pivoted = "mobility = \"pivoted\"\npoints = [{ mass = 2.0, position = [0, 0, 0.3] }]\n";
    let pivoted = body(&with(BODY, "velocity = [0.0, 0.5, 0.0]\n", pivoted));
    assert_eq!(*pivoted.body.mobility(), Mobility::Pivoted);
    assert_eq!(pivoted.body.points()[0].position.z, 0.3);

    let uniform = body(&still(
        "mobility = { uniform = { velocity = [1, 0, 0], spin = [0, 0, 2] } }\n",
    ));
    let drive = Drive::uniform(Vector3::x(), 2.0 * Vector3::z());
    assert_eq!(*uniform.body.mobility(), Mobility::Driven(drive));
    assert_eq!(uniform.state.linear_momentum, 2.0 * Vector3::x());
    assert_eq!(uniform.state.angular_momentum, 5.0 * Vector3::z());

    let circle = body(&still("mobility = { circle = { rate = [0, 0, 0.5] } }\n"));
    assert_eq!(circle.state.velocity(&circle.body), 1.5 * Vector3::y());
}

#[test]
fn mistakes_in_bodies_are_named() {
    let mass = |more: &str| with(BODY, "mass = 2.0\n", &format!("mass = 2.0\n{more}\n"));
    for (body, parts) in [
        (
            with(BODY, "velocity = [0.0, 0.5, 0.0]\n", ""),
            &["`bodies[0].velocity` is missing", "free"][..],
        ),
        (
            with(BODY, "angular_velocity = [0.1, 0.2, 0.3]\n", ""),
            &["`bodies[0].angular_velocity` is missing", "free"],
        ),
        (
            mass("mobility = \"fixed\""),
            &["`bodies[0].velocity` is [0.0, 0.5, 0.0]", "none", "fixed"],
        ),
        (
            mass("mobility = \"pivoted\""),
            &["`bodies[0].velocity`", "none", "pivoted"],
        ),
        (
            still("mobility = \"pivoted\"\n"),
            &["`bodies[0].angular_velocity` is missing", "pivoted"],
        ),
        (
            with(
                &still("mobility = { uniform = {} }\n"),
                "mass = 2.0",
                "mass = 2.0\nangular_velocity = [0, 0, 1]",
            ),
            &["`bodies[0].angular_velocity`", "none", "driven"],
        ),
        (
            still("mobility = \"held\"\n"),
            &["unknown variant `held`", "`fixed`", "`circle`"],
        ),
        (
            still("mobility = { circle = { rat = [0, 0, 1] } }\n"),
            &["unexpected keys in table: rat", "rate"],
        ),
        (
            still("mobility = { circle = { rate = [0, 0, inf] } }\n"),
            &["`bodies[0].mobility.circle.rate`", "inf", "finite"],
        ),
        (
            with(BODY, "inertia = [1.0, 2.0, 2.5]\n", ""),
            &["`bodies[0].inertia` is missing", "three principal moments"],
        ),
        (
            with(BODY, "mass = 2.0", "mass = 0.0"),
            &["`bodies[0].mass` is 0.0", "> 0"],
        ),
        (
            mass("multipole = { order = 3 }"),
            &["`bodies[0].multipole.order` is 3", "2 or 4"],
        ),
        (
            mass("multipole = { order = 4 }"),
            &["`bodies[0].multipole.order` is 4", "ellipsoid", "points"],
        ),
        (
            mass("multipole = { order = 2, ellipsoid = [1, 1, 1] }"),
            &["`bodies[0].multipole.ellipsoid`", "none", "inertia"],
        ),
        (
            mass("multipole = { order = 4, ellipsoid = [1, -1, 1] }"),
            &["`bodies[0].multipole.ellipsoid`", "-1.0", "> 0"],
        ),
        (
            mass("multipole = { degree = 4 }"),
            &["unknown field `degree`", "`order`"],
        ),
        (
            mass("radius = -1.0"),
            &["`bodies[0].radius` is -1.0", "≥ 0"],
        ),
    ] {
        assert_refused(&text(&body), parts);
    }
}
