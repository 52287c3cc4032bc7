//! The free rotations of several bodies, one per lane, by the formulas of [`FreeRotation`] with the same operations in
//! the same order.

mod angles;
mod asymmetric;
mod attitude;
mod axisymmetric;
mod elliptic;
mod polhode;
mod third;

use nalgebra::{Matrix3, Vector3};

use self::asymmetric::Asymmetric;
use self::axisymmetric::{Axisymmetric, spherical};
use super::{FreeRotation, Symmetry};
use crate::lane::{Lane, Matrix, Vector};
use crate::rotation::LaneQuaternion;

/// `2/(w² + |u|²)` of a quaternion of length 1.
const UNIT: f64 = 2.0;

/// The flows of one body in every lane.
pub(crate) struct FreeRotations<T> {
    symmetry: Symmetries<T>,
    /// The flow of each member.
    each: Vec<FreeRotation>,
}

enum Symmetries<T> {
    /// Three equal moments.
    Spherical { moment: T },
    /// Two equal moments, with this body axis as axis of symmetry.
    About(usize, Axisymmetric<T>),
    /// Two equal moments about any axis.
    Axisymmetric(Axisymmetric<T>),
    /// Three different moments.
    Asymmetric(Box<Asymmetric<T>>),
    /// The members differ in kind.
    Mixed,
}

/// The rotation and the momentum after a time.
#[derive(Clone, Copy)]
pub(crate) struct Turn<T> {
    pub(crate) rotation: LaneQuaternion<T>,
    /// `2/(w² + |u|²)` of the rotation.
    pub(crate) factor: T,
    pub(crate) momentum: Vector<T>,
    /// Mask whose bit k is set if this is the flow in lane k.
    pub(crate) lanes: u32,
}

impl<T: Lane> Turn<T> {
    #[inline(always)]
    fn of(rotation: LaneQuaternion<T>, momentum: Vector<T>) -> Self {
        Self {
            factor: rotation.factor(),
            rotation,
            momentum,
            lanes: u32::MAX,
        }
    }
}

impl<T: Lane> FreeRotations<T> {
    /// Collects the flow of each member.
    pub(crate) fn gather(token: T::Token, each: Vec<FreeRotation>) -> Self {
        Self {
            symmetry: Symmetries::of(token, &each),
            each,
        }
    }

    /// The flow in `lanes`. The lanes that it does not hold must be computed [one by one](Self::lane).
    #[inline(always)]
    pub(crate) fn flow(&self, pi: Vector<T>, t: f64, lanes: u32) -> Turn<T> {
        match &self.symmetry {
            Symmetries::About(0, body) => body.flow_about::<0>(pi, t, lanes),
            Symmetries::About(1, body) => body.flow_about::<1>(pi, t, lanes),
            Symmetries::About(_, body) => body.flow_about::<2>(pi, t, lanes),
            Symmetries::Asymmetric(body) => body.flow(pi, t, lanes),
            Symmetries::Axisymmetric(body) => body.flow(pi, t, lanes),
            Symmetries::Spherical { moment } => spherical(*moment, pi, t, lanes),
            Symmetries::Mixed => Turn {
                rotation: LaneQuaternion {
                    w: pi.x.constant(1.0),
                    u: pi,
                },
                factor: pi.x,
                momentum: pi,
                lanes: 0,
            },
        }
    }

    /// `R F(t)` and `Π(t)` in lane k.
    pub(crate) fn lane(
        &self,
        k: usize,
        r: &Matrix3<f64>,
        pi: &Vector3<f64>,
        t: f64,
    ) -> (Matrix3<f64>, Vector3<f64>) {
        let (mut attitude, mut momentum) = (*r, *pi);
        self.each[k].carry(r, pi, t, (&mut attitude, &mut momentum));
        (attitude, momentum)
    }
}

impl<T: Lane> Symmetries<T> {
    /// Lanes without a member hold a body at which nothing divides by zero.
    fn of(token: T::Token, each: &[FreeRotation]) -> Self {
        let one = T::splat(token, 1.0);
        let zero = Vector::splat(token, &Vector3::zeros());
        let none = Axisymmetric {
            axis: zero,
            precession_rate: one,
            spin_rate: one,
        };
        let mut all = match each.first().map(|first| &first.symmetry) {
            Some(Symmetry::Spherical { .. }) => Self::Spherical { moment: one },
            Some(Symmetry::Axisymmetric(first)) => match first.coordinate() {
                Some(axis) => Self::About(axis, none),
                None => Self::Axisymmetric(none),
            },
            Some(Symmetry::Asymmetric(_)) => {
                let axes = Matrix::splat(token, &Matrix3::identity());
                Self::Asymmetric(Box::new(Asymmetric::none(one, axes)))
            }
            None => Self::Mixed,
        };
        for (k, from) in each.iter().enumerate() {
            match (&mut all, &from.symmetry) {
                (Self::Spherical { moment }, Symmetry::Spherical { moment: from }) => {
                    moment.set_lane(k, *from);
                }
                (Self::About(axis, body), Symmetry::Axisymmetric(from))
                    if from.coordinate() == Some(*axis) =>
                {
                    body.set_lane(k, from);
                }
                (Self::Axisymmetric(body), Symmetry::Axisymmetric(from))
                    if from.coordinate().is_none() =>
                {
                    body.set_lane(k, from);
                }
                (Self::Asymmetric(body), Symmetry::Asymmetric(from)) => body.set_lane(k, from),
                _ => return Self::Mixed,
            }
        }
        all
    }
}
