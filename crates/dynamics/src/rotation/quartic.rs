//! The quartic whose smallest root determines the solution on the branch from `F = I`, and whether it exists.
//!
//! With `s = gᵀf` and `A = 2J − s I`, the Cayley form (2.6) becomes `A f = g + g × f`. Hence `f = [adj(A) g + |g|² g −
//! g × A g] / (det A + gᵀA g)`, and `s = gᵀf` becomes a quartic in s alone: `p(s) = s (det A + gᵀA g) − gᵀadj(A) g
//! − |g|⁴ = 0`, with `p(0) < 0`. The correct solution is its smallest root `s ≥ 0`. It lies before the first maximum of
//! p, where p is still increasing. If that maximum is negative, the branch has folded and no solution exists. All
//! quantities, including `g`, are relative to `tr J` and in principal axes.

use nalgebra::Vector3;

/// `p(s) = −s⁴ + 2 s³ − (4e + 2γ) s² + (8d + 2γ) s − c`, where e and d are the second coefficient and determinant of
/// `J / tr J`, and `γ = |g|²`.
pub(super) struct Quartic {
    pub(super) e: f64,
    pub(super) d: f64,
    pub(super) gamma: f64,
    pub(super) c: f64,
}

impl Quartic {
    /// Creates the quartic for the principal moments `j` of `J / tr J`.
    #[inline]
    pub(super) fn new(j: &Vector3<f64>, g: &Vector3<f64>) -> Self {
        let squares = g.component_mul(g);
        let minors = Vector3::new(j.y * j.z, j.z * j.x, j.x * j.y);
        let gamma = squares.sum();
        Self {
            e: minors.sum(),
            d: j.x * minors.x,
            gamma,
            // gᵀ adj(J) g is the sum of squares times minors.
            c: 4.0 * squares.dot(&minors) + gamma * gamma,
        }
    }

    pub(super) fn value(&self, s: f64) -> f64 {
        (((2.0 - s) * s - (4.0 * self.e + 2.0 * self.gamma)) * s + 8.0 * self.d + 2.0 * self.gamma)
            * s
            - self.c
    }

    pub(super) fn slope(&self, s: f64) -> f64 {
        ((6.0 - 4.0 * s) * s - 2.0 * (4.0 * self.e + 2.0 * self.gamma)) * s
            + 8.0 * self.d
            + 2.0 * self.gamma
    }

    /// The two inflection points, between which the slope increases, or `None` if the slope decreases everywhere.
    fn inflections(&self) -> Option<(f64, f64)> {
        let discriminant = 1.0 - (8.0 * self.e + 4.0 * self.gamma) / 3.0;
        (discriminant > 0.0).then(|| {
            let root = discriminant.sqrt();
            (0.5 * (1.0 - root), 0.5 * (1.0 + root))
        })
    }

    /// The first maximum for `s ≥ 0`.
    fn first_maximum(&self) -> f64 {
        let (low, mut high) = match self.inflections() {
            Some((first, _)) if self.slope(first) <= 0.0 => (0.0, first),
            Some((_, second)) => (second, 2.0 * second),
            None => (0.0, 1.0),
        };
        while self.slope(high) > 0.0 {
            high *= 2.0;
        }
        bisect(low, high, |s| self.slope(s) > 0.0)
    }

    /// Returns true if p increases all the way from 0 to `s`.
    pub(super) fn rises_to(&self, s: f64) -> bool {
        if !(s >= 0.0 && self.slope(s) >= 0.0) {
            return false;
        }
        match self.inflections() {
            Some((first, _)) if s > first => self.slope(first) >= 0.0,
            _ => true,
        }
    }

    /// The smallest root `s ≥ 0`. If none exists, returns the (negative) maximum of p relative to `|p(0)|`.
    pub(super) fn root(&self) -> Result<f64, f64> {
        let maximum = self.first_maximum();
        let margin = self.value(maximum) / self.c;
        if margin.is_nan() || margin < 0.0 {
            return Err(margin);
        }
        Ok(bisect(0.0, maximum, |s| self.value(s) < 0.0))
    }
}

/// The end of the interval, starting at `low`, on which `below` holds, to rounding.
fn bisect(mut low: f64, mut high: f64, below: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle.is_nan() || middle <= low || middle >= high {
            return low;
        }
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}
