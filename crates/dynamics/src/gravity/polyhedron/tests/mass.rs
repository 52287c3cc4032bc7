use nalgebra::{Matrix3, Vector3};

use super::super::Polyhedron;
use super::super::mass::{Powers, exponents};
use super::{rock, vectors};
use crate::PointMass;

/// Sums of `m x^i y^j z^k` over the points.
pub(super) fn monomials<const N: usize>(points: &[PointMass], shift: &Vector3<f64>) -> Powers<N> {
    let mut sum = [[[0.0; N]; N]; N];
    for point in points {
        let rho = point.position + shift;
        for [i, j, k] in exponents::<N>() {
            sum[i][j][k] +=
                point.mass * rho.x.powi(i as i32) * rho.y.powi(j as i32) * rho.z.powi(k as i32);
        }
    }
    sum
}

#[test]
fn a_cuboid_has_its_textbook_moments() {
    let (axes, density) = ([1.0, 0.7, 0.4], 2.5);
    let body = Polyhedron::cuboid(axes, density).unwrap();
    let mass = density * 8.0 * axes[0] * axes[1] * axes[2];
    assert!((body.mass() - mass).abs() < 1e-15 * mass);
    assert!(body.center().norm() < 1e-16);
    let squares = axes.map(|a| a * a);
    let inertia = Matrix3::from_diagonal(&Vector3::new(
        mass * (squares[1] + squares[2]) / 3.0,
        mass * (squares[0] + squares[2]) / 3.0,
        mass * (squares[0] + squares[1]) / 3.0,
    ));
    assert!((body.inertia().unwrap().matrix() - inertia).norm() < 1e-15 * mass);
    // ∫ x^n over [−a, a] is 2 a^(n+1)/(n + 1) for even n, else zero
    let found = body.monomials::<9>();
    for [i, j, k] in exponents::<9>() {
        let side = |n: usize, a: f64| (1 - n % 2) as f64 * a.powi(n as i32) / (n + 1) as f64;
        let expected = mass * side(i, axes[0]) * side(j, axes[1]) * side(k, axes[2]);
        let error = (found[i][j][k] - expected).abs();
        assert!(error < 1e-15 * mass, "x^{i} y^{j} z^{k}: off by {error:e}");
    }
    let moments = body.moments();
    let close = |found: f64, expected: f64| (found - expected).abs() < 1e-15 * mass;
    assert!(close(moments.second[(1, 1)], mass * squares[1] / 3.0));
    assert!(close(moments.third[0][(1, 2)], 0.0));
    assert!(close(
        moments.fourth[2][0][(2, 0)],
        mass * squares[0] * squares[2] / 9.0
    ));
    assert!(close(
        moments.fourth[1][1][(1, 1)],
        mass * squares[1] * squares[1] / 5.0
    ));
}

#[test]
fn moments_of_a_rock_are_those_of_its_gauss_points() {
    let body = rock();
    let points = body.gauss_points(8);
    let (found, expected) = (
        body.monomials::<9>(),
        monomials::<9>(&points, &body.center()),
    );
    for [i, j, k] in exponents::<9>() {
        let error = (found[i][j][k] - expected[i][j][k]).abs();
        assert!(error < 1e-14, "x^{i} y^{j} z^{k}: off by {error:e}");
    }
    let moments = body.moments();
    assert_eq!(moments.second[(0, 2)], found[1][0][1]);
    assert_eq!(moments.third[1][(1, 2)], found[0][2][1]);
    assert_eq!(moments.fourth[1][0][(2, 1)], found[1][2][1]);
    let second = |point: &PointMass| point.mass * point.position * point.position.transpose();
    let nonstandard: Matrix3<f64> = points.iter().map(second).sum();
    let found = body.inertia().unwrap();
    assert!((found.nonstandard() - nonstandard).norm() < 1e-14);
}

/// Mass properties must not depend on the position of the frame's origin, and Steiner's theorem is not used.
#[test]
fn a_moved_body_keeps_mass_and_inertia_and_recenters_to_where_it_was() {
    let body = rock();
    let shift = 100.0 * vectors(4)(1.0);
    let vertices = body.vertices().iter().map(|v| v + shift).collect();
    let moved = Polyhedron::new(vertices, body.faces().to_vec(), body.density()).unwrap();
    assert!((moved.mass() / body.mass() - 1.0).abs() < 1e-13);
    assert!((moved.center() - body.center() - shift).norm() < 1e-13);
    let (inertia, expected) = (moved.inertia().unwrap(), body.inertia().unwrap());
    assert!((inertia.matrix() - expected.matrix()).norm() < 1e-12);
    let (here, there) = (body.recentered(), moved.recentered());
    for (vertex, expected) in there.vertices().iter().zip(here.vertices()) {
        assert!((vertex - expected).norm() < 1e-12);
    }
    let (volume, first) = here.volume_moments(&Vector3::zeros());
    assert!(first.norm() < 1e-15 * volume);
    assert_eq!(here.center(), Vector3::zeros());
}

#[test]
fn a_mass_asked_for_is_the_mass() {
    let body = rock().with_mass(7.0).unwrap();
    assert!((body.mass() - 7.0).abs() < 1e-15 * 7.0);
    assert_eq!(body.volume(), rock().volume());
}

/// The volume of the inscribed mesh converges to the ellipsoid's volume `4/3 π a b c` with the square of the edge
/// length.
#[test]
fn meshes_of_an_ellipsoid_converge_with_second_order() {
    let axes = [1.0, 0.8, 0.6];
    let volume = 4.0 / 3.0 * core::f64::consts::PI * axes.iter().product::<f64>();
    let lack = |subdivisions| {
        let mesh = Polyhedron::ellipsoid(axes, subdivisions, 1.0).unwrap();
        assert_eq!(mesh.faces().len(), 20 << (2 * subdivisions));
        1.0 - mesh.volume() / volume
    };
    let lacks = [1, 2, 3, 4].map(lack);
    for pair in lacks.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((1.85..2.05).contains(&order), "order {order}: {lacks:?}");
    }
}
