use nalgebra::Vector3;

use crate::Inertia;
use crate::rotation::{Chart, RelativeRotation, Unsolvable};

/// Solves a body's implicit equation step after step, each from a guess extrapolated from the last three solutions.
#[derive(Clone, Debug, Default)]
pub(super) struct Turn {
    last: [Vector3<f64>; 3],
    known: usize,
}

impl Turn {
    /// Forgets the solutions so far.
    pub(super) fn forget(&mut self) {
        self.known = 0;
    }

    /// Solves `F J_d − J_d Fᵀ = S(g)`.
    pub(super) fn solve(
        &self,
        chart: Chart,
        inertia: &Inertia,
        g: &Vector3<f64>,
    ) -> Result<RelativeRotation, Unsolvable> {
        let [a, b, c] = &self.last;
        let guess = match self.known {
            0 | 1 => None,
            2 => Some(2.0 * a - b),
            _ => Some(3.0 * (a - b) + c),
        };
        chart.solve(inertia, g, guess.as_ref())
    }

    /// Remembers the solution of an accepted step.
    pub(super) fn remember(&mut self, cayley: Vector3<f64>) {
        self.last = [cayley, self.last[0], self.last[1]];
        self.known = (self.known + 1).min(3);
    }
}
