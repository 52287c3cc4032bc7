use std::fmt::Display;

use lgvi_dynamics::gravity::Polyhedron;
use nalgebra::Vector3;

use crate::SceneError;
use crate::file::PolyhedronFile;

/// Default number of subdivisions of an ellipsoid's mesh: 1280 faces.
const SUBDIVISIONS: u32 = 3;

/// Default degree of the point cloud on which other fields act: 35 points.
pub(super) const DEGREE: usize = 4;

/// Limit on the cost of the point clouds of all bodies of a scene together, counted as points times moments. It
/// corresponds to seconds and 200 MB. Without it, a scene of a few lines could ask for hours.
pub(super) const MOST_WORK: u64 = 500_000_000;

/// Cost of computing the cloud of this degree. The Gauss points of one tetrahedron per face are thinned out, preserving
/// all moments up to the degree.
pub(super) fn work(shape: &Polyhedron, degree: usize) -> u64 {
    let n = degree.min(10) as u64;
    let (points, moments) = ((n / 2 + 1).pow(3), (n + 1) * (n + 2) * (n + 3) / 6);
    shape.faces().len() as u64 * points * moments
}

/// Returns the polyhedron with this mass, centered at its center of mass. `key` is the key of the polyhedron.
pub(super) fn polyhedron(
    key: &str,
    file: &PolyhedronFile,
    mass: f64,
) -> Result<Polyhedron, SceneError> {
    let PolyhedronFile {
        cuboid,
        ellipsoid,
        subdivisions,
        vertices,
        faces,
        obj,
        obj_file,
        degree: _,
    } = file;
    let misplaced = |name: &str, value: &dyn std::fmt::Debug, expected: &str| {
        Err(SceneError::value(format!("{key}.{name}"), value, expected))
    };
    if let Some(path) = obj_file {
        let expected =
            "the mesh itself as `obj`: only scenes that are read from a file can name another";
        return misplaced("obj_file", path, expected);
    }
    if let (Some(subdivisions), None) = (subdivisions, ellipsoid) {
        let expected = "none without an `ellipsoid`";
        return misplaced("subdivisions", subdivisions, expected);
    }
    if let (Some(faces), None) = (faces, vertices) {
        return misplaced("faces", &faces.len(), "none without `vertices`");
    }
    let shape = match (cuboid, ellipsoid, vertices, obj) {
        (Some(axes), None, None, None) => {
            let shape = Polyhedron::cuboid(*axes, 1.0);
            shape.map_err(|error| refuse(key, "cuboid", format!("{axes:?}"), error))
        }
        (None, Some(axes), None, None) => {
            let subdivisions = subdivisions.unwrap_or(SUBDIVISIONS);
            let shape = Polyhedron::ellipsoid(*axes, subdivisions, 1.0);
            shape.map_err(|error| {
                let value = format!("{axes:?} with {subdivisions} subdivisions");
                refuse(key, "ellipsoid", value, error)
            })
        }
        (None, None, Some(vertices), None) => {
            let Some(faces) = faces else {
                let expected = "faces, each three numbers of vertices from 0";
                return Err(SceneError::missing(format!("{key}.faces"), expected));
            };
            let count = format!("{} with {} faces", vertices.len(), faces.len());
            let vertices = vertices.iter().copied().map(Vector3::from).collect();
            let shape = Polyhedron::new(vertices, faces.clone(), 1.0);
            shape.map_err(|error| refuse(key, "vertices", count, error))
        }
        (None, None, None, Some(text)) => {
            let value = format!("a text of {} lines", text.lines().count());
            let shape = Polyhedron::from_obj(text, 1.0);
            shape.map_err(|error| refuse(key, "obj", value, error))
        }
        (None, None, None, None) => {
            let expected = "one of `cuboid`, `ellipsoid`, `vertices` with `faces`, `obj`";
            return Err(SceneError::missing(format!("{key}.ellipsoid"), expected));
        }
        _ => {
            let given = [
                ("cuboid", cuboid.is_some()),
                ("ellipsoid", ellipsoid.is_some()),
                ("vertices", vertices.is_some()),
                ("obj", obj.is_some()),
            ];
            let given: Vec<_> = given.iter().filter(|(_, given)| *given).collect();
            let given: Vec<_> = given.iter().map(|(name, _)| *name).collect();
            let expected = "one of `cuboid`, `ellipsoid`, `vertices` with `faces`, `obj`";
            return Err(SceneError::value(key, given, expected));
        }
    }?;
    let shape = shape.with_mass(mass);
    let shape = shape.map_err(|error| refuse(key, "mass", mass.to_string(), error))?;
    Ok(shape.recentered())
}

fn refuse(key: &str, name: &str, value: String, error: impl Display) -> SceneError {
    SceneError::Value {
        line: None,
        key: format!("{key}.{name}"),
        value,
        expected: format!("the shape of a body: {error}"),
    }
}
