use nalgebra::Vector3;

use super::PolyhedronError;

/// An edge. Face `faces[0]` traverses it from `ends[0]` to `ends[1]`, and face `faces[1]` in the opposite direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    pub(super) ends: [usize; 2],
    pub(super) faces: [usize; 2],
}

/// Minimum of twice a face's area, in units of its longest edge squared. Below it, rounding leaves fewer than six
/// digits of the normal.
const LEAST_AREA: f64 = 1e-10;

/// The edges of the closed, oriented surface of `faces`.
pub(super) fn edges(
    vertices: &[Vector3<f64>],
    faces: &[[usize; 3]],
) -> Result<Vec<Edge>, PolyhedronError> {
    for (index, vertex) in vertices.iter().enumerate() {
        if !vertex.iter().all(|c| c.is_finite()) {
            return Err(PolyhedronError::Vertex {
                index,
                position: (*vertex).into(),
            });
        }
    }
    for (face, corners) in faces.iter().enumerate() {
        check_face(vertices, face, corners)?;
    }
    join(faces)
}

fn check_face(
    vertices: &[Vector3<f64>],
    face: usize,
    corners: &[usize; 3],
) -> Result<(), PolyhedronError> {
    let count = vertices.len();
    if let Some(&vertex) = corners.iter().find(|&&vertex| vertex >= count) {
        return Err(PolyhedronError::NoSuchVertex {
            face,
            vertex,
            count,
        });
    }
    let [a, b, c] = corners.map(|vertex| vertices[vertex]);
    let doubled = (b - a).cross(&(c - a)).norm();
    let longest = [b - a, c - b, a - c]
        .iter()
        .fold(0.0, |longest: f64, edge| longest.max(edge.norm_squared()));
    if doubled > LEAST_AREA * longest && doubled.is_finite() {
        Ok(())
    } else {
        Err(PolyhedronError::Degenerate {
            face,
            corners: *corners,
            area: 0.5 * doubled,
        })
    }
}

/// Matches each side of a face with the same side of the neighboring face.
fn join(faces: &[[usize; 3]]) -> Result<Vec<Edge>, PolyhedronError> {
    let mut sides: Vec<([usize; 2], usize)> = (0..)
        .zip(faces)
        .flat_map(|(face, &[a, b, c])| [([a, b], face), ([b, c], face), ([c, a], face)])
        .collect();
    sides.sort_unstable();
    for pair in sides.windows(2) {
        let ([from, to], face) = pair[0];
        if pair[1].0 == [from, to] {
            return Err(PolyhedronError::Orientation {
                faces: [face, pair[1].1],
                from,
                to,
            });
        }
    }
    let mut edges = Vec::with_capacity(sides.len() / 2);
    for &([from, to], face) in &sides {
        let Ok(back) = sides.binary_search_by_key(&[to, from], |side| side.0) else {
            return Err(PolyhedronError::Open { face, from, to });
        };
        if from < to {
            edges.push(Edge {
                ends: [from, to],
                faces: [face, sides[back].1],
            });
        }
    }
    Ok(edges)
}
