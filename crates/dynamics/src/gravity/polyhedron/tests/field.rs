use core::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use super::super::{Polyhedron, PolyhedronField};
use super::{rock, vectors};
use crate::gravity::Attractor;

const G: f64 = 0.7;

fn field(body: &Polyhedron) -> PolyhedronField {
    PolyhedronField::new(body, G)
}

/// Random points, each with the result of [`PolyhedronField::contains`].
fn places(field: &PolyhedronField) -> impl Iterator<Item = (Vector3<f64>, bool)> {
    let mut vector = vectors(11);
    (0..500).map(move |_| {
        let d = vector(1.2);
        (d, field.contains(&d))
    })
}

/// Returns true if a ray from `d` leaves the body once more than it enters it, that is, if `d` is inside.
fn ray_leaves_once_more(body: &Polyhedron, d: &Vector3<f64>) -> bool {
    let ray = Vector3::new(0.3, -0.5, 0.7);
    let crossing = |[a, b, c]: [Vector3<f64>; 3]| {
        let signs = [(a, b), (b, c), (c, a)].map(|(p, q)| ray.dot(&p.cross(&q)) > 0.0);
        let ahead = a.dot(&b.cross(&c)) * ray.dot(&(b - a).cross(&(c - a))) > 0.0;
        match (signs, ahead) {
            ([true, true, true], true) => 1,
            ([false, false, false], true) => -1,
            _ => 0,
        }
    };
    body.tetrahedra(d).map(crossing).sum::<i32>() == 1
}

#[test]
fn what_is_inside_is_what_a_ray_leaves_once_more() {
    let body = rock();
    let field = field(&body);
    let mut inside = 0;
    for (d, found) in places(&field) {
        assert_eq!(found, ray_leaves_once_more(&body, &d), "{d:?}");
        inside += usize::from(found);
    }
    assert!((50..450).contains(&inside), "{inside} of 500 inside");
}

#[test]
fn potential_is_harmonic_outside_and_has_the_density_inside() {
    let body = rock();
    let field = field(&body);
    for (d, inside) in places(&field) {
        let g = field.gradient(&d);
        let density = 4.0 * PI * G * body.density();
        let expected = if inside { -density } else { 0.0 };
        assert!((g.trace() - expected).abs() < 1e-13 * density, "{d:?}");
        assert!((g - g.transpose()).amax() < 1e-14 * density);
        let t = field.curvature(&d, &Vector3::new(0.3, -1.0, 0.5));
        assert!(t.trace().abs() < 1e-12 * t.amax(), "{d:?}: {t}");
    }
}

/// `T(b) c = T(c) b`: the third derivatives are symmetric in all three indices.
#[test]
fn third_derivatives_are_symmetric() {
    let field = field(&rock());
    let mut vector = vectors(12);
    for _ in 0..100 {
        let (d, b, c) = (vector(1.5), vector(1.0), vector(1.0));
        let (one, other) = (field.curvature(&d, &b), field.curvature(&d, &c));
        assert!((one * c - other * b).norm() < 1e-12 * one.amax().max(other.amax()));
    }
}

/// A rotated and translated body has the rotated and translated field.
#[test]
fn field_moves_with_the_body() {
    let body = rock();
    let (shift, turn) = (
        Vector3::new(0.5, -0.3, 0.8),
        lgvi_lie::exp(&Vector3::new(0.4, 1.1, -0.7)),
    );
    let vertices = body.vertices().iter().map(|v| turn * v + shift).collect();
    let moved = Polyhedron::new(vertices, body.faces().to_vec(), body.density()).unwrap();
    let (here, there) = (field(&body), field(&moved));
    let mut vector = vectors(13);
    for _ in 0..50 {
        let (d, b) = (vector(2.0), vector(1.0));
        let place = turn * d + shift;
        let near = |found: f64, expected: f64| (found - expected).abs() < 1e-12 * expected.abs();
        assert!(near(there.potential(&place), here.potential(&d)));
        let a = turn * here.acceleration(&d);
        assert!((there.acceleration(&place) - a).norm() < 1e-12 * a.norm());
        let turned = |m: Matrix3<f64>| turn * m * turn.transpose();
        let g = turned(here.gradient(&d));
        assert!((there.gradient(&place) - g).norm() < 1e-12 * g.norm());
        let t = turned(here.curvature(&d, &b));
        assert!((there.curvature(&place, &(turn * b)) - t).norm() < 1e-11 * t.norm());
    }
}

/// Compares the field with the expansion `φ = −G ∫ Σ_n |ρ|ⁿ P_n(cos ∠(d, ρ)) dm/rⁿ⁺¹` to degree four, from mass, `J_d`
/// and the moments. The remainder decreases by a factor of 64 when r doubles.
#[test]
fn far_field_is_that_of_mass_and_moments() {
    let body = rock().recentered();
    let field = field(&body);
    let moments = body.moments();
    let u = Vector3::new(0.5, -0.6, 0.4).normalize();
    let along = |m: &Matrix3<f64>| u.dot(&(m * u));
    let second = *body.inertia().unwrap().nonstandard();
    let third = [0, 1, 2].map(|i| 2.5 * u[i] * along(&moments.third[i]));
    let third_traced = [0, 1, 2].map(|i| 1.5 * u[i] * moments.third[i].trace());
    let pairs = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (i, j)));
    let fourth = pairs.as_flattened().iter().map(|&(i, j)| {
        let m = &moments.fourth[i][j];
        let same = if i == j { 3.0 * m.trace() } else { 0.0 };
        (u[i] * u[j] * (35.0 * along(m) - 30.0 * m.trace()) + same) / 8.0
    });
    let terms = [
        body.mass(),
        1.5 * along(&second) - 0.5 * second.trace(),
        third.iter().sum::<f64>() - third_traced.iter().sum::<f64>(),
        fourth.sum(),
    ];
    let rest = |r: f64| {
        let powers = [1, 3, 4, 5].map(|n| r.powi(-n));
        let expansion: f64 = terms.iter().zip(powers).map(|(m, p)| m * p).sum();
        field.potential(&(r * u)) + G * expansion
    };
    let rests = [4.0, 8.0, 16.0].map(rest);
    for pair in rests.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((5.7..6.3).contains(&order), "order {order}: {rests:?}");
    }
}

