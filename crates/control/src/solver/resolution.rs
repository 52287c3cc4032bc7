//! The same transfer in other steps or with another body, for the solver's way there.

use lgvi_dynamics::gravity::{Field, Intrusion, LoadCurvature, LoadGradient};
use lgvi_dynamics::{Inertia, Load, MassDistribution, RigidBody};
use lgvi_lie::symmetric_eigen;
use nalgebra::{Matrix3, Vector3};

use crate::Transfer;

/// A field that is someone else's.
pub(super) struct Shared<'f, F>(&'f F);

impl<F: Field> Field for Shared<'_, F> {
    fn load(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> Load {
        self.0.load(body, x, r)
    }

    fn potential(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> f64 {
        self.0.potential(body, x, r)
    }

    fn gradient(&self, body: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> LoadGradient {
        self.0.gradient(body, x, r)
    }

    fn curvature(
        &self,
        body: &RigidBody,
        x: &Vector3<f64>,
        r: &Matrix3<f64>,
        weights: &Load,
    ) -> LoadCurvature {
        self.0.curvature(body, x, r, weights)
    }

    fn check_clearance(&self, body: &RigidBody, x: &Vector3<f64>) -> Result<(), Intrusion> {
        self.0.check_clearance(body, x)
    }
}

/// The same transfer in `intervals` steps over the same time.
pub(super) fn resolved<F>(transfer: &Transfer<F>, intervals: usize) -> Transfer<Shared<'_, F>> {
    Transfer {
        body: transfer.body.clone(),
        field: Shared(&transfer.field),
        h: transfer.h * (transfer.intervals as f64 / intervals as f64),
        intervals,
        initial: transfer.initial,
        target: transfer.target.clone(),
        actuation: transfer.actuation.clone(),
        dynamics: transfer.dynamics,
        motion: transfer.motion,
        terminal: transfer.terminal.clone(),
        inequalities: transfer.inequalities.clone(),
        rounding: transfer.rounding,
    }
}

/// `body` with no principal moment of inertia below `least` times the greatest; `None` where there is no such body.
pub(super) fn stouter(body: &RigidBody, least: f64) -> Option<RigidBody> {
    let eigen = symmetric_eigen(body.inertia().matrix())?;
    let floor = least * eigen.eigenvalues.max();
    let moments = eigen.eigenvalues.map(|moment| moment.max(floor));
    let axes = eigen.eigenvectors;
    let matrix = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
    let inertia = Inertia::new(0.5 * (matrix + matrix.transpose())).ok()?;
    match body.distribution() {
        MassDistribution::Multipole(own) => RigidBody::with_multipole(inertia, own.clone()),
        _ => RigidBody::new(body.mass(), inertia, body.points().to_vec()),
    }
    .ok()
}

/// The least principal moment of inertia by the greatest.
pub(super) fn slenderness(body: &RigidBody) -> f64 {
    let moments = Vector3::from(body.inertia().principal_moments());
    moments.min() / moments.max()
}
