use crate::{BodyState, RigidBody};

/// How errors are measured: positions relative to the size of the scene, attitudes in radians; the greatest over all
/// bodies.
///
/// The size of the scene is the greatest distance, at the start, of two bodies or of a body from the origin, and at
/// least the greatest radius of gyration. The error of an attitude is `‖R − R̂‖_F / √2`, the angle between them where
/// that is small.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Accuracy {
    /// Size of the scene.
    pub length: f64,
}

impl Accuracy {
    /// The measure for a scene of `bodies` that starts in `states`.
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

    /// The error of `states`, given the true ones; infinite where it is not a number.
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
