use nalgebra::{Matrix3, Vector3};

use crate::PointMass;

/// Full symmetric moments of a body's mass about the origin of its frame, as its potential's expansion needs them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// `second[(i, j)] = ∫ ρ_i ρ_j dm`; `J_d` where the origin is the centre of mass.
    pub second: Matrix3<f64>,
    /// `third[i][(j, k)] = ∫ ρ_i ρ_j ρ_k dm`.
    pub third: [Matrix3<f64>; 3],
    /// `fourth[i][j][(k, l)] = ∫ ρ_i ρ_j ρ_k ρ_l dm`.
    pub fourth: [[Matrix3<f64>; 3]; 3],
}

impl Moments {
    /// Those of points of mass.
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

    /// Those of a homogeneous ellipsoid with these semi-axes along its body axes: `∫ρ_i² = m a_i²/5`,
    /// `∫ρ_i² ρ_j² = m a_i² a_j²/35`, `∫ρ_i⁴ = 3 m a_i⁴/35`; odd ones vanish.
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
