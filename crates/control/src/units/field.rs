use std::sync::Arc;

use lgvi_dynamics::gravity::{Field, Intrusion, LoadCurvature, LoadGradient};
use lgvi_dynamics::{Load, RigidBody};
use nalgebra::{Matrix3, Vector3};

use super::Units;

/// A field in other units.
///
/// It always acts on the body that it was made for, whatever body is passed: bodies with modified inertia feel the same
/// loads.
#[derive(Clone)]
pub(crate) struct Rescaled {
    field: Arc<dyn Field>,
    body: RigidBody,
    length: f64,
    /// The reciprocals of the units of force and moment.
    force: f64,
    moment: f64,
}

impl Rescaled {
    pub(super) fn new(field: &Arc<dyn Field>, body: &RigidBody, units: &Units) -> Self {
        Self {
            field: Arc::clone(field),
            body: body.clone(),
            length: units.length,
            force: units.force().recip(),
            moment: units.moment().recip(),
        }
    }

    fn place(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.length * x
    }
}

impl Field for Rescaled {
    fn load(&self, _: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> Load {
        let load = self.field.load(&self.body, &self.place(x), r);
        Load {
            force: self.force * load.force,
            moment: self.moment * load.moment,
        }
    }

    fn potential(&self, _: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> f64 {
        let energy = self.force / self.length;
        energy * self.field.potential(&self.body, &self.place(x), r)
    }

    fn gradient(&self, _: &RigidBody, x: &Vector3<f64>, r: &Matrix3<f64>) -> LoadGradient {
        let g = self.field.gradient(&self.body, &self.place(x), r);
        LoadGradient {
            force_by_position: self.force * self.length * g.force_by_position,
            force_by_attitude: self.force * g.force_by_attitude,
            moment_by_position: self.moment * self.length * g.moment_by_position,
            moment_by_attitude: self.moment * g.moment_by_attitude,
        }
    }

    fn curvature(
        &self,
        _: &RigidBody,
        x: &Vector3<f64>,
        r: &Matrix3<f64>,
        weights: &Load,
    ) -> LoadCurvature {
        let weights = Load {
            force: self.force * weights.force,
            moment: self.moment * weights.moment,
        };
        let k = self
            .field
            .curvature(&self.body, &self.place(x), r, &weights);
        LoadCurvature {
            position_position: self.length * self.length * k.position_position,
            position_attitude: self.length * k.position_attitude,
            attitude_attitude: k.attitude_attitude,
        }
    }

    fn check_clearance(&self, _: &RigidBody, x: &Vector3<f64>) -> Result<(), Intrusion> {
        let found = self.field.check_clearance(&self.body, &self.place(x));
        found.map_err(|Intrusion { distance, limit }| Intrusion {
            distance: distance / self.length,
            limit: limit / self.length,
        })
    }
}
