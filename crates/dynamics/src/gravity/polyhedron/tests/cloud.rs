use nalgebra::{Matrix3, Vector3};

use super::super::{Polyhedron, PolyhedronField};
use super::rock;
use crate::gravity::Attractor;
use crate::{PointMass, RigidBody};

/// The potential energy of a body with this cloud at `x`, attitude `r`, in another's field.
fn mutual(field: &PolyhedronField, cloud: &[PointMass], x: &Vector3<f64>, r: &Matrix3<f64>) -> f64 {
    cloud
        .iter()
        .map(|point| point.mass * field.potential(&(x + r * point.position)))
        .sum()
}

/// Relative error of two bodies' mutual potential by degree of the cloud, at `ratio` times the sum of their radii.
fn errors([a, b]: &[Polyhedron; 2], ratio: f64, degrees: &[usize]) -> Vec<f64> {
    let field = PolyhedronField::new(a, 1.0);
    let r = lgvi_lie::exp(&Vector3::new(0.4, 1.1, -0.7));
    let direction = Vector3::new(0.5, -0.6, 0.4).normalize();
    let x = ratio * (a.bounding_radius() + b.bounding_radius()) * direction;
    let fine = mutual(&field, &b.cloud(18), &x, &r);
    let error = |&degree: &usize| (mutual(&field, &b.cloud(degree), &x, &r) / fine - 1.0).abs();
    degrees.iter().map(error).collect()
}

/// Bounds are twice the figures measured; the reference is the cloud of degree 18, itself finer than 1e-13 here.
#[test]
fn mutual_potential_converges_with_the_degree() {
    let cuboids =
        [[1.0, 0.7, 0.4], [0.8, 0.8, 0.5]].map(|axes| Polyhedron::cuboid(axes, 1.0).unwrap());
    let degrees = [2, 4, 6, 8];
    let bounds = [
        (1.2, [1e-4, 3e-7, 3e-8, 2e-9]),
        (2.0, [1.1e-5, 3e-8, 6e-11, 1e-12]),
        (4.0, [7e-7, 5e-10, 5e-13, 1e-13]),
    ];
    for (ratio, bounds) in bounds {
        let errors = errors(&cuboids, ratio, &degrees);
        let within = errors
            .iter()
            .zip(bounds)
            .all(|(error, bound)| *error < bound);
        assert!(within, "at {ratio}: {errors:?}");
    }
}

#[test]
fn clouds_of_star_shaped_bodies_are_bodies() {
    let body = rock();
    for degree in 0..=8 {
        let points = body.cloud(degree);
        RigidBody::new(body.mass(), body.inertia().unwrap(), points).unwrap();
    }
}
