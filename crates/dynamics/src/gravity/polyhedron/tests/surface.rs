use nalgebra::Vector3;

use super::super::{ObjError, Polyhedron, PolyhedronError};

fn tetrahedron() -> (Vec<Vector3<f64>>, Vec<[usize; 3]>) {
    let vertices = vec![Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()];
    let faces = vec![[0, 2, 1], [0, 3, 2], [0, 1, 3], [1, 2, 3]];
    (vertices, faces)
}

fn refusal(change: impl FnOnce(&mut Vec<Vector3<f64>>, &mut Vec<[usize; 3]>)) -> PolyhedronError {
    let (mut vertices, mut faces) = tetrahedron();
    change(&mut vertices, &mut faces);
    Polyhedron::new(vertices, faces, 1.0).unwrap_err()
}

#[test]
fn surfaces_that_bound_no_body_are_refused_with_their_values() {
    let (vertices, faces) = tetrahedron();
    let volume = Polyhedron::new(vertices, faces, 1.0).unwrap().volume();
    assert_eq!(volume, 1.0 / 6.0);
    assert!(matches!(
        refusal(|vertices, _| vertices[2].y = f64::NAN),
        PolyhedronError::Vertex { index: 2, .. }
    ));
    assert_eq!(
        refusal(|_, faces| faces[1][1] = 4),
        PolyhedronError::NoSuchVertex {
            face: 1,
            vertex: 4,
            count: 4
        }
    );
    assert_eq!(
        refusal(|_, faces| faces[1][1] = 0),
        PolyhedronError::Degenerate {
            face: 1,
            corners: [0, 0, 2],
            area: 0.0
        }
    );
    assert!(matches!(
        refusal(|vertices, _| vertices[3] = 0.5 * Vector3::x()),
        PolyhedronError::Degenerate { face: 2, .. }
    ));
    assert_eq!(
        refusal(|_, faces| faces[3].swap(0, 1)),
        PolyhedronError::Orientation {
            faces: [2, 3],
            from: 1,
            to: 3
        }
    );
    assert_eq!(
        refusal(|_, faces| faces.truncate(3)),
        PolyhedronError::Open {
            face: 2,
            from: 1,
            to: 3
        }
    );
    let inside_out = |_: &mut Vec<_>, faces: &mut Vec<[usize; 3]>| {
        faces.iter_mut().for_each(|face| face.swap(0, 1));
    };
    assert_eq!(refusal(inside_out), PolyhedronError::Volume(-1.0 / 6.0));
    let flat = |vertices: &mut Vec<_>, _: &mut Vec<_>| vertices[3] = Vector3::new(1.0, 1.0, 0.0);
    assert_eq!(refusal(flat), PolyhedronError::Volume(0.0));
    assert_eq!(
        refusal(|_, faces| faces.clear()),
        PolyhedronError::Volume(0.0)
    );
    let huge = |vertices: &mut Vec<Vector3<f64>>, _: &mut Vec<_>| {
        vertices.iter_mut().for_each(|vertex| *vertex *= 1e200);
    };
    assert!(matches!(refusal(huge), PolyhedronError::Degenerate { .. }));
}

#[test]
fn unphysical_figures_are_refused() {
    assert_eq!(
        Polyhedron::cuboid([1.0, -2.0, 3.0], 1.0),
        Err(PolyhedronError::SemiAxis {
            axis: 1,
            value: -2.0
        })
    );
    assert_eq!(
        Polyhedron::cuboid([1.0; 3], 0.0),
        Err(PolyhedronError::Density(0.0))
    );
    assert_eq!(
        Polyhedron::ellipsoid([1.0; 3], 7, 1.0),
        Err(PolyhedronError::Subdivisions { found: 7, limit: 6 })
    );
    let cube = Polyhedron::cuboid([1.0; 3], 1.0).unwrap();
    assert_eq!(cube.with_mass(-1.0), Err(PolyhedronError::Mass(-1.0)));
    assert_eq!(
        Polyhedron::cuboid([1e70; 3], 1e150),
        Err(PolyhedronError::Mass(f64::INFINITY))
    );
}

#[test]
fn obj_text_reads_as_the_mesh_it_describes() {
    let text = "# pyramid\r\no thing\nv 1 1 0 0.5 0.5 0.5\nv -1 1 0\nv -1 -1 0\n\nv 1 -1 0\nvn 0 0 1\n\
                f 4/1/1 3//1 2/1 1\nv 0.0 0 3e0\ns off\nf 1 2 5\nf 2 3 -1\nf -3 -2 -1\nf 4 1 5\n";
    let pyramid = Polyhedron::from_obj(text, 2.0).unwrap();
    assert_eq!(pyramid.faces().len(), 6);
    assert!((pyramid.mass() - 8.0).abs() < 1e-14);
    assert!((pyramid.center() - Vector3::new(0.0, 0.0, 0.75)).norm() < 1e-15);
}

#[test]
fn obj_errors_name_the_line() {
    let read = |text: &str| Polyhedron::from_obj(text, 1.0).unwrap_err();
    for bad in ["v 1 2", "v 1 2 x", "v 1 nan 3"] {
        let (line, text) = (2, bad.to_owned());
        assert_eq!(read(&format!("#\n{bad}")), ObjError::Vertex { line, text });
    }
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for bad in [
        "0",
        "4",
        "-4",
        "x",
        "9223372036854775808",
        "-9223372036854775808",
    ] {
        assert_eq!(
            read(&format!("{corners}f 1 2 {bad}/7")),
            ObjError::Corner {
                line: 4,
                corner: format!("{bad}/7"),
                count: 3
            }
        );
    }
    assert_eq!(
        read(&format!("{corners}f 1 2")),
        ObjError::Face {
            line: 4,
            text: "f 1 2".to_owned()
        }
    );
    assert_eq!(
        read(&format!("{corners}f 1 2 3")),
        ObjError::Polyhedron(PolyhedronError::Open {
            face: 0,
            from: 0,
            to: 1
        })
    );
    let message = read("v 0 0 0\nf 1 2 3").to_string();
    assert!(message.starts_with("line 2: corner `2` names none of the 1 vertices"));
}
