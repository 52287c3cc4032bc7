use crate::BodyState;

/// Copies of the states where a step began, to return to.
pub(super) struct Backup(Vec<BodyState>);

impl Backup {
    /// Of `states`.
    pub(super) fn of(states: &[BodyState]) -> Self {
        Self(states.to_vec())
    }

    /// Copies as many states.
    #[inline(always)]
    pub(super) fn copy(&mut self, states: &[BodyState]) {
        for (begun, state) in self.0.iter_mut().zip(states) {
            // Field by field the copy is inlined.
            begun.position = state.position;
            begun.linear_momentum = state.linear_momentum;
            begun.attitude = state.attitude;
            begun.angular_momentum = state.angular_momentum;
        }
    }

    /// Makes `states` what they were.
    #[cold]
    pub(super) fn restore(&self, states: &mut [BodyState]) {
        for (state, begun) in states.iter_mut().zip(&self.0) {
            *state = *begun;
        }
    }
}
