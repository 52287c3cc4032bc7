use lgvi_common::header;
use lgvi_lie::to_quaternion;
use lgvi_msgs::geometry_msgs::{Point, Pose, Quaternion};
use lgvi_msgs::stamp::StampError;
use lgvi_msgs::std_msgs::{ColorRGBA, Header};
use lgvi_msgs::visualization_msgs::{Marker, MarkerArray};
use lgvi_scene::{CentralAttractor, Oblateness, Scene, Shape};
use nalgebra::{Matrix3, Vector3};

use super::states::vector;

/// Colors of the bodies, in turn.
const COLORS: [[f32; 3]; 6] = [
    [0.90, 0.62, 0.00],
    [0.34, 0.71, 0.91],
    [0.00, 0.62, 0.45],
    [0.80, 0.47, 0.65],
    [0.94, 0.89, 0.26],
    [0.84, 0.37, 0.00],
];

/// Color of the attractor.
const ATTRACTOR: [f32; 3] = [0.55, 0.60, 0.70];

/// What the scene shows: each body's shape in its own frame, and the attractor.
pub(crate) fn markers(scene: &Scene) -> Result<MarkerArray, StampError> {
    let header = header(scene, 0)?;
    let mut markers: Vec<_> = (0_i32..)
        .zip(&scene.bodies)
        .zip(COLORS.iter().cycle())
        .map(|((id, named), color)| Marker {
            header: Header {
                frame_id: named.frame.clone(),
                ..header.clone()
            },
            ns: "bodies".into(),
            id,
            frame_locked: true,
            color: opaque(*color),
            ..solid(&named.shape(), scene.units.length)
        })
        .collect();
    let central = scene.gravity.central.as_ref();
    if let Some((center, radius)) = central.and_then(sphere) {
        markers.push(Marker {
            header,
            ns: "attractor".into(),
            color: opaque(ATTRACTOR),
            ..ellipsoid(
                center * scene.units.length,
                &Matrix3::identity(),
                Vector3::repeat(radius * scene.units.length),
            )
        });
    }
    Ok(MarkerArray { markers })
}

/// A shape in a scene whose unit of length is `length` (m).
fn solid(shape: &Shape<'_>, length: f64) -> Marker {
    match shape {
        Shape::Mesh(mesh) => Marker {
            r#type: Marker::TRIANGLE_LIST,
            scale: vector([1.0; 3]),
            points: mesh
                .faces()
                .iter()
                .flatten()
                .map(|vertex| point(mesh.vertices()[*vertex] * length))
                .collect(),
            ..Marker::default()
        },
        Shape::Spheres { centers, radius } => Marker {
            r#type: Marker::SPHERE_LIST,
            scale: vector([2.0 * radius * length; 3]),
            points: centers
                .iter()
                .map(|center| point(center * length))
                .collect(),
            ..Marker::default()
        },
        Shape::Ellipsoid {
            center,
            axes,
            semi_axes,
        } => ellipsoid(center * length, axes, semi_axes * length),
    }
}

fn ellipsoid(center: Vector3<f64>, axes: &Matrix3<f64>, semi_axes: Vector3<f64>) -> Marker {
    let (w, u) = to_quaternion(axes);
    Marker {
        r#type: Marker::SPHERE,
        pose: Pose {
            position: point(center),
            orientation: Quaternion {
                x: u.x,
                y: u.y,
                z: u.z,
                w,
            },
        },
        scale: vector((2.0 * semi_axes).into()),
        ..Marker::default()
    }
}

/// Center and radius of an attractor that has an extent.
fn sphere(central: &CentralAttractor) -> Option<(Vector3<f64>, f64)> {
    let of_shape = |oblateness: &Oblateness| oblateness.reference_radius;
    let radius = if central.radius > 0.0 {
        Some(central.radius)
    } else {
        central.oblateness.as_ref().map(of_shape)
    };
    Some((central.position, radius?))
}

fn opaque([r, g, b]: [f32; 3]) -> ColorRGBA {
    ColorRGBA { r, g, b, a: 1.0 }
}

fn point(p: Vector3<f64>) -> Point {
    let [x, y, z] = p.into();
    Point { x, y, z }
}

#[cfg(test)]
mod tests {
    use lgvi_msgs::geometry_msgs::Vector3 as Scale;

    use super::*;

    const RUN: &str = r#"
        title = "Shapes"
        [units]
        length = "1 km"
        [run]
        duration = 1.0
        steps = 10
        integrator = "lgvi"
        [gravity.central]
        gm = 1.0
        position = [0, 0, 5]
        radius = 0.5
    "#;
    const STATE: &str = r#"
        velocity = [0, 0, 0]
        attitude = { w = 1, x = 0, y = 0, z = 0 }
        angular_velocity = [0, 0, 0]
    "#;

    #[test]
    fn bodies_look_as_their_mass_lies() {
        let mesh = "name = \"mesh\"\nmass = 2.0\npolyhedron = { cuboid = [0.1, 0.2, 0.3] }\nposition = [1, 0, 0]";
        let point =
            "name = \"point\"\nmass = 5.0\ninertia = [0.05, 0.06, 0.08]\nposition = [9, 0, 0]";
        let text = format!("{RUN}[[bodies]]\n{mesh}{STATE}[[bodies]]\n{point}{STATE}");
        let scene = Scene::parse("test", &text).unwrap();
        let markers = markers(&scene).unwrap().markers;
        let [mesh, ellipsoid, attractor] = &markers[..] else {
            panic!("{markers:?}")
        };
        for (marker, (ns, id, frame)) in markers.iter().zip([
            ("bodies", 0, "mesh"),
            ("bodies", 1, "point"),
            ("attractor", 0, "inertial"),
        ]) {
            assert_eq!((marker.ns.as_str(), marker.id), (ns, id));
            assert_eq!(marker.header.frame_id, frame);
            assert_eq!(marker.frame_locked, ns == "bodies");
            assert_eq!(marker.color.a, 1.0);
        }
        // Outward triangles: their volume by the divergence theorem is that of the cuboid.
        assert_eq!(mesh.r#type, Marker::TRIANGLE_LIST);
        assert_eq!(mesh.scale, vector([1.0; 3]));
        let corners: Vec<_> = mesh
            .points
            .iter()
            .map(|p| Vector3::new(p.x, p.y, p.z))
            .collect();
        let faces = corners.chunks(3);
        let volume: f64 = faces
            .map(|face| face[0].dot(&face[1].cross(&face[2])) / 6.0)
            .sum();
        assert!(
            (volume - 200.0 * 400.0 * 600.0).abs() < 1e-6 * volume,
            "{volume}"
        );
        // m/5 (b² + c²) with m = 5 kg, in km: b² + c² = 0.05, c² + a² = 0.06, a² + b² = 0.08.
        let Scale { x, y, z } = ellipsoid.scale;
        let mut halves = [x, y, z].map(|diameter| diameter / 2e3);
        halves.sort_by(f64::total_cmp);
        for (half, squared) in halves.into_iter().zip([0.015_f64, 0.035, 0.045]) {
            assert!((half - squared.sqrt()).abs() < 1e-12, "{halves:?}");
        }
        assert_eq!(attractor.scale, vector([1000.0; 3]));
        assert_eq!(attractor.pose.position.z, 5000.0);
    }
}
