use nalgebra::Matrix3;

/// A square matrix or its triangular factors, computed in place by Gaussian elimination with partial pivoting.
pub(super) struct Elimination {
    size: usize,
    /// Entries in column-major order.
    entries: Vec<f64>,
    pivots: Vec<usize>,
}

impl Elimination {
    pub(super) fn new(size: usize) -> Self {
        Self {
            size,
            entries: vec![0.0; size * size],
            pivots: vec![0; size],
        }
    }

    /// The entries of the matrix to be factored, in column-major order.
    pub(super) fn entries(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// Adds a 3×3 block to the matrix, at the given block row and column.
    #[inline]
    pub(super) fn add_block(&mut self, row: usize, column: usize, block: &Matrix3<f64>) {
        for (index, part) in block.as_slice().chunks_exact(3).enumerate() {
            let first = (3 * column + index) * self.size + 3 * row;
            for (entry, part) in self.entries[first..first + 3].iter_mut().zip(part) {
                *entry += part;
            }
        }
    }

    /// Replaces the matrix by its factors. If the matrix is singular, the factors are not finite.
    pub(super) fn factor(&mut self) {
        let n = self.size;
        for k in 0..n {
            let column = &self.entries[k * n..(k + 1) * n];
            let mut pivot = k;
            for row in k + 1..n {
                if column[row].abs() > column[pivot].abs() {
                    pivot = row;
                }
            }
            self.pivots[k] = pivot;
            if pivot != k {
                for column in self.entries.chunks_exact_mut(n) {
                    column.swap(k, pivot);
                }
            }
            let (left, right) = self.entries.split_at_mut((k + 1) * n);
            let (upper, lower) = left[k * n..].split_at_mut(k + 1);
            let reciprocal = upper[k].recip();
            lower.iter_mut().for_each(|entry| *entry *= reciprocal);
            for column in right.chunks_exact_mut(n) {
                let (above, below) = column.split_at_mut(k + 1);
                subtract(below, above[k], lower);
            }
        }
    }

    /// Replaces `b` by the solution of `A x = b`. Must be called after [`Elimination::factor`].
    pub(super) fn solve(&self, b: &mut [f64]) {
        for (row, &pivot) in self.pivots.iter().enumerate() {
            b.swap(row, pivot);
        }
        let columns = || self.entries.chunks_exact(self.size.max(1)).enumerate();
        for (k, column) in columns() {
            let (above, below) = b.split_at_mut(k + 1);
            subtract(below, above[k], &column[k + 1..]);
        }
        for (k, column) in columns().rev() {
            b[k] /= column[k];
            let (above, below) = b.split_at_mut(k);
            subtract(above, below[0], &column[..k]);
        }
    }
}

/// `a ← a − factor × b`.
#[inline]
fn subtract(a: &mut [f64], factor: f64, b: &[f64]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a -= factor * b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solutions_satisfy_their_equations() {
        let mut rng = fastrand::Rng::with_seed(11);
        for size in [1, 2, 7, 30] {
            let matrix: Vec<f64> = (0..size * size).map(|_| rng.f64() - 0.5).collect();
            let expected: Vec<f64> = (0..size).map(|_| rng.f64() - 0.5).collect();
            let mut b = vec![0.0; size];
            for (column, x) in matrix.chunks(size).zip(&expected) {
                subtract(&mut b, -x, column);
            }
            let mut elimination = Elimination::new(size);
            elimination.entries().copy_from_slice(&matrix);
            elimination.factor();
            elimination.solve(&mut b);
            for (found, expected) in b.iter().zip(&expected) {
                assert!((found - expected).abs() < 1e-11, "size {size}");
            }
        }
    }
}
