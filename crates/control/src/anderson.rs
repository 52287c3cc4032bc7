//! Anderson's acceleration of a fixed-point iteration (1965; type II of Fang and Saad 2009).

/// Part of a difference that is left when those before are taken out of it, below which it tells nothing new.
const NEW: f64 = 1e-6;

/// Length of a step, in multiples of the residual, that is not exceeded.
const FARTHEST: f64 = 10.0;

/// The iteration `f ← F(f)`: without memory `f + θ (F(f) − f)`.
#[derive(Debug)]
pub(crate) struct Anderson {
    /// `θ`
    damping: f64,
    /// Number of earlier iterates that are taken into account.
    memory: usize,
    last: Option<[Vec<f64>; 2]>,
    /// Differences of successive iterates and of their residuals.
    differences: Vec<[Vec<f64>; 2]>,
}

impl Anderson {
    pub(crate) fn new(damping: f64, memory: usize) -> Self {
        Self {
            damping,
            memory,
            last: None,
            differences: Vec::new(),
        }
    }

    /// The next iterate after `f` with the residual `F(f) − f`.
    pub(crate) fn next(&mut self, from: &[f64], residual: &[f64]) -> Vec<f64> {
        let now = [from.to_vec(), residual.to_vec()];
        if let Some(last) = self.last.replace(now.clone()) {
            let [df, dr] = [0, 1].map(|which| minus(&now[which], &last[which]));
            self.differences.push([df, dr]);
            if self.differences.len() > self.memory {
                self.differences.remove(0);
            }
        }
        // Modified Gram–Schmidt, the newest difference first: `r` loses what differences explain.
        let [mut f, mut r] = now;
        let mut basis: Vec<[Vec<f64>; 2]> = Vec::new();
        for [df, dr] in self.differences.iter().rev() {
            let (mut df, mut dr) = (df.clone(), dr.clone());
            let before = norm(&dr);
            for [of_f, of_r] in &basis {
                let part = dot(of_r, &dr);
                subtract(&mut dr, part, of_r);
                subtract(&mut df, part, of_f);
            }
            let size = norm(&dr);
            if size <= NEW * before {
                continue;
            }
            let unit = |all: Vec<f64>| all.into_iter().map(|entry| entry / size).collect();
            let [df, dr]: [Vec<f64>; 2] = [unit(df), unit(dr)];
            let part = dot(&dr, &r);
            subtract(&mut r, part, &dr);
            subtract(&mut f, part, &df);
            basis.push([df, dr]);
        }
        subtract(&mut f, -self.damping, &r);
        // Far extrapolations lead to other paths.
        let step = minus(&f, from);
        let most = FARTHEST * norm(residual);
        let length = norm(&step);
        if length > most {
            f.copy_from_slice(from);
            subtract(&mut f, -most / length, &step);
        }
        f
    }

    /// Forgets all iterates, and continues with this damping.
    pub(crate) fn forget(&mut self, damping: f64) {
        *self = Self::new(damping, self.memory);
    }
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(all: &[f64]) -> f64 {
    dot(all, all).sqrt()
}

pub(crate) fn minus(one: &[f64], other: &[f64]) -> Vec<f64> {
    one.iter().zip(other).map(|(a, b)| a - b).collect()
}

fn subtract(from: &mut [f64], part: f64, all: &[f64]) {
    for (from, entry) in from.iter_mut().zip(all) {
        *from -= part * entry;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a linear map of four unknowns, though it expands, the fixed point is found in five steps.
    #[test]
    fn a_linear_map_is_solved_in_as_many_steps_as_it_has_unknowns() {
        let eigenvalues = [-8.0, -0.5, 0.3, 0.9];
        let residual = |f: &[f64]| -> Vec<f64> {
            let each = f.iter().zip(eigenvalues);
            each.map(|(f, factor)| 1.0 + (factor - 1.0) * f).collect()
        };
        let mut iteration = Anderson::new(0.5, 12);
        let mut f = vec![0.0; 4];
        for _ in 0..6 {
            f = iteration.next(&f, &residual(&f));
        }
        let left = norm(&residual(&f));
        assert!(left < 1e-9, "{left:e}");
    }
}
