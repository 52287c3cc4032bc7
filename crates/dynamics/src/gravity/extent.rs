use lgvi_lie::{hat, symmetric_eigen};
use nalgebra::{Matrix3, Vector3};

use super::remainder::Side;
use crate::{Inertia, MassDistribution, Mobility, PointMass, RigidBody};

/// Properties of a body's mass distribution that bound interactions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    mass: f64,
    /// Radius about the origin that contains all mass. It is 0 for a multipole, whose terms have their own bounds.
    pub(super) reach: f64,
    /// Mean square distance of the mass from the origin, or an equivalent bound for a multipole.
    spread: f64,
    /// Sum of the absolute eigenvalues of the second harmonic of a multipole.
    harmonic: f64,
    /// An upper bound of `Σ m |J⁻¹ S(ρ)| |ρ|`: the angular acceleration per gradient of the acceleration field.
    leverage: f64,
    /// Distance of the center of mass from the origin, which is due to rounding, and the same distance times `m |J⁻¹|`.
    offset: f64,
    arm: f64,
    /// True for a point mass at the origin.
    pub(super) is_point: bool,
    /// True if the center of mass is the origin, so that the body can be approximated by a point there.
    pub(super) is_centered: bool,
    is_given: bool,
}

impl Extent {
    /// Returns `None` if a multipole goes beyond second order.
    pub(super) fn of(body: &RigidBody) -> Option<Self> {
        let mut extent = Self {
            mass: body.attracted_mass(),
            reach: 0.0,
            spread: 0.0,
            harmonic: 0.0,
            leverage: 0.0,
            offset: 0.0,
            arm: 0.0,
            is_point: false,
            is_centered: *body.mobility() != Mobility::Pivoted,
            is_given: body.mobility().is_given(),
        };
        match body.distribution() {
            MassDistribution::Multipole(multipole) => {
                let eigenvalues = symmetric_eigen(multipole.second_harmonic()?)?.eigenvalues;
                extent.spread = eigenvalues.amax() / body.mass();
                extent.harmonic = eigenvalues.abs().sum();
                extent.leverage = eigenvalues.amax() * norm(body.inertia().inverse());
            }
            MassDistribution::Points(points) => extent.hold(points, body.inertia()),
            MassDistribution::Polyhedron(mass) => {
                extent.hold(mass.cloud(), body.inertia());
                extent.reach = extent.reach.max(mass.field().bounding_radius());
                // The cloud reproduces the second moments of the mass, but not `∫ |J⁻¹ S(ρ)| |ρ| dm`.
                extent.leverage = extent.mass * extent.spread * norm(body.inertia().inverse());
            }
        }
        Some(extent)
    }

    fn hold(&mut self, points: &[PointMass], inertia: &Inertia) {
        let mut first = Vector3::zeros();
        for point in points {
            first += point.mass * point.position;
            let squared = point.position.norm_squared();
            self.reach = self.reach.max(squared.sqrt());
            self.spread += point.mass.abs() * squared / self.mass;
            let turning = inertia.inverse() * hat(&point.position);
            self.leverage += point.mass.abs() * norm(&turning) * squared.sqrt();
        }
        self.offset = first.norm() / self.mass;
        self.arm = first.norm() * norm(inertia.inverse());
        self.is_point = points.len() == 1 && self.reach == 0.0;
    }

    /// The bounds for this body under the attraction of `other` with the gravitational constant `g`, or `None` if its
    /// motion is prescribed.
    pub(super) fn side(&self, other: &Self, g: f64) -> Option<Side> {
        let side = self.side_of([g * other.mass, g * other.harmonic], other.spread);
        side.map(|side| Side {
            offset: side.offset + other.offset,
            ..side
        })
    }

    /// The bounds for this body under a source with this `GM` and second harmonic.
    pub(super) fn side_of(&self, [strength, harmonic]: [f64; 2], spread: f64) -> Option<Side> {
        (!self.is_given).then_some(Side {
            strength: strength.abs(),
            harmonic: harmonic.abs(),
            own_harmonic: self.harmonic / self.mass,
            own: self.spread,
            other: spread,
            leverage: self.leverage,
            offset: self.offset,
            arm: self.arm,
        })
    }
}

/// The spectral norm.
fn norm(matrix: &Matrix3<f64>) -> f64 {
    symmetric_eigen(&(matrix * matrix.transpose()))
        .map_or(f64::INFINITY, |eigen| eigen.eigenvalues.amax().sqrt())
}
