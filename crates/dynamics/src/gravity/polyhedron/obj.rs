use nalgebra::Vector3;

use super::{ObjError, Polyhedron};

impl Polyhedron {
    /// Reads the `v` and `f` lines of a Wavefront OBJ text and ignores all other lines. It also ignores numbers after a
    /// vertex's three coordinates, and the texture and normal of a corner.
    ///
    /// # Assumptions and limitations
    /// Polygons are split into triangles that fan out from their first corner, which is correct for convex polygons. A
    /// backslash does not continue a line. Lengths are in the unit of the file.
    pub fn from_obj(text: &str, density: f64) -> Result<Self, ObjError> {
        let mut vertices = Vec::new();
        let mut faces = Vec::new();
        for (line, text) in (1..).zip(text.lines()) {
            let mut words = text.split_whitespace();
            match words.next() {
                Some("v") => match vertex(words) {
                    Some(vertex) => vertices.push(vertex),
                    None => {
                        let text = text.to_owned();
                        return Err(ObjError::Vertex { line, text });
                    }
                },
                Some("f") => {
                    let count = vertices.len();
                    let corner = |word: &str| {
                        corner(word, count).ok_or_else(|| ObjError::Corner {
                            line,
                            corner: word.to_owned(),
                            count,
                        })
                    };
                    let corners = words.map(corner).collect::<Result<Vec<_>, _>>()?;
                    if corners.len() < 3 {
                        let text = text.to_owned();
                        return Err(ObjError::Face { line, text });
                    }
                    let fan = corners[1..].windows(2);
                    faces.extend(fan.map(|side| [corners[0], side[0], side[1]]));
                }
                _ => {}
            }
        }
        Ok(Self::new(vertices, faces, density)?)
    }
}

fn vertex<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<Vector3<f64>> {
    let mut vertex = Vector3::zeros();
    for coordinate in &mut vertex {
        let value: f64 = words.next()?.parse().ok()?;
        if !value.is_finite() {
            return None;
        }
        *coordinate = value;
    }
    Some(vertex)
}

/// The index from 0 for a corner such as `5`, `5/1`, `5//2`, `5/1/2`, or `-1`, which counts back from the latest
/// vertex.
fn corner(word: &str, count: usize) -> Option<usize> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let index = if number < 0 {
        i64::try_from(count).ok()?.checked_add(number)?
    } else {
        number - 1
    };
    usize::try_from(index).ok().filter(|&index| index < count)
}
