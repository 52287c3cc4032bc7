//! The angle between a body axis and the direction to a point, with its derivatives by position and attitude.

use lgvi_dynamics::BodyState;
use lgvi_lie::hat;
use nalgebra::{Matrix3, Vector3};

use super::BySecond;
use crate::problem::pointing::Pointing;

/// The cosine `c = R a · u` with `u = (p − x)/r`, and the distance `r`.
///
/// By δx, the gradient of `c` is `−(q − c u)/r` with `q = R a`, and the Hessian `(3 c u uᵀ − u qᵀ − q uᵀ − c I)/r²`. The
/// mixed derivatives by δx and ζ are `(I − u uᵀ) R S(a)/r`. By ζ alone they are those of a [`Pointing`]. At the point
/// itself `c` is 0, and so are its derivatives.
pub(super) struct Sight<'s> {
    state: &'s BodyState,
    axis: Vector3<f64>,
    /// `u`
    pub(super) unit: Vector3<f64>,
    /// `r`
    pub(super) distance: f64,
    /// `c`
    pub(super) cosine: f64,
}

impl<'s> Sight<'s> {
    pub(super) fn new(state: &'s BodyState, axis: &Vector3<f64>, point: &Vector3<f64>) -> Self {
        let arm = point - state.position;
        let distance = arm.norm();
        let unit = if distance > 0.0 {
            arm / distance
        } else {
            Vector3::zeros()
        };
        Self {
            state,
            axis: *axis,
            unit,
            distance,
            cosine: (state.attitude * axis).dot(&unit),
        }
    }

    /// The gradient and the Hessian of the cosine by δx.
    pub(super) fn by_position(&self) -> (Vector3<f64>, Matrix3<f64>) {
        if self.distance == 0.0 {
            return (Vector3::zeros(), Matrix3::zeros());
        }
        let (u, c) = (&self.unit, self.cosine);
        let q = self.state.attitude * self.axis;
        let product = u * q.transpose();
        let hessian = 3.0 * c * u * u.transpose()
            - product
            - product.transpose()
            - Matrix3::from_diagonal_element(c);
        (
            (c * u - q) / self.distance,
            hessian / (self.distance * self.distance),
        )
    }

    /// The gradient and the Hessian of the distance by δx.
    pub(super) fn distance_by_position(&self) -> (Vector3<f64>, Matrix3<f64>) {
        if self.distance == 0.0 {
            return (Vector3::zeros(), Matrix3::zeros());
        }
        let across = Matrix3::identity() - self.unit * self.unit.transpose();
        (-self.unit, across / self.distance)
    }

    /// The derivatives of the cosine that involve the attitude.
    pub(super) fn by_attitude(&self) -> BySecond {
        let Self {
            state, axis, unit, ..
        } = self;
        let pointing = Pointing::new(&state.attitude, axis, unit);
        let mixed = if self.distance > 0.0 {
            let turned = state.attitude * hat(axis);
            (turned - unit * unit.tr_mul(&turned)) / self.distance
        } else {
            Matrix3::zeros()
        };
        BySecond {
            gradient: pointing.gradient,
            hessian: pointing.hessian,
            mixed,
        }
    }
}
