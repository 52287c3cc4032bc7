use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::{Polyhedron, PolyhedronError};

/// Largest number of subdivisions of an ellipsoid's mesh: 81 920 faces, which still fit in memory easily.
const MOST_SUBDIVISIONS: u32 = 6;

impl Polyhedron {
    /// A cuboid about the origin, with faces normal to the axes and edge lengths twice `semi_axes`.
    pub fn cuboid(semi_axes: [f64; 3], density: f64) -> Result<Self, PolyhedronError> {
        check(semi_axes)?;
        let corner = |index: usize| {
            let sign = |axis: usize| if index >> axis & 1 == 1 { 1.0 } else { -1.0 };
            Vector3::from_fn(|axis, _| sign(axis) * semi_axes[axis])
        };
        let quads = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let faces = quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        Self::new((0..8).map(corner).collect(), faces.collect(), density)
    }

    /// An ellipsoid about the origin, meshed as an icosahedron whose faces are divided into four `subdivisions` times
    /// (20, 80, 320 … faces). The vertices lie on the ellipsoid.
    ///
    /// # Assumptions and limitations
    /// The mesh is inscribed, so its volume is too small: by 39 % for the icosahedron, and each subdivision reduces
    /// this error to about a quarter. [`Polyhedron::with_mass`] restores the ellipsoid's mass.
    pub fn ellipsoid(
        semi_axes: [f64; 3],
        subdivisions: u32,
        density: f64,
    ) -> Result<Self, PolyhedronError> {
        check(semi_axes)?;
        if subdivisions > MOST_SUBDIVISIONS {
            return Err(PolyhedronError::Subdivisions {
                found: subdivisions,
                limit: MOST_SUBDIVISIONS,
            });
        }
        let (mut vertices, mut faces) = icosahedron();
        for _ in 0..subdivisions {
            faces = subdivided(&mut vertices, &faces);
        }
        let semi_axes = Vector3::from(semi_axes);
        for vertex in &mut vertices {
            vertex.component_mul_assign(&semi_axes);
        }
        Self::new(vertices, faces, density)
    }
}

fn check(semi_axes: [f64; 3]) -> Result<(), PolyhedronError> {
    match (0..3).find(|&axis| !(semi_axes[axis].is_finite() && semi_axes[axis] > 0.0)) {
        Some(axis) => Err(PolyhedronError::SemiAxis {
            axis,
            value: semi_axes[axis],
        }),
        None => Ok(()),
    }
}

/// A regular icosahedron on the unit sphere. Its vertices are the corners of three golden rectangles.
fn icosahedron() -> (Vec<Vector3<f64>>, Vec<[usize; 3]>) {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let rectangle = [
        (-1.0, golden),
        (1.0, golden),
        (-1.0, -golden),
        (1.0, -golden),
    ];
    let planes: [fn(f64, f64) -> [f64; 3]; 3] =
        [|a, b| [a, b, 0.0], |a, b| [0.0, a, b], |a, b| [b, 0.0, a]];
    let vertices = planes
        .iter()
        .flat_map(|place| rectangle.map(|(a, b)| Vector3::from(place(a, b)).normalize()))
        .collect();
    let faces = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    (vertices, faces)
}

/// Divides each face into four at the midpoints of its sides, which are projected onto the unit sphere.
fn subdivided(vertices: &mut Vec<Vector3<f64>>, faces: &[[usize; 3]]) -> Vec<[usize; 3]> {
    let mut middles = BTreeMap::new();
    let mut middle = |a: usize, b: usize| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            vertices.push((vertices[a] + vertices[b]).normalize());
            vertices.len() - 1
        })
    };
    let mut finer = Vec::with_capacity(4 * faces.len());
    for &[a, b, c] in faces {
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    finer
}
