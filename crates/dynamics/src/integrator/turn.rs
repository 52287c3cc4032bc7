use nalgebra::Vector3;

/// The last six solutions of a body's implicit equation, newest first, from which the next is extrapolated.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Turn([Vector3<f64>; 6]);

impl Turn {
    /// The quintic through the solutions, one step on.
    #[inline]
    pub(super) fn guess(&self) -> Vector3<f64> {
        let [a, b, c, d, e, f] = &self.0;
        6.0 * (a + e) - 15.0 * (b + d) + 20.0 * c - f
    }

    /// With one solution more.
    #[inline]
    pub(super) fn then(&self, cayley: Vector3<f64>) -> Self {
        let [a, b, c, d, e, _] = self.0;
        Self([cayley, a, b, c, d, e])
    }

    /// As if all had been like the newest.
    pub(super) fn steady(&self) -> Self {
        Self([self.0[0]; 6])
    }
}
