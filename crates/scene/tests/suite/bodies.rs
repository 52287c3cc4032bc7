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

/// Returns the body without its velocities, with this mobility instead.
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

const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// A tetrahedron whose center of mass is at the quarter of its axes.
const CORNER: &str = "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], \
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]";

/// Returns a body with this shape, whose inertia follows from the shape.
fn solid(shape: &str) -> String {
    let text = with(BODY, "inertia = [1.0, 2.0, 2.5]\n", "");
    with(
        &text,
        "mass = 2.0\n",
        &format!("mass = 2.0\npolyhedron = {{ {shape} }}\n"),
    )
}

#[test]
fn polyhedra_come_from_shapes_meshes_and_obj_texts() {
    // J of a cuboid is m/3 (b² + c², …), of a cube m/3 · 2 a²
    let cuboid = body(&solid("cuboid = [1.0, 0.5, 0.5]")).body;
    let expected = Vector3::new(0.5, 1.25, 1.25) * (2.0 / 3.0);
    assert!((cuboid.inertia().matrix().diagonal() - expected).norm() < 1e-14);
    assert!((cuboid.mass() - 2.0).abs() < 1e-15);
    let cube = body(&solid(&format!("obj = \"\"\"\n{CUBE}\"\"\", degree = 8"))).body;
    let third = Vector3::from_element(4.0 / 3.0);
    assert!((cube.inertia().matrix().diagonal() - third).norm() < 1e-14);
    assert_eq!(cube.points().len(), 165);
    // about its center of mass, ∫x² is m (1/10 − 1/16) along each axis
    let corner = body(&solid(CORNER)).body;
    let moment = corner.inertia().matrix()[(0, 0)];
    assert!(
        (moment - 2.0 * 2.0 * (0.1 - 0.0625)).abs() < 1e-14,
        "{moment}"
    );
    let own = with(
        &solid("ellipsoid = [3, 2, 1]"),
        "mass = 2.0\n",
        "mass = 2.0\ninertia = [1, 1, 1]\n",
    );
    assert_eq!(body(&own).body.inertia().matrix()[(2, 2)], 1.0);
}

#[test]
fn mistakes_in_polyhedra_are_named() {
    let key = "`bodies[0].polyhedron";
    for (shape, parts) in [
        ("", &["ellipsoid` is missing", "one of `cuboid`"][..]),
        (
            "cuboid = [1, 1, 1], ellipsoid = [1, 1, 1]",
            &["[\"cuboid\", \"ellipsoid\"]", "one of"],
        ),
        (
            "cuboid = [1, 0, 1]",
            &["cuboid` is [1.0, 0.0, 1.0]", "semi-axis 1 is 0"],
        ),
        (
            "ellipsoid = [1, 1, 1], subdivisions = 9",
            &["ellipsoid`", "9 subdivisions", "at most"],
        ),
        (
            "cuboid = [1, 1, 1], subdivisions = 2",
            &["subdivisions` is 2", "`ellipsoid`"],
        ),
        ("vertices = [[0, 0, 0]]", &["faces` is missing"]),
        (
            "cuboid = [1, 1, 1], faces = [[0, 1, 2]]",
            &["faces`", "`vertices`"],
        ),
        (
            "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces = [[0, 1, 2]]",
            &["vertices`", "3 with 1 faces", "not closed"],
        ),
        ("obj = \"v 1 2\"", &["obj`", "line 1", "`v 1 2`"]),
        (
            "cuboid = [1, 1, 1], degree = 1",
            &["degree` is 1", "2 to 10"],
        ),
        (
            "cuboid = [1, 1, 1], degree = 11",
            &["degree` is 11", "2 to 10"],
        ),
    ] {
        let text = text(&solid(shape));
        assert_refused(&text, parts);
        assert_refused(&text, &[key]);
    }
    let parts = ["unknown field `cube`", "`cuboid`"];
    assert_refused(&text(&solid("cube = 1")), &parts);
    let points = with(
        &solid("cuboid = [1, 1, 1]"),
        "mass = 2.0\n",
        "mass = 2.0\npoints = [{ mass = 2.0, position = [0, 0, 0] }]\n",
    );
    assert_refused(&text(&points), &["`bodies[0].points` is 1", "`polyhedron`"]);
    let both = with(
        &solid("cuboid = [1, 1, 1]"),
        "mass = 2.0\n",
        "mass = 2.0\nmultipole = { order = 2 }\n",
    );
    assert_refused(&text(&both), &["`bodies[0]`", "not both"]);
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
