use nalgebra::Matrix3;

/// A square matrix and, once factored, its triangular factors: Gaussian elimination with partial pivoting, in place.
pub(super) struct Elimination {
    size: usize,
    /// By rows.
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

    /// The entries of the matrix to be factored, by rows.
    pub(super) fn entries(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// In a matrix of blocks of 3×3, adds `c_λ B` to row κ from a `first` column onwards.
    pub(super) fn add_blocks(
        &mut self,
        kappa: usize,
        first: usize,
        coefficients: &[f64],
        block: &Matrix3<f64>,
    ) {
        let width = self.size;
        let rows = &mut self.entries[3 * kappa * width..3 * (kappa + 1) * width];
        for (row, entries) in rows.chunks_exact_mut(width).enumerate() {
            let [x, y, z] = [block[(row, 0)], block[(row, 1)], block[(row, 2)]];
            for (entries, c) in entries.chunks_exact_mut(3).skip(first).zip(coefficients) {
                entries[0] += c * x;
                entries[1] += c * y;
                entries[2] += c * z;
            }
        }
    }

    /// Replaces the matrix by its factors. A singular matrix has factors that are not finite.
    pub(super) fn factor(&mut self) {
        let n = self.size;
        for column in 0..n {
            let mut pivot = column;
            for row in column + 1..n {
                if self.entries[row * n + column].abs() > self.entries[pivot * n + column].abs() {
                    pivot = row;
                }
            }
            self.pivots[column] = pivot;
            if pivot != column {
                for k in 0..n {
                    self.entries.swap(column * n + k, pivot * n + k);
                }
            }
            let (upper, lower) = self.entries.split_at_mut((column + 1) * n);
            let above = &upper[column * n..];
            let reciprocal = above[column].recip();
            for row in lower.chunks_exact_mut(n) {
                let factor = row[column] * reciprocal;
                row[column] = factor;
                for (entry, top) in row[column + 1..].iter_mut().zip(&above[column + 1..]) {
                    *entry -= factor * top;
                }
            }
        }
    }

    /// Replaces `b` by the solution of `A x = b`, after [`Elimination::factor`].
    pub(super) fn solve(&self, b: &mut [f64]) {
        let n = self.size;
        for (row, &pivot) in self.pivots.iter().enumerate() {
            b.swap(row, pivot);
        }
        for row in 0..n {
            let known: f64 = dot(&self.entries[row * n..row * n + row], &b[..row]);
            b[row] -= known;
        }
        for row in (0..n).rev() {
            let line = &self.entries[row * n..(row + 1) * n];
            let known = dot(&line[row + 1..], &b[row + 1..]);
            b[row] = (b[row] - known) / line[row];
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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
            let mut b: Vec<f64> = matrix.chunks(size).map(|row| dot(row, &expected)).collect();
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
