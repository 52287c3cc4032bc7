use nalgebra::Vector3;

use super::{ROUNDING, Units};
use crate::Transfer;
use crate::problem::Vector12;

impl Units {
    /// The rounding error of `[δx, δγ, ζ, δΠ]` at the end, in these units.
    ///
    /// The moment of gravity is the small difference of the large moments of the body's points. Their rounding error
    /// may far exceed that of the angular momentum itself.
    pub(super) fn rounding(&self, transfer: &Transfer) -> Vector12 {
        let Transfer {
            body,
            field,
            h,
            intervals,
            initial,
            ..
        } = transfer;
        let mut end = *initial;
        transfer.terminal.aim(&mut end);
        let pull = |x: &Vector3<f64>| field.load(body, x, &initial.attitude).force.norm();
        let force = pull(&initial.position).max(pull(&end.position));
        let arms = body.points().iter().map(|point| point.position.norm());
        let arm = arms.fold(0.0, f64::max);
        let duration = h * *intervals as f64;

        let momentum = self.linear_momentum + h * force;
        let position = self.length + duration / body.mass() * momentum;
        let spin = self.angular_momentum + h * arm * force;
        let attitude = 1.0 + duration * body.inertia().inverse().norm() * spin;
        let sizes = [position, momentum, attitude, spin];
        let all = Vector12::from_fn(|row, _| ROUNDING * sizes[row / 3]);
        all.component_div(&self.variations())
    }
}
