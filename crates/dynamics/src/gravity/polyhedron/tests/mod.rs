mod cloud;
mod derivatives;
mod field;
mod lanes;
mod mass;
mod precision;
mod surface;

use nalgebra::Vector3;

use super::Polyhedron;

fn vectors(seed: u64) -> impl FnMut(f64) -> Vector3<f64> {
    let mut rng = fastrand::Rng::with_seed(seed);
    move |scale| Vector3::from_fn(|_, _| scale * (2.0 * rng.f64() - 1.0))
}

/// An irregular, non-convex body of 80 faces, about 1 in size, with its center of mass off the origin.
fn rock() -> Polyhedron {
    let smooth = Polyhedron::ellipsoid([1.0, 0.8, 0.6], 1, 1.0).unwrap();
    let mut vector = vectors(3);
    let shift = Vector3::new(0.1, -0.2, 0.05);
    let vertices = smooth
        .vertices()
        .iter()
        .map(|vertex| vertex + vector(0.12) + shift)
        .collect();
    Polyhedron::new(vertices, smooth.faces().to_vec(), 1.3).unwrap()
}

/// A smooth, bent body of 320 faces whose corners are multiples of 2⁻²⁰.
fn bent() -> Polyhedron {
    let smooth = Polyhedron::ellipsoid([1.0, 0.7, 0.5], 2, 1.0).unwrap();
    let unit = 2.0_f64.powi(-20);
    let bend = |v: &Vector3<f64>| {
        Vector3::new(v.x, v.y + 0.25 * v.x * v.x, v.z + 0.125 * v.x * v.y)
            .map(|c| (c / unit).round() * unit)
    };
    let vertices = smooth.vertices().iter().map(bend).collect();
    Polyhedron::new(vertices, smooth.faces().to_vec(), 1.0).unwrap()
}
