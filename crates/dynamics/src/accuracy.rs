use crate::{BodyState, RigidBody};

/// The error measure for states: positions relative to the size of the scene, attitudes in radians. The error is the
/// maximum over all bodies.
///
/// The size of the scene is the largest initial distance between two bodies or between a body and the origin, and at
/// least the largest radius of gyration. The attitude error is `‖R − R̂‖_F / √2`, which is the angle between the
/// attitudes if it is small.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// Size of the scene.
    pub length: f64,
}

impl Accuracy {
    /// Creates the measure for a scene of `bodies` with the initial `states`.
    pub fn new(bodies: &[RigidBody], states: &[BodyState]) -> Self {
        let gyration =
            |body: &RigidBody| (0.5 * body.inertia().matrix().trace() / body.mass()).sqrt();
        let mut length = bodies.iter().map(gyration).fold(0.0, f64::max);
        for (index, state) in states.iter().enumerate() {
            length = length.max(state.position.norm());
            for other in &states[..index] {
                length = length.max((state.position - other.position).norm());
            }
        }
        Self { length }
    }

    /// The error of `states` relative to the true states `truth`, or infinity if it is not a number.
    pub fn error(&self, states: &[BodyState], truth: &[BodyState]) -> f64 {
        let each = |(a, b): (&BodyState, &BodyState)| {
            let position = (a.position - b.position).norm() / self.length;
            let attitude = (a.attitude - b.attitude).norm() * std::f64::consts::FRAC_1_SQRT_2;
            let greater = position + attitude - position.min(attitude);
            if greater.is_nan() {
                f64::INFINITY
            } else {
                greater
            }
        };
        states.iter().zip(truth).map(each).fold(0.0, f64::max)
    }
}
