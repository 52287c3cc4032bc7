use lgvi_dynamics::gravity::Moments;
use lgvi_scene::{NamedBody, Scene, Shape};
use nalgebra::{Matrix3, Vector3};

use crate::shipped::shipped;
use crate::{BODY, RUN, with};

fn body(text: &str) -> NamedBody {
    let text = format!("{RUN}\n[[bodies]]\nname = \"body\"{text}");
    Scene::parse("test", &text).unwrap().bodies.remove(0)
}

/// As the scene file says, its inertia is that of two spheres of radius 0.15 at ±0.15.
#[test]
fn a_dumbbells_spheres_make_up_its_inertia() {
    let scene = shipped("inclination_change");
    let shape = scene.bodies[0].shape();
    let Shape::Spheres { centers, radius } = &shape else {
        panic!("{shape:?}")
    };
    let end = Vector3::new(0.15, 0.0, 0.0);
    assert_eq!(*centers, [end, -end]);
    assert!((radius - 0.15).abs() < 1e-15, "{radius}");
    assert!((shape.extent() - 0.3).abs() < 1e-15);
}

/// The ellipsoid has the moments of inertia of the body, whatever its axes.
#[test]
fn an_ellipsoid_has_the_bodys_mass_and_inertia() {
    let turned = "inertia = [[1.5, 0.3, -0.2], [0.3, 2.0, 0.1], [-0.2, 0.1, 2.2]]";
    let body = body(&with(BODY, "inertia = [1.0, 2.0, 2.5]", turned));
    let shape = body.shape();
    let Shape::Ellipsoid {
        center,
        axes,
        semi_axes,
    } = &shape
    else {
        panic!("{shape:?}")
    };
    assert_eq!(*center, Vector3::zeros());
    assert!((axes.determinant() - 1.0).abs() < 1e-14);
    let second = Moments::of_ellipsoid(2.0, (*semi_axes).into()).second;
    let second = axes * second * axes.transpose();
    let inertia = Matrix3::from_diagonal_element(second.trace()) - second;
    assert!((inertia - body.body.inertia().matrix()).norm() < 1e-14);
    assert_eq!(shape.extent(), semi_axes.max());
}

#[test]
fn a_pendulum_hangs_below_its_pivot() {
    let scene = shipped("pendulum");
    let shape = scene.bodies[0].shape();
    let Shape::Ellipsoid {
        center, semi_axes, ..
    } = &shape
    else {
        panic!("{shape:?}")
    };
    assert_eq!(*center, Vector3::new(0.0, 0.0, 0.3));
    // About the center of mass, J = diag(0.04, 0.19, 0.17), so that J_d = diag(0.16, 0.01, 0.03) and a = √(5 J_d/m).
    let mut squared: Vec<_> = semi_axes.iter().map(|a| a * a).collect();
    squared.sort_by(f64::total_cmp);
    for (found, expected) in squared.into_iter().zip([0.05, 0.15, 0.8]) {
        assert!((found - expected).abs() < 1e-12, "{semi_axes}");
    }
}

#[test]
fn what_is_flat_can_still_be_seen() {
    // A needle along x, and two points that account for the whole inertia.
    let needle = body(&with(BODY, "[1.0, 2.0, 2.5]", "[1e-9, 2.0, 2.0]"));
    let Shape::Ellipsoid { semi_axes, .. } = needle.shape() else {
        panic!("{needle:?}")
    };
    assert_eq!(semi_axes.min(), 0.02 * semi_axes.max());
    let ends =
        "points = [{ mass = 1.0, position = [1, 0, 0] }, { mass = 1.0, position = [-1, 0, 0] }]\n";
    let points = format!("{}{ends}", with(BODY, "[1.0, 2.0, 2.5]", "[1e-9, 2, 2]"));
    let points = body(&points);
    let Shape::Spheres { radius, .. } = points.shape() else {
        panic!("{points:?}")
    };
    assert_eq!(radius, 0.02);
}

#[test]
fn a_polyhedron_keeps_its_surface() {
    let scene = shipped("asteroid_orbiter");
    let shape = scene.bodies[0].shape();
    let Shape::Mesh(mesh) = shape else {
        panic!("{shape:?}")
    };
    assert_eq!(mesh.faces().len(), 20 * 16);
    assert!((mesh.mass() / 3.51e10 - 1.0).abs() < 1e-12);
    assert!((shape.extent() - 267.5).abs() < 1e-6, "{}", shape.extent());
}
