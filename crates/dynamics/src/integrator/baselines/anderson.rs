use crate::integrator::flow::Components;

/// Number of differences kept.
const DEPTH: usize = 8;

/// Anderson acceleration of a fixed-point iteration `z ← g(z)` (D. G. Anderson, *Iterative procedures for nonlinear
/// integral equations*, J. ACM 12 (1965) 547–560).
///
/// The next iterate is the combination of the previous ones whose residual `g(z) − z` would be smallest if g were
/// linear. It solves a linear problem of n unknowns in n + 1 iterations, even if g is not a contraction.
pub(super) struct Anderson {
    bodies: usize,
    /// Ring buffers of the differences of residuals and of the corresponding values of g.
    residuals: Vec<Components>,
    values: Vec<Components>,
    last_residual: Vec<Components>,
    last_value: Vec<Components>,
    basis: Vec<Components>,
    iterations: usize,
}

impl Anderson {
    pub(super) fn new(bodies: usize) -> Self {
        let zeros = |count: usize| vec![[0.0; 18]; count * bodies];
        Self {
            bodies,
            residuals: zeros(DEPTH),
            values: zeros(DEPTH),
            last_residual: zeros(1),
            last_value: zeros(1),
            basis: zeros(DEPTH),
            iterations: 0,
        }
    }

    /// Discards the previous iterates.
    pub(super) fn start(&mut self) {
        self.iterations = 0;
    }

    /// Sets `z` to the next iterate, given `value` = g(z). Residuals are scaled by `weights`.
    pub(super) fn next(
        &mut self,
        z: &mut [Components],
        value: &[Components],
        weights: &[Components],
    ) {
        let n = self.bodies;
        if self.iterations > 0 {
            let slot = (self.iterations - 1) % DEPTH * n;
            for b in 0..n {
                for i in 0..18 {
                    let residual = (value[b][i] - z[b][i]) * weights[b][i];
                    self.residuals[slot + b][i] = residual - self.last_residual[b][i];
                    self.values[slot + b][i] = value[b][i] - self.last_value[b][i];
                }
            }
        }
        for b in 0..n {
            for i in 0..18 {
                self.last_residual[b][i] = (value[b][i] - z[b][i]) * weights[b][i];
            }
        }
        self.last_value.copy_from_slice(value);
        z.copy_from_slice(value);
        let known = self.iterations.min(DEPTH);
        self.iterations += 1;
        self.combine(z, known);
    }

    /// Subtracts the differences of values from `z`, with least-squares coefficients computed by Gram–Schmidt
    /// orthogonalization.
    fn combine(&mut self, z: &mut [Components], known: usize) {
        let n = self.bodies;
        let mut triangle = [[0.0; DEPTH]; DEPTH];
        let mut right = [0.0; DEPTH];
        let mut used = [0; DEPTH];
        let mut rank = 0;
        // The latest differences come first. Older ones that depend on them are omitted.
        for age in 0..known {
            let slot = (self.iterations - 2 - age) % DEPTH;
            let (done, rest) = self.basis.split_at_mut(rank * n);
            let column = &mut rest[..n];
            column.copy_from_slice(&self.residuals[slot * n..][..n]);
            let length = dot(column, column).sqrt();
            for (index, unit) in done.chunks(n).enumerate() {
                let along = dot(unit, column);
                triangle[index][rank] = along;
                subtract(column, along, unit);
            }
            let left = dot(column, column).sqrt();
            if left > 1e-8 * length {
                for c in column.iter_mut().flatten() {
                    *c /= left;
                }
                triangle[rank][rank] = left;
                right[rank] = dot(column, &self.last_residual);
                used[rank] = slot;
                rank += 1;
            }
        }
        for index in (0..rank).rev() {
            let known: f64 = (index + 1..rank)
                .map(|j| triangle[index][j] * right[j])
                .sum();
            right[index] = (right[index] - known) / triangle[index][index];
            subtract(z, right[index], &self.values[used[index] * n..][..n]);
        }
    }
}

fn dot(a: &[Components], b: &[Components]) -> f64 {
    a.iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(a, b)| a * b)
        .sum()
}

fn subtract(from: &mut [Components], factor: f64, what: &[Components]) {
    for (from, what) in from.iter_mut().flatten().zip(what.iter().flatten()) {
        *from -= factor * what;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `g(z) = A z + b` with eigenvalues of A up to 4. The plain iteration diverges, the accelerated one converges in
    /// five iterations.
    #[test]
    fn a_linear_problem_of_four_unknowns_takes_five_iterations() {
        let g = |z: &Components| {
            let mut value = [0.0; 18];
            for i in 0..4 {
                let neighbor = if i > 0 { z[i - 1] } else { 0.0 };
                value[i] = (i as f64 - 2.5) * 1.5 * z[i] + 0.5 * neighbor + 1.0;
            }
            value
        };
        let mut anderson = Anderson::new(1);
        let mut z = [[0.0; 18]];
        let residual = |z: &Components| {
            let differences = g(z).into_iter().zip(z).map(|(g, z)| (g - z).abs());
            differences.fold(0.0, f64::max)
        };
        for _ in 0..4 {
            let value = [g(&z[0])];
            anderson.next(&mut z, &value, &[[1.0; 18]]);
            assert!(residual(&z[0]) > 1e-3);
        }
        let value = [g(&z[0])];
        anderson.next(&mut z, &value, &[[1.0; 18]]);
        assert!(residual(&z[0]) < 1e-13, "{:e}", residual(&z[0]));
    }
}
