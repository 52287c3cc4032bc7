//! The field compared with automatic differentiation of independent potentials: the closed form of the cuboid and a sum
//! over Gauss points.

use nalgebra::Vector3;
use num_dual::{DualNum, HyperHyperDual64};

use super::super::{Polyhedron, PolyhedronField};
use super::{rock, vectors};
use crate::gravity::Attractor;

type Triple<T> = [T; 3];

const AXES: [f64; 3] = [1.0, 0.7, 0.4];
const STRENGTH: f64 = 1.7;

/// `−Gσ ∫ dV/r` over the cuboid, summed over its corners (W. D. MacMillan, *The Theory of the Potential*, 1930).
fn cuboid<T: DualNum<f64> + Copy>(d: Triple<T>) -> T {
    let mut sum = T::from(0.0);
    for corner in 0..8 {
        let signs = [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 });
        let r: Triple<T> = std::array::from_fn(|i| -d[i] + signs[i] * AXES[i]);
        let distance = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
        for i in 0..3 {
            let (x, y, z) = (r[i], r[(i + 1) % 3], r[(i + 2) % 3]);
            let along = if x.re() > 0.0 {
                (distance + x).ln()
            } else {
                ((y * y + z * z) / (distance - x)).ln()
            };
            let angle = (y * z / (x * distance)).atan();
            let sign: f64 = signs.iter().product();
            sum += (y * z * along - x * x * angle * 0.5) * sign;
        }
    }
    -sum * STRENGTH
}

/// `−G Σ m/r` over Gauss points, at a distance where their error is at rounding level.
fn points<T: DualNum<f64> + Copy>(polyhedron: &Polyhedron, d: Triple<T>) -> T {
    let mut sum = T::from(0.0);
    for point in polyhedron.gauss_points(20) {
        let place = point.position + polyhedron.center();
        let r: Triple<T> = std::array::from_fn(|i| -d[i] + place[i]);
        let distance = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
        sum -= distance.recip() * point.mass;
    }
    sum * (STRENGTH / polyhedron.density())
}

/// Compares the field at `d` with `potential` and its derivatives, each relative to its largest component.
fn assert_derivatives(
    field: &PolyhedronField,
    d: &Vector3<f64>,
    b: &Vector3<f64>,
    bounds: [f64; 4],
    potential: impl Fn(Triple<HyperHyperDual64>) -> HyperHyperDual64,
) {
    let g = field.gradient(d);
    let a = field.acceleration(d);
    let t = field.curvature(d, b);
    for row in 0..3 {
        for column in row..3 {
            let place = std::array::from_fn(|i| {
                let part = |axis| if i == axis { 1.0 } else { 0.0 };
                let (row, column) = (part(row), part(column));
                HyperHyperDual64::new(d[i], b[i], row, column, 0.0, 0.0, 0.0, 0.0)
            });
            let u = potential(place);
            let pairs = [
                (field.potential(d), u.re, u.re.abs()),
                (a[row], -u.eps2, a.amax()),
                (g[(row, column)], -u.eps2eps3, g.amax()),
                (t[(row, column)], -u.eps1eps2eps3, t.amax()),
            ];
            for (order, ((found, expected, scale), bound)) in pairs.iter().zip(bounds).enumerate() {
                let error = (found - expected).abs() / scale;
                assert!(
                    error <= bound,
                    "derivative {order} at {d:?}: {found} for {expected}, off by {error:e}"
                );
            }
        }
    }
}

#[test]
fn cuboid_has_inside_and_outside_the_derivatives_of_its_closed_potential() {
    let body = Polyhedron::cuboid(AXES, 1.0).unwrap();
    let field = PolyhedronField::new(&body, STRENGTH);
    let mut vector = vectors(5);
    for scale in [2.0, 0.7].repeat(100) {
        let (d, b) = (vector(scale), vector(1.0));
        assert_derivatives(&field, &d, &b, [1e-13, 1e-13, 1e-13, 1e-12], cuboid);
    }
}

/// At a distance δ from the edge, the relative rounding error of the solid angles and of the edges' slopes is `ε
/// size/δ`, here 2e-7. It does not affect potential and acceleration.
#[test]
fn cuboid_has_the_derivatives_of_its_closed_potential_near_an_edge() {
    let body = Polyhedron::cuboid(AXES, 1.0).unwrap();
    let field = PolyhedronField::new(&body, STRENGTH);
    let edge = Vector3::new(AXES[0], AXES[1], 0.125);
    let b = Vector3::new(0.3, -0.4, 0.5);
    for (x, y) in [(1.0, 1.0), (1.0, -0.5), (-1.0, 0.5), (-0.5, -1.0)] {
        let d = edge + 2.0_f64.powi(-30) * Vector3::new(x, y, 0.0);
        assert_derivatives(&field, &d, &b, [1e-13, 1e-13, 3e-8, 1e-8], cuboid);
    }
}

#[test]
fn rock_has_the_derivatives_of_its_points() {
    let body = rock();
    let field = PolyhedronField::new(&body, STRENGTH / body.density());
    let mut vector = vectors(6);
    for _ in 0..2 {
        let (d, b) = (2.0 * vector(1.0).normalize(), vector(1.0));
        assert_derivatives(&field, &d, &b, [1e-13, 1e-13, 1e-13, 1e-12], |d| {
            points(&body, d)
        });
    }
}