/// At distances where points with the body's moments to degree eight are practically exact, the rounding error grows as
/// the square of the distance.
#[test]
fn rounding_far_away_stays_below_its_bound() {
    let body = Polyhedron::ellipsoid([1.0, 0.7, 0.4], 2, 1.3).unwrap();
    let field = field(&body);
    let cloud = body.cloud(8).unwrap();
    let direction = Vector3::new(0.5, -0.6, 0.4).normalize();
    let b = Vector3::new(0.3, -0.4, 0.5);
    for distance in [1e2_f64, 1e3, 1e4] {
        let d = distance * direction;
        let (mut u, mut a) = (0.0, Vector3::zeros());
        let (mut g, mut t) = (Matrix3::zeros(), Matrix3::zeros());
        for point in cloud
            .iter()
            .map(|point| (G * point.mass, d - point.position))
        {
            let (gm, s) = point;
            let r = s.norm();
            let (outer, mixed) = (s * s.transpose(), b * s.transpose());
            let even = mixed + mixed.transpose() + Matrix3::from_diagonal_element(b.dot(&s));
            u -= gm / r;
            a -= gm / r.powi(3) * s;
            g += gm * (3.0 * outer / r.powi(5) - Matrix3::identity() / r.powi(3));
            t += gm * (3.0 * even / r.powi(5) - 15.0 * b.dot(&s) * outer / r.powi(7));
        }
        let bound = 3e-15 * distance * distance;
        assert!((field.potential(&d) / u - 1.0).abs() < bound);
        assert!((field.acceleration(&d) - a).norm() < bound * a.norm());
        assert!((field.gradient(&d) - g).norm() < bound * g.norm());
        assert!((field.curvature(&d, &b) - t).norm() < bound * t.norm());
    }
}

/// Meshes of a sphere with the sphere's mass converge to the field of a point with the square of their edge length.
#[test]
fn meshes_of_a_sphere_converge_to_a_point() {
    let d = Vector3::new(0.9, -1.1, 0.7);
    let gm = G * 3.0;
    let point = -gm * d / (d.norm_squared() * d.norm());
    let error = |subdivisions| {
        let mesh = Polyhedron::ellipsoid([1.0; 3], subdivisions, 1.0).unwrap();
        // A mesh of equal mass, which differs from the sphere only by its facets.
        let field = field(&mesh.with_mass(3.0).unwrap());
        (field.acceleration(&d) - point).norm() / point.norm()
    };
    let errors = [1, 2, 3, 4].map(error);
    for pair in errors.windows(2) {
        assert!(pair[0] / pair[1] > 3.5, "{errors:?}");
    }
    assert!(errors[3] < 1e-5, "{errors:?}");
}

/// The field is continuous where it is finite: at corners, on edges and their extensions, and on faces.
#[test]
fn potential_and_acceleration_are_continuous_onto_the_surface() {
    let body = Polyhedron::cuboid([1.0, 0.7, 0.4], 1.3).unwrap();
    let field = field(&body);
    let on_surface = [
        [1.0, 0.7, 0.4],
        [1.0, 0.7, 0.1],
        [0.5, 0.35, 0.4],
        [1.0, 0.0, 0.0],
        [1.0, 0.2, -0.3],
        [1.0, 0.7, 2.0],
        [0.0, 0.0, 0.0],
    ];
    let mut vector = vectors(14);
    for place in on_surface.map(Vector3::from) {
        let (u, a) = (field.potential(&place), field.acceleration(&place));
        for step in [1e-3, 1e-6, 1e-9, 1e-12] {
            let d = place + step * vector(1.0).normalize();
            // |∂a| grows as the logarithm of the distance to an edge.
            let bound = 40.0 * step * (1.0 - step.ln());
            assert!((field.potential(&d) - u).abs() < bound + 1e-14, "{place:?}");
            assert!(
                (field.acceleration(&d) - a).norm() < bound + 1e-14,
                "{place:?}"
            );
        }
    }
}

/// The gradient jumps by `4πGσ n nᵀ` across a face. On the face, including its diagonal, it is the mean of both sides.
#[test]
fn gradient_jumps_across_a_face_by_the_density() {
    let body = Polyhedron::cuboid([1.0, 0.7, 0.4], 1.3).unwrap();
    let field = field(&body);
    let step = 1e-6 * Vector3::x();
    for on in [Vector3::new(1.0, 0.2, -0.3), Vector3::x()] {
        let [inside, mean, outside] = [on - step, on, on + step].map(|d| field.gradient(&d));
        let jump = 4.0 * PI * G * body.density() * Matrix3::from_diagonal(&Vector3::x());
        assert!((outside - inside - jump).norm() < 1e-4);
        assert!((mean - 0.5 * (inside + outside)).norm() < 1e-4);
        assert!(field.contains(&(on - step)) && !field.contains(&(on + step)));
    }
    let edge = field.gradient(&Vector3::new(1.0, 0.7, 0.1));
    assert!(edge.iter().any(|entry| !entry.is_finite()));
}
