use nalgebra::{Matrix3, Vector3};

use super::Polyhedron;
use crate::gravity::Moments;
use crate::{Inertia, InertiaError};

impl Polyhedron {
    /// The volume.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// The mass.
    pub fn mass(&self) -> f64 {
        self.density * self.volume
    }

    /// The center of mass.
    pub fn center(&self) -> Vector3<f64> {
        self.center
    }

    /// The inertia about the center of mass, in the body's axes.
    ///
    /// # Errors
    /// Returns an error if the result is not the inertia of a rigid body, which can happen for a surface that
    /// intersects itself.
    pub fn inertia(&self) -> Result<Inertia, InertiaError> {
        // ∫ ρ ρᵀ over a tetrahedron with corners 0, a, b, c and volume V is V/20 [a aᵀ + b bᵀ + c cᵀ + s sᵀ] with s =
        // a + b + c
        let mut second = Matrix3::zeros();
        for [a, b, c] in self.tetrahedra(&self.center) {
            let sum = a + b + c;
            let outer = [a, b, c, sum].map(|v| v * v.transpose());
            second += a.dot(&b.cross(&c)) / 120.0 * outer.iter().sum::<Matrix3<f64>>();
        }
        let nonstandard = self.density * second;
        Inertia::new(Matrix3::from_diagonal_element(nonstandard.trace()) - nonstandard)
    }

    /// The moments of degrees two to four, exact to rounding.
    pub fn moments(&self) -> Moments {
        let mass = self.monomials::<5>();
        let along = |axes: &[usize]| {
            let [x, y, z] = [0, 1, 2].map(|axis| axes.iter().filter(|&&a| a == axis).count());
            mass[x][y][z]
        };
        let axes = [0, 1, 2];
        Moments {
            second: Matrix3::from_fn(|i, j| along(&[i, j])),
            third: axes.map(|i| Matrix3::from_fn(|j, k| along(&[i, j, k]))),
            fourth: axes.map(|i| axes.map(|j| Matrix3::from_fn(|k, l| along(&[i, j, k, l])))),
        }
    }

    /// The tetrahedra between `apex` and the surface's faces, as the corners of each face relative to `apex`. A face
    /// seen from behind gives a negative volume `a·(b × c)/6`.
    pub(super) fn tetrahedra(
        &self,
        apex: &Vector3<f64>,
    ) -> impl Iterator<Item = [Vector3<f64>; 3]> + '_ {
        let apex = *apex;
        self.faces
            .iter()
            .map(move |face| face.map(|corner| self.vertices[corner] - apex))
    }

    /// `∫ dV` and `∫ (ρ − apex) dV`.
    pub(super) fn volume_moments(&self, apex: &Vector3<f64>) -> (f64, Vector3<f64>) {
        let mut volume = 0.0;
        let mut first = Vector3::zeros();
        for [a, b, c] in self.tetrahedra(apex) {
            let tetrahedron = a.dot(&b.cross(&c)) / 6.0;
            volume += tetrahedron;
            first += 0.25 * tetrahedron * (a + b + c);
        }
        (volume, first)
    }

    /// `∫ x^i y^j z^k dm` at `[i][j][k]` for `i + j + k < N`.
    ///
    /// For a tetrahedron with corners 0, a, b, c and volume V, this is `6 V i! j! k!/(n + 3)!`, `n = i + j + k`, times
    /// the coefficient of `ξ^i η^j ζ^k` in the complete homogeneous polynomial `h_n` of the linear forms a, b and c (P.
    /// Koehl, IEEE Trans. PAMI 34, 2012). These polynomials satisfy `h_n(a, …) = a h_{n−1}(a, …) + h_n(…)`.
    pub(super) fn monomials<const N: usize>(&self) -> Powers<N> {
        let mut sum = [[[0.0; N]; N]; N];
        for [a, b, c] in self.tetrahedra(&Vector3::zeros()) {
            let mut homogeneous = [[[0.0; N]; N]; N];
            homogeneous[0][0][0] = 1.0;
            for form in [c, b, a] {
                multiply_by_geometric_series(&mut homogeneous, &form);
            }
            let weight = self.density * a.dot(&b.cross(&c));
            for [i, j, k] in exponents::<N>() {
                sum[i][j][k] += weight * homogeneous[i][j][k];
            }
        }
        for [i, j, k] in exponents::<N>() {
            sum[i][j][k] *= factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3);
        }
        sum
    }
}

/// A number for each monomial `x^i y^j z^k` with `i + j + k < N`, at `[i][j][k]`.
pub(super) type Powers<const N: usize> = [[[f64; N]; N]; N];

/// All exponents with `i + j + k < N`, in an order in which divisors precede their multiples.
pub(super) fn exponents<const N: usize>() -> impl Iterator<Item = [usize; 3]> {
    (0..N).flat_map(|i| (0..N - i).flat_map(move |j| (0..N - i - j).map(move |k| [i, j, k])))
}

/// `p := p (1 + a + a² + …)` for a linear form a, computed as `p := p + a p` from the lowest degree up.
fn multiply_by_geometric_series<const N: usize>(p: &mut Powers<N>, form: &Vector3<f64>) {
    for [i, j, k] in exponents::<N>() {
        let mut coefficient = p[i][j][k];
        if i > 0 {
            coefficient += form.x * p[i - 1][j][k];
        }
        if j > 0 {
            coefficient += form.y * p[i][j - 1][k];
        }
        if k > 0 {
            coefficient += form.z * p[i][j][k - 1];
        }
        p[i][j][k] = coefficient;
    }
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|factor| factor as f64).product()
}
