//! Orthographic projection, and where to look from.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Vector2, Vector3};

/// A viewer at infinity, z upright or hanging down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Camera {
    right: Vector3<f64>,
    up: Vector3<f64>,
    /// From the scene to the viewer.
    towards: Vector3<f64>,
}

/// Azimuths of each quadrant and elevations that are tried [°]: none along an axis.
const AZIMUTHS: [f64; 11] = [
    20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 70.0,
];
const ELEVATIONS: [f64; 5] = [20.0, 25.0, 30.0, 35.0, 40.0];

/// How much it counts that a flown curve is on the near side.
const NEARNESS: f64 = 0.4;

impl Camera {
    /// Looks from this direction: azimuth from x towards y, elevation above the xy plane (rad).
    pub(super) fn new(azimuth: f64, elevation: f64) -> Self {
        let (sin_a, cos_a) = libm::sincos(azimuth);
        let (sin_e, cos_e) = libm::sincos(elevation);
        Self {
            right: Vector3::new(-sin_a, cos_a, 0.0),
            up: Vector3::new(-sin_e * cos_a, -sin_e * sin_a, cos_e),
            towards: Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e),
        }
    }

    /// The same view of a scene whose z axis points down.
    fn hanging(self) -> Self {
        let turned = |v: Vector3<f64>| Vector3::new(v.x, -v.y, -v.z);
        Self {
            right: turned(self.right),
            up: turned(self.up),
            towards: turned(self.towards),
        }
    }

    /// The directions in the scene that go to the right and up in the picture.
    pub(super) fn across(&self) -> [Vector3<f64>; 2] {
        [self.right, self.up]
    }

    /// Whether the z axis points down in the picture.
    pub(super) fn is_hanging(&self) -> bool {
        self.up.z < 0.0
    }

    /// Looks along `-direction`, which is not zero.
    pub(super) fn from(direction: &Vector3<f64>) -> Self {
        let across = libm::hypot(direction.x, direction.y);
        Self::new(
            libm::atan2(direction.y, direction.x),
            libm::atan2(direction.z, across),
        )
    }

    /// The direction in which as much as possible of `curves` is seen: none from its edge, and those in `flown` near.
    /// The z axis points up, or down where the scene is `hanging`.
    pub(super) fn facing(
        curves: &[Vec<Vector3<f64>>],
        flown: &[Vec<Vector3<f64>>],
        hanging: bool,
    ) -> Self {
        let turned = |camera: Self| if hanging { camera.hanging() } else { camera };
        let quadrants = (0..4).map(|quadrant| 90.0 * f64::from(quadrant));
        let azimuths =
            quadrants.flat_map(|start| AZIMUTHS.map(|azimuth| (start + azimuth) * PI / 180.0));
        let candidates = azimuths.flat_map(|azimuth| {
            ELEVATIONS.map(|elevation| turned(Self::new(azimuth, elevation * PI / 180.0)))
        });
        let score = |camera: &Self| {
            let open: f64 = curves
                .iter()
                .chain(flown)
                .map(|curve| camera.openness(curve))
                .sum();
            let near: f64 = flown.iter().map(|curve| camera.nearness(curve)).sum();
            let long: f64 = flown.iter().map(|curve| camera.breadth(curve)).sum();
            open + NEARNESS * near + long
        };
        candidates
            .map(|camera| (score(&camera), camera))
            .reduce(|best, next| if next.0 > best.0 + 1e-9 { next } else { best })
            .map_or_else(
                || turned(Self::new(-PI / 3.0, PI / 7.0)),
                |(_, camera)| camera,
            )
    }

    /// Right, up: in the units of the point.
    pub(super) fn project(&self, point: &Vector3<f64>) -> Vector2<f64> {
        Vector2::new(self.right.dot(point), self.up.dot(point))
    }

    /// Greater is nearer.
    pub(super) fn depth(&self, point: &Vector3<f64>) -> f64 {
        self.towards.dot(point)
    }

    /// Log of the area that a curve covers, relative to its extent: least where it is seen from its edge.
    fn openness(&self, curve: &[Vector3<f64>]) -> f64 {
        let count = curve.len().max(1) as f64;
        let center = curve.iter().sum::<Vector3<f64>>() / count;
        let mut spread = Matrix2::zeros();
        let mut extent = 0.0;
        for point in curve {
            let arm = point - center;
            let seen = self.project(&arm);
            spread += seen * seen.transpose();
            extent += arm.norm_squared();
        }
        if extent == 0.0 {
            return 0.0;
        }
        libm::log(spread.determinant().max(0.0) / (extent * extent) + 1e-5)
    }

    /// Log of how far a curve spreads across the line of sight, relative to its extent.
    fn breadth(&self, curve: &[Vector3<f64>]) -> f64 {
        let center = curve.iter().sum::<Vector3<f64>>() / curve.len().max(1) as f64;
        let arms = || curve.iter().map(|point| point - center);
        let extent: f64 = arms().map(|arm| arm.norm_squared()).sum();
        if extent == 0.0 {
            return 0.0;
        }
        let seen: f64 = arms().map(|arm| self.project(&arm).norm_squared()).sum();
        libm::log(seen / extent + 1e-5)
    }

    /// Mean depth of a curve as seen from the origin, relative to its extent.
    fn nearness(&self, curve: &[Vector3<f64>]) -> f64 {
        let extent: f64 = curve.iter().map(Vector3::norm).sum();
        if extent == 0.0 {
            return 0.0;
        }
        curve.iter().map(|point| self.depth(point)).sum::<f64>() / extent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_keeps_lengths_across_the_line_of_sight_and_loses_those_along_it() {
        let camera = Camera::new(0.7, 0.4);
        let axes = [camera.right, camera.up, camera.towards];
        let frame = nalgebra::Matrix3::from_columns(&axes);
        assert!((frame.transpose() * frame - nalgebra::Matrix3::identity()).norm() < 1e-15);
        assert!((frame.determinant() - 1.0).abs() < 1e-15, "not mirrored");
        assert!(camera.project(&camera.towards).norm() < 1e-15);
        assert!(
            camera.depth(&camera.towards) > 0.0,
            "what is nearer has more depth"
        );

        let front = Camera::new(-PI / 2.0, 0.0);
        assert!((front.project(&Vector3::x()) - Vector2::x()).norm() < 1e-15);
        assert!((front.project(&Vector3::z()) - Vector2::y()).norm() < 1e-15);
        let above = Camera::new(-PI / 2.0, PI / 2.0);
        assert!((above.project(&Vector3::y()) - Vector2::y()).norm() < 1e-15);

        let direction = Vector3::new(-0.3, 0.5, -0.7).normalize();
        assert!((Camera::from(&direction).towards - direction).norm() < 1e-15);
    }

    #[test]
    fn no_plane_is_seen_from_its_edge_and_the_flight_is_in_front() {
        let circle = |u: Vector3<f64>, v: Vector3<f64>| -> Vec<_> {
            let angles = (0..72).map(|k| libm::sincos(f64::from(k) * PI / 36.0));
            angles.map(|(sin, cos)| cos * u + sin * v).collect()
        };
        let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
        let orbits = [circle(x, y), circle(y, z)];
        let flown = [vec![y, (y + z).normalize(), z]];
        let camera = Camera::facing(&orbits, &flown, false);
        assert!(camera.towards.z > 0.25, "{camera:?}");
        assert!(camera.towards.x.abs() > 0.4, "{camera:?}");
        assert!(camera.depth(&flown[0][1]) > 0.0, "{camera:?}");

        let hanging = Camera::facing(&orbits, &flown, true);
        assert!(hanging.is_hanging() && !camera.is_hanging());
        assert!(hanging.project(&z).y < 0.0 && hanging.depth(&z) < 0.0);
        let frame = nalgebra::Matrix3::from_columns(&[hanging.right, hanging.up, hanging.towards]);
        assert!((frame.determinant() - 1.0).abs() < 1e-15, "not mirrored");
    }
}
