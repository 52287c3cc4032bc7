use nalgebra::{Matrix3, Vector3};

use crate::PointMass;

/// Full symmetric moments of a body's mass about the origin of its frame, for the expansion of its potential.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// `second[(i, j)] = ∫ ρ_i ρ_j dm`, which equals `J_d` if the origin is the center of mass.
    pub second: Matrix3<f64>,
    /// `third[i][(j, k)] = ∫ ρ_i ρ_j ρ_k dm`.
    pub third: [Matrix3<f64>; 3],
    /// `fourth[i][j][(k, l)] = ∫ ρ_i ρ_j ρ_k ρ_l dm`.
    pub fourth: [[Matrix3<f64>; 3]; 3],
}

impl Moments {
    /// The moments of point masses.
    pub fn of_points(points: &[PointMass]) -> Self {
        let mut sum = Self::default();
        for PointMass { mass, position } in points {
            let second: Matrix3<f64> = *mass * position * position.transpose();
            sum.second += second;
            for i in 0..3 {
                sum.third[i] += position[i] * second;
                for j in 0..3 {
                    sum.fourth[i][j] += (position[i] * position[j]) * second;
                }
            }
        }
        sum
    }

    /// The moments of a homogeneous ellipsoid with these semi-axes along its body axes: `∫ρ_i² = m a_i²/5`, `∫ρ_i²
    /// ρ_j² = m a_i² a_j²/35`, `∫ρ_i⁴ = 3 m a_i⁴/35`. Odd moments vanish.
    pub fn of_ellipsoid(mass: f64, semi_axes: [f64; 3]) -> Self {
        let squares = Vector3::from(semi_axes.map(|a| a * a));
        let fourth = |i: usize, j: usize| {
            let mut product = Matrix3::zeros();
            if i == j {
                product.set_diagonal(&squares);
            }
            product[(i, j)] += squares[j];
            product[(j, i)] += squares[j];
            mass / 35.0 * squares[i] * product
        };
        let mut moments = Self {
            second: Matrix3::from_diagonal(&(mass / 5.0 * squares)),
            ..Self::default()
        };
        for i in 0..3 {
            for j in 0..3 {
                moments.fourth[i][j] = fourth(i, j);
            }
        }
        moments
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gravity::{Attractor, Multipole};

    /// A ball attracts like a point, with `∫ρ² dm = 3/5 m a²` and `∫ρ⁴ dm = 3/7 m a⁴`. An ellipsoid is a stretched
    /// ball.
    #[test]
    fn an_ellipsoid_is_a_stretched_ball() {
        let ball = Moments::of_ellipsoid(2.0, [1.5; 3]);
        assert!((ball.second.trace() - 0.6 * 2.0 * 1.5_f64.powi(2)).abs() < 1e-15);
        let fourth: f64 = (0..3).map(|i| ball.fourth[i][i].trace()).sum();
        assert!((fourth - 3.0 / 7.0 * 2.0 * 1.5_f64.powi(4)).abs() < 1e-14);
        let d = Vector3::new(1.0, -2.0, 0.5);
        let potential = Multipole::of_moments(2.0, &ball).potential(&d);
        assert!((potential + 2.0 / d.norm()).abs() < 1e-15);

        let unit = Moments::of_ellipsoid(2.0, [1.0; 3]);
        let axes = [1.5, 0.7, 2.2];
        let ellipsoid = Moments::of_ellipsoid(2.0, axes);
        for (i, j, k, l) in (0..81).map(|n| (n / 27, n / 9 % 3, n / 3 % 3, n % 3)) {
            let stretch = axes[i] * axes[j] * axes[k] * axes[l];
            let expected = stretch * unit.fourth[i][j][(k, l)];
            assert!((ellipsoid.fourth[i][j][(k, l)] - expected).abs() < 1e-14);
        }
    }

    /// The closed form on the axis of a prolate spheroid, with `c > a` and `k² = c² − a²`, is `φ = −3m/(4k³) [2 k z +
    /// (k² − z²) ln((z + k)/(z − k))]`. The error of the expansion decays with the inverse seventh power of the
    /// distance.
    #[test]
    fn the_fourth_order_of_a_spheroid_meets_its_closed_form() {
        let (m, a, c) = (1.3, 1.0, 1.2);
        let k = f64::sqrt(c * c - a * a);
        let multipole = Multipole::of_moments(m, &Moments::of_ellipsoid(m, [a, a, c]));
        let error = |z: f64| {
            let logarithm = libm::log((z + k) / (z - k));
            let exact = -0.75 * m / (k * k * k) * (2.0 * k * z + (k * k - z * z) * logarithm);
            (multipole.potential(&Vector3::new(0.0, 0.0, z)) - exact).abs()
        };
        let slope = libm::log2(error(3.0) / error(6.0));
        assert!(error(3.0) < 1e-5, "{:e}", error(3.0));
        assert!((slope - 7.0).abs() < 0.2, "slope {slope}");
    }
}
