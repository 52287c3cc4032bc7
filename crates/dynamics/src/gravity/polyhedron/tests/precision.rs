//! Rounding of fields, and truncation of their series.

use fearless_simd::Level;
use nalgebra::Vector3;

use super::super::frame::Frame;
use super::super::mesh::clusters;
use super::super::series::{Series, limits};
use super::super::{Polyhedron, PolyhedronField, closed};
use super::{bent, rock, vectors};
use crate::gravity::Attractor;

/// Place, potential and acceleration of [`bent`] with `Gσ = 1`, by the formulas of Werner & Scheeres with 60 digits
/// (mpmath).
type Reference = ([f64; 3], f64, [f64; 3]);

const REFERENCES: [Reference; 8] = [
    (
        [0.25, 0.125, -0.0625],
        -2.8441449118703805,
        [
            -0.6316945425433874,
            -0.3335051064756118,
            0.37828400152075276,
        ],
    ),
    (
        [0.5, 0.5, 0.625],
        -1.4995325655785197,
        [
            -0.5681687693478652,
            -0.7212146647135255,
            -1.2237887034692427,
        ],
    ),
    (
        [-0.875, 0.75, -0.5],
        -1.190057597006631,
        [0.6301985112724025, -0.6331285918016933, 0.5209582882987194],
    ),
    (
        [1.5, -1.25, 0.75],
        -0.6716144221362347,
        [
            -0.21854236831011348,
            0.20057352873260473,
            -0.119603197990765,
        ],
    ),
    (
        [-2.0, 1.0, 3.0],
        -0.37907177247632046,
        [
            0.05309619224494058,
            -0.025734694160952143,
            -0.08223332161457525,
        ],
    ),
    (
        [12.0, -16.0, 9.0],
        -0.06447643288082004,
        [
            -0.001602392720220245,
            0.002144618658974306,
            -0.0012028756692856505,
        ],
    ),
    (
        [300.0, 500.0, -400.0],
        -0.002003287627199687,
        [
            -1.2020947100064243e-06,
            -2.003287465831406e-06,
            1.6027943552124211e-06,
        ],
    ),
    (
        [-2e5, 1e5, 3e5],
        -3.785664488324773e-06,
        [
            5.408092521201007e-12,
            -2.7040448779770556e-12,
            -8.11213878182696e-12,
        ],
    ),
];

#[test]
fn the_field_is_that_of_extended_precision() {
    let field = PolyhedronField::new(&bent(), 1.0);
    for (place, u, a) in REFERENCES {
        let (d, a) = (Vector3::from(place), Vector3::from(a));
        let potential = (field.potential(&d) / u - 1.0).abs();
        let acceleration = (field.acceleration(&d) - a).norm() / a.norm();
        println!("{place:?}: potential {potential:.1e}, acceleration {acceleration:.1e}");
        assert!(potential < 2e-15 && acceleration < 3e-15, "{place:?}");
    }
}

fn bodies() -> [Polyhedron; 4] {
    let vertices = rock().vertices().to_vec();
    let needle = vertices
        .iter()
        .map(|v| Vector3::new(3.0 * v.x, 0.5 * v.y, 0.4 * v.z));
    [
        Polyhedron::cuboid([1.0, 0.7, 0.4], 1.3).unwrap(),
        Polyhedron::new(needle.collect(), rock().faces().to_vec(), 0.7).unwrap(),
        rock(),
        bent(),
    ]
}

/// From where it is used on, the series differs from the closed form by the rounding errors of the latter, which are of
/// order `ε d²/V` in units of the body's size.
#[test]
fn the_series_is_the_closed_form() {
    let level = Level::new();
    let mut worst = [0.0_f64; 2];
    for body in bodies() {
        let frame = Frame::of(&body);
        let series = Series::new(level, &body, &frame);
        let clusters = clusters(&body, &frame);
        let volume = body.volume() / frame.unit.powi(3);
        let mut vector = vectors(22);
        for _ in 0..300 {
            let distance = 2.0_f64.powf(-0.5 + vector(1.0).x.abs() * 8.5);
            let d = distance * vector(1.0).normalize();
            let Some(degree) = series.degree(&d) else {
                continue;
            };
            let u = -closed::potential(level, &clusters, &d);
            let a = 2.0 * closed::acceleration(level, &clusters, &d);
            let potential = (volume * series.potential(level, &d, degree) / u - 1.0).abs();
            let difference = volume * series.acceleration(level, &d, degree) - a;
            for (worst, error) in worst
                .iter_mut()
                .zip([potential, difference.norm() / a.norm()])
            {
                *worst = worst.max(error * volume / (distance * distance));
            }
        }
    }
    println!(
        "potential {:.1e}, acceleration {:.1e} of distance squared over volume",
        worst[0], worst[1]
    );
    assert!(worst.iter().all(|worst| *worst < 2e-15), "{worst:?}");
}

/// The bound of the truncated part holds, here for one part in a million, and is not far from it.
#[test]
fn the_truncated_part_is_within_its_bound() {
    let (level, truncation) = (Level::new(), 1e-6);
    for body in bodies() {
        let frame = Frame::of(&body);
        let series = Series::new(level, &body, &frame);
        let clusters = clusters(&body, &frame);
        let volume = body.volume() / frame.unit.powi(3);
        let mut vector = vectors(23);
        let mut worst = 0.0_f64;
        for (degree, squared) in limits(&body, &frame, 8, truncation).into_iter().enumerate() {
            for _ in 0..200 {
                let d = squared.sqrt() * vector(1.0).normalize();
                let expected = 2.0 * closed::acceleration(level, &clusters, &d);
                let found = volume * series.acceleration(level, &d, degree);
                let error = (found - expected).norm() * squared / volume;
                // beyond it, the closed form is not precise enough
                if squared < 1e4 {
                    worst = worst.max(error);
                }
            }
        }
        println!("{worst:.1e} where {truncation:.0e} is allowed");
        assert!(worst < truncation && worst > 0.01 * truncation, "{worst:e}");
    }
}
