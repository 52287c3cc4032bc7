use lgvi_dynamics::BodyState;
use nalgebra::Vector3;

use super::{ROUNDING, Units};
use crate::problem::Vector12;
use crate::{Actuation, Transfer};

impl Units {
    /// The rounding error of `[δx, δγ, ζ, δΠ]` at the end, in these units.
    ///
    /// The moment of gravity is the small difference of the large moments of the body's points. Their rounding error
    /// may far exceed that of the angular momentum itself. Actuators that are fixed to the body turn it when their forces
    /// correct the rounding error of the position within a step.
    pub(super) fn rounding(&self, transfer: &Transfer) -> Vector12 {
        let Transfer {
            body,
            field,
            h,
            intervals,
            initial,
            ..
        } = transfer;
        let mut end = BodyState {
            position: transfer.place(),
            ..*initial
        };
        transfer.terminal.aim(&mut end);
        let pull = |x: &Vector3<f64>| field.load(body, x, &initial.attitude).force.norm();
        let force = pull(&transfer.place()).max(pull(&end.position));
        let arms = body.points().iter().map(|point| point.position.norm());
        let arm = arms.fold(0.0, f64::max);
        let duration = h * *intervals as f64;

        let momentum = self.linear_momentum + h * force;
        let position = self.length + duration / body.mass() * momentum;
        let compliance = body.inertia().inverse().norm();
        let correction = lever(&transfer.actuation) * body.mass() / h * position;
        let spin = self.angular_momentum + h * arm * force + correction;
        let attitude = 1.0 + compliance * (duration * (spin - correction) + h * correction);
        let sizes = [position, momentum, attitude, spin];
        let all = Vector12::from_fn(|row, _| ROUNDING * sizes[row / 3]);
        all.component_div(&self.variations())
    }
}

/// The largest lever of actuators that are fixed to the body and exert a force; 0 if the actuators are not fixed to it.
fn lever(actuation: &Actuation) -> f64 {
    if !actuation.is_fixed_to_body() {
        return 0.0;
    }
    let columns = actuation.matrix().column_iter();
    let levers = columns.filter_map(|column| {
        let [force, moment] = [0, 3].map(|first| column.fixed_rows::<3>(first).norm());
        (force > 0.0).then(|| moment / force)
    });
    levers.fold(0.0, f64::max)
}
