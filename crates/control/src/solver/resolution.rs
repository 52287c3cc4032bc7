//! Variants of a transfer at another resolution or with another body, for intermediate steps of the solver.

use lgvi_dynamics::{Inertia, MassDistribution, RigidBody};
use lgvi_lie::symmetric_eigen;
use nalgebra::{Matrix3, Vector3};

use crate::Transfer;

/// The transfer in `intervals` steps over the same time.
pub(super) fn resolved(transfer: &Transfer, intervals: usize) -> Transfer {
    Transfer {
        h: transfer.h * (transfer.intervals as f64 / intervals as f64),
        intervals,
        ..transfer.clone()
    }
}

/// `body` with principal moments of inertia of at least `least` times the greatest, or `None` if that body is invalid.
pub(super) fn with_least_ratio(body: &RigidBody, least: f64) -> Option<RigidBody> {
    let eigen = symmetric_eigen(body.inertia().matrix())?;
    let floor = least * eigen.eigenvalues.max();
    let moments = eigen.eigenvalues.map(|moment| moment.max(floor));
    let axes = eigen.eigenvectors;
    let matrix = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
    let inertia = Inertia::new(0.5 * (matrix + matrix.transpose())).ok()?;
    let with = match body.distribution() {
        MassDistribution::Multipole(own) => RigidBody::with_multipole(inertia, own.clone()),
        _ => RigidBody::new(body.mass(), inertia, body.points().to_vec()),
    };
    let with = with.ok()?;
    Some(match body.drag() {
        Some(drag) => with.with_drag(drag.clone()),
        None => with,
    })
}

/// The ratio of the least principal moment of inertia to the greatest.
pub(super) fn slenderness(body: &RigidBody) -> f64 {
    let moments = Vector3::from(body.inertia().principal_moments());
    moments.min() / moments.max()
}
