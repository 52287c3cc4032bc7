use super::super::flow::Components;
use super::super::scale::Scale;
use super::super::stages::Stages;
use super::super::tableau::Pair;
use crate::RigidBody;

/// The error norm: the root mean square over all moving components, each scaled by its [`Scale`].
pub(super) struct Norm {
    scales: Vec<Scale>,
    /// Number of moving components.
    moving: f64,
}

impl Norm {
    pub(super) fn new(bodies: &[RigidBody]) -> Self {
        let scales: Vec<_> = bodies.iter().map(Scale::new).collect();
        Self {
            moving: scales.iter().map(Scale::moving).sum(),
            scales,
        }
    }

    /// The scales, one per body.
    pub(super) fn scales(&self) -> &[Scale] {
        &self.scales
    }

    /// The estimated error of a step from `y` to `end`, divided by the step size. `time` is the time scale for momenta.
    /// It is `e₅² / √(n (e₅² + e₃²/100))` with the sums of squares of both estimates (Hairer, Nørsett, Wanner, §II.10).
    pub(super) fn error_rate(
        &self,
        pair: &Pair,
        stages: &Stages,
        [y, end]: [&[Components]; 2],
        time: f64,
    ) -> f64 {
        let (mut fine, mut coarse) = (0.0, 0.0);
        let mut sum = [0.0; 18];
        for (index, scale) in self.scales.iter().enumerate() {
            let inverse = scale.inverse(&y[index], &end[index], time);
            let mut squares = |row| {
                stages.sum(index, row, &mut sum);
                sum_of_squares(&sum, &inverse)
            };
            fine += squares(pair.error);
            coarse += squares(pair.damping);
        }
        if fine == 0.0 {
            return 0.0;
        }
        fine / (self.moving * (fine + 0.01 * coarse)).sqrt()
    }
}

/// `Σ (a_i b_i)²`, accumulated in six parallel sums.
#[inline]
fn sum_of_squares(a: &Components, b: &Components) -> f64 {
    let mut sums = [0.0; 6];
    for (a, b) in a.chunks_exact(6).zip(b.chunks_exact(6)) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += (a * b) * (a * b);
        }
    }
    (sums[0] + sums[3]) + (sums[1] + sums[4]) + (sums[2] + sums[5])
}
