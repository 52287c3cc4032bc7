use lgvi_lie::to_quaternion;
use lgvi_msgs::geometry_msgs::{Point, Quaternion, Vector3 as Scale};
use lgvi_msgs::std_msgs::{ColorRGBA, Header};
use lgvi_msgs::visualization_msgs::{Marker, MarkerArray};
use nalgebra::{Matrix3, Vector3};

/// What is drawn in which color: red, green, blue, opacity.
pub(super) mod color {
    pub(crate) const PATH: [f32; 4] = [0.34, 0.71, 0.91, 1.0];
    pub(crate) const THRUST: [f32; 4] = [0.90, 0.62, 0.00, 1.0];
    pub(crate) const TARGET: [f32; 4] = [0.94, 0.89, 0.26, 1.0];
    pub(crate) const FORBIDDEN: [f32; 4] = [0.84, 0.20, 0.15, 0.3];
    pub(crate) const ALLOWED: [f32; 4] = [0.00, 0.62, 0.45, 0.2];
    pub(crate) const AXES: [[f32; 4]; 3] = [
        [1.0, 0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0, 1.0],
        [0.0, 0.0, 1.0, 1.0],
    ];
}

/// Markers in one frame, of what is given in the scene's unit of length.
pub(super) struct Drawing {
    header: Header,
    /// The unit (m).
    length: f64,
    /// Width of lines (m).
    line: f64,
    /// What is added to all ids.
    pub(super) first_id: i32,
    markers: Vec<Marker>,
}

impl Drawing {
    /// One that takes the place of those before it, with lines so wide in a unit of length `length` (m).
    pub(super) fn new(header: Header, length: f64, line: f64) -> Self {
        let clean = Marker {
            header: header.clone(),
            action: Marker::DELETEALL,
            ..Marker::default()
        };
        Self {
            header,
            length,
            line: line * length,
            first_id: 0,
            markers: vec![clean],
        }
    }

    pub(super) fn finish(self) -> MarkerArray {
        MarkerArray {
            markers: self.markers,
        }
    }

    /// A line through points.
    pub(super) fn strip(
        &mut self,
        ns: &str,
        id: i32,
        points: impl IntoIterator<Item = Vector3<f64>>,
        color: [f32; 4],
    ) {
        self.markers.push(Marker {
            r#type: Marker::LINE_STRIP,
            scale: scale([self.line, 0.0, 0.0]),
            points: points.into_iter().map(|p| self.point(p)).collect(),
            ..self.marker(ns, id, color)
        });
    }

    /// An arrow, thicker than a line.
    pub(super) fn arrow(&mut self, ns: &str, id: i32, ends: [Vector3<f64>; 2], color: [f32; 4]) {
        self.markers.push(Marker {
            r#type: Marker::ARROW,
            // Diameters of shaft and head; the head's length follows from them.
            scale: scale([2.0 * self.line, 4.0 * self.line, 0.0]),
            points: ends.map(|p| self.point(p)).into(),
            ..self.marker(ns, id, color)
        });
    }

    /// Three axes, the columns of a matrix, in the colors of x, y and z.
    pub(super) fn axes(&mut self, ns: &str, id: i32, origin: Vector3<f64>, axes: Matrix3<f64>) {
        let ends = axes.column_iter().flat_map(|axis| [origin, origin + axis]);
        let colors = color::AXES
            .iter()
            .flat_map(|color| [rgba(*color), rgba(*color)]);
        self.markers.push(Marker {
            r#type: Marker::LINE_LIST,
            scale: scale([2.0 * self.line, 0.0, 0.0]),
            points: ends.map(|p| self.point(p)).collect(),
            colors: colors.collect(),
            ..self.marker(ns, id, color::AXES[0])
        });
    }

    /// An ellipsoid whose semi-axes are along the columns of `axes`.
    pub(super) fn ellipsoid(
        &mut self,
        ns: &str,
        id: i32,
        center: Vector3<f64>,
        semi_axes: Vector3<f64>,
        axes: &Matrix3<f64>,
        color: [f32; 4],
    ) {
        let mut marker = Marker {
            r#type: Marker::SPHERE,
            scale: scale((2.0 * semi_axes * self.length).into()),
            ..self.marker(ns, id, color)
        };
        marker.pose.position = self.point(center);
        let (w, u) = to_quaternion(axes);
        let [x, y, z] = u.into();
        marker.pose.orientation = Quaternion { x, y, z, w };
        self.markers.push(marker);
    }

    /// Each three points a triangle.
    pub(super) fn triangles(
        &mut self,
        ns: &str,
        id: i32,
        corners: Vec<Vector3<f64>>,
        color: [f32; 4],
    ) {
        self.markers.push(Marker {
            r#type: Marker::TRIANGLE_LIST,
            scale: scale([1.0; 3]),
            points: corners.into_iter().map(|p| self.point(p)).collect(),
            ..self.marker(ns, id, color)
        });
    }

    fn marker(&self, ns: &str, id: i32, color: [f32; 4]) -> Marker {
        Marker {
            header: self.header.clone(),
            ns: ns.into(),
            id: self.first_id + id,
            color: rgba(color),
            ..Marker::default()
        }
    }

    fn point(&self, p: Vector3<f64>) -> Point {
        let [x, y, z] = (p * self.length).into();
        Point { x, y, z }
    }
}

fn scale([x, y, z]: [f64; 3]) -> Scale {
    Scale { x, y, z }
}

fn rgba([r, g, b, a]: [f32; 4]) -> ColorRGBA {
    ColorRGBA { r, g, b, a }
}
