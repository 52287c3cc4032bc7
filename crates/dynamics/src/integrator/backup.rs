use crate::BodyState;
pub(super) struct Backup(Vec<BodyState>);
impl Backup {
    pub(super) fn of(states: &[BodyState]) -> Self {
        Self(states.to_vec())
    }
    #[inline(always)]
    pub(super) fn copy(&mut self, states: &[BodyState]) {
        for (begun, state) in self.0.iter_mut().zip(states) {
            begun.position = state.position;
            begun.linear_momentum = state.linear_momentum;
            begun.attitude = state.attitude;
            begun.angular_momentum = state.angular_momentum;
        }
    }
    #[cold]
    pub(super) fn restore(&self, states: &mut [BodyState]) {
        states.copy_from_slice(&self.0);
    }
}
