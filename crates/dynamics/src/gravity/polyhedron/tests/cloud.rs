use nalgebra::{Matrix3, Vector3};

use super::super::mass::exponents;
use super::super::{Polyhedron, PolyhedronError, PolyhedronField};
use super::mass::monomials;
use super::rock;
use crate::gravity::Attractor;
use crate::{PointMass, RigidBody};

/// The potential energy of a body with this cloud, at position `x` and attitude `r`, in the field of another body.
fn mutual(field: &PolyhedronField, cloud: &[PointMass], x: &Vector3<f64>, r: &Matrix3<f64>) -> f64 {
    cloud
        .iter()
        .map(|point| point.mass * field.potential(&(x + r * point.position)))
        .sum()
}

/// Relative errors of two cuboids' mutual potential for clouds of degree 2, 4, 6 and 8, at `ratio` times the sum of
/// their radii.
fn errors(ratio: f64, cloud: impl Fn(&Polyhedron, usize) -> Vec<PointMass>) -> [f64; 4] {
    let [a, b] =
        [[1.0, 0.7, 0.4], [0.8, 0.8, 0.5]].map(|axes| Polyhedron::cuboid(axes, 1.0).unwrap());
    let field = PolyhedronField::new(&a, 1.0);
    let r = lgvi_lie::exp(&Vector3::new(0.4, 1.1, -0.7));
    let direction = Vector3::new(0.5, -0.6, 0.4).normalize();
    let x = ratio * (a.bounding_radius() + b.bounding_radius()) * direction;
    let fine = mutual(&field, &b.gauss_points(18), &x, &r);
    [2, 4, 6, 8].map(|degree| (mutual(&field, &cloud(&b, degree), &x, &r) / fine - 1.0).abs())
}

/// Bounds are twice the measured values, and decrease with degree and distance. The error of the reference is below
/// 1e-13 here.
fn assert_within(
    bounds: [(f64, [f64; 4]); 3],
    cloud: impl Fn(&Polyhedron, usize) -> Vec<PointMass>,
) {
    for (ratio, bounds) in bounds {
        let errors = errors(ratio, &cloud);
        let within = errors
            .iter()
            .zip(bounds)
            .all(|(error, bound)| *error < bound);
        assert!(within, "at {ratio}: {errors:?}");
    }
}

#[test]
fn mutual_potential_converges_with_the_degree() {
    let bounds = [
        (1.2, [1e-4, 3e-7, 3e-8, 2e-9]),
        (2.0, [1.1e-5, 3e-8, 6e-11, 1e-12]),
        (4.0, [7e-7, 5e-10, 5e-13, 1e-13]),
    ];
    assert_within(bounds, |body, degree| body.cloud(degree).unwrap());
}

#[test]
fn mutual_potential_of_a_sparse_cloud_converges_with_the_degree() {
    let bounds = [
        (1.2, [1.1e-3, 3e-5, 5e-6, 7e-8]),
        (2.0, [4e-4, 3e-6, 1.3e-7, 1.5e-9]),
        (4.0, [6e-5, 1.1e-7, 1e-9, 3.4e-12]),
    ];
    assert_within(bounds, |body, degree| body.sparse_cloud(degree).unwrap());
}

/// The largest difference between the moments of a body and of points, up to a degree, relative to the mass.
fn lack_of_moments(body: &Polyhedron, points: &[PointMass], degree: usize) -> f64 {
    let found = monomials::<9>(points, &Vector3::zeros());
    let expected = body.clone().recentered().monomials::<9>();
    let of_degree = exponents::<9>().filter(|[i, j, k]| i + j + k <= degree);
    let difference = |[i, j, k]: [usize; 3]| (found[i][j][k] - expected[i][j][k]).abs();
    of_degree.map(difference).fold(0.0, f64::max) / body.mass()
}

#[test]
fn clouds_of_star_shaped_bodies_are_bodies_with_all_moments() {
    let body = rock();
    let inertia = body.inertia().unwrap();
    for degree in 0..=8 {
        let points = body.cloud(degree).unwrap();
        assert!(lack_of_moments(&body, &points, degree) < 1e-14);
        RigidBody::new(body.mass(), inertia.clone(), points).unwrap();
        let points = body.sparse_cloud(degree).unwrap();
        assert!(points.len() <= (degree + 1) * (degree + 2) * (degree + 3) / 6);
        assert!(lack_of_moments(&body, &points, degree) < 1e-14);
        if degree > 0 {
            RigidBody::new(body.mass(), inertia.clone(), points).unwrap();
        }
    }
}

/// The center of a bent body sees some faces from behind. Its clouds have masses of both signs, but the same moments.
#[test]
fn clouds_of_bent_bodies_have_all_moments() {
    let straight = Polyhedron::ellipsoid([1.0, 0.2, 0.2], 1, 1.0).unwrap();
    let bend = |v: &Vector3<f64>| v + 1.2 * v.x * v.x * Vector3::y();
    let vertices = straight.vertices().iter().map(bend).collect();
    let body = Polyhedron::new(vertices, straight.faces().to_vec(), 1.0).unwrap();
    for degree in [2, 5, 8] {
        let points = body.cloud(degree).unwrap();
        assert!(points.iter().any(|point| point.mass < 0.0));
        assert!(lack_of_moments(&body, &points, degree) < 1e-14);
        let points = body.sparse_cloud(degree).unwrap();
        assert!(lack_of_moments(&body, &points, degree) < 1e-13);
    }
}

/// An L whose center lies in the plane of a face, to rounding. This face must have no points, in particular none of
/// negative mass.
#[test]
fn faces_seen_edge_on_have_no_points() {
    let top = 1.0 + 2.0_f64.sqrt();
    let outline = [(0., 0.), (2., 0.), (2., 1.), (1., 1.), (1., top), (0., top)];
    let mut text = String::new();
    for z in [0, 1] {
        for (x, y) in outline {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    text += "f 4 3 2 1 6 5\nf 10 11 12 7 8 9\n";
    for (a, b) in (1..=6).zip([2, 3, 4, 5, 6, 1]) {
        text += &format!("f {a} {b} {} {}\n", b + 6, a + 6);
    }
    let body = Polyhedron::from_obj(&text, 1.0).unwrap();
    assert!((body.center().y - 1.0).abs() < 1e-15);
    let points = body.cloud(2).unwrap();
    assert_eq!(points.len(), 8 * (body.faces().len() - 2));
    assert!(lack_of_moments(&body, &points, 2) < 1e-15);
    RigidBody::new(body.mass(), body.inertia().unwrap(), points).unwrap();
}

/// In units that differ by powers of two, the points are bitwise equal.
#[test]
fn sparse_clouds_do_not_depend_on_the_unit() {
    let (length, mass) = (2.0_f64.powi(100), 2.0_f64.powi(1000));
    let body = rock();
    let vertices = body.vertices().iter().map(|v| v * length).collect();
    let density = body.density() * mass / length.powi(3);
    let other = Polyhedron::new(vertices, body.faces().to_vec(), density).unwrap();
    let points = body.sparse_cloud(4).unwrap();
    let others = other.sparse_cloud(4).unwrap();
    assert_eq!(points.len(), others.len());
    for (point, other) in points.iter().zip(&others) {
        assert_eq!(point.mass * mass, other.mass);
        assert_eq!(point.position * length, other.position);
    }
}

#[test]
fn degrees_beyond_reason_are_refused() {
    let refusal = PolyhedronError::Degree {
        found: 11,
        limit: 10,
    };
    assert_eq!(rock().cloud(11), Err(refusal.clone()));
    assert_eq!(rock().sparse_cloud(11), Err(refusal));
}
