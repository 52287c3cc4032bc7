use super::elimination::Elimination;
use super::{ChartOrigin, MAX_DEGREE, Quadrature};
use crate::MethodError;

/// The tables of the general construction (§2.2) for a degree, a quadrature and a chart, on the unit interval.
///
/// The control points `0 = d_0 < … < d_s = 1` are the nodes of the Lobatto rule, which gives good conditioning. Each
/// table has one row per quadrature point i, with columns for the control points κ = 1 … s.
pub(super) struct Basis {
    pub(super) degree: usize,
    pub(super) points: usize,
    pub(super) origin: ChartOrigin,
    /// `c_i`.
    pub(super) nodes: Vec<f64>,
    /// `b_i`.
    pub(super) weights: Vec<f64>,
    /// `d_1 … d_s`.
    pub(super) controls: Vec<f64>,
    /// `l_κ(c_i)`.
    pub(super) value: Vec<f64>,
    /// `l_κ(c_i)` for the rotation vector, whose value at `d_0` depends on the chart.
    pub(super) chart_value: Vec<f64>,
    /// `dl_κ/dτ (c_i)` for the rotation vector.
    pub(super) chart_slope: Vec<f64>,
    /// `a_κi` in `x^κ = x_0 + d_κ h ẋ_0 + (h²/m) Σ_i a_κi f_i`.
    pub(super) response: Vec<f64>,
    /// Extrapolation to the next step, at `1 + d_λ`.
    pub(super) onward: Extrapolation,
    /// Extrapolation to a step of twice the length, at `2 d_λ`.
    pub(super) stretched: Extrapolation,
}

/// Values of the polynomials outside the step: one row per target point λ, with columns for the given points κ.
#[derive(Default)]
pub(super) struct Extrapolation {
    /// `l_κ`.
    pub(super) value: Vec<f64>,
    /// `l_κ` for rotation vectors.
    pub(super) chart_value: Vec<f64>,
}

impl Basis {
    /// Creates the tables for a method called `method` after checking its parameters.
    pub(super) fn checked(
        method: &'static str,
        degree: u32,
        quadrature: Quadrature,
        origin: ChartOrigin,
    ) -> Result<Self, MethodError> {
        if !(1..=MAX_DEGREE).contains(&degree) {
            return Err(MethodError::Parameter {
                method,
                parameter: "degree",
                value: f64::from(degree),
                expected: "1 to 10",
            });
        }
        quadrature.check(method, degree)?;
        Ok(Self::new(degree, quadrature, origin))
    }

    fn new(degree: u32, quadrature: Quadrature, origin: ChartOrigin) -> Self {
        let (controls, _) = Quadrature::Lobatto(degree + 1).rule();
        let (nodes, weights) = quadrature.rule();
        let degree = controls.len() - 1;
        let mut basis = Self {
            degree,
            points: nodes.len(),
            origin,
            value: vec![],
            chart_value: vec![],
            chart_slope: vec![],
            response: vec![],
            onward: Extrapolation::default(),
            stretched: Extrapolation::default(),
            controls: controls[1..].to_vec(),
            nodes,
            weights,
        };
        let mut slope = vec![];
        for &node in &basis.nodes {
            let (values, slopes) = lagrange(&controls, node);
            basis.value.extend(&values[1..]);
            slope.extend_from_slice(&slopes[1..]);
            basis.chart_value.extend(in_chart(origin, &values));
            basis.chart_slope.extend(in_chart(origin, &slopes));
        }
        for &control in &controls[1..] {
            for (to, tau) in [
                (&mut basis.onward, 1.0 + control),
                (&mut basis.stretched, 2.0 * control),
            ] {
                let (values, _) = lagrange(&controls, tau);
                to.value.extend(&values[1..]);
                to.chart_value.extend(in_chart(origin, &values));
            }
        }
        basis.response = basis.responses(&slope);
        basis
    }

    /// Solves the stationarity condition in `x^κ`, `(m/h) Σ_λ A_κλ (x^λ − x_0) = δ_κs (γ_0 + h Σ b_i f_i) − h Σ_i b_i
    /// l_κ(c_i) f_i` with `A_κλ = Σ b_i l̇_κ l̇_λ`, for `x^κ`, using `A⁻¹ e_s = d`.
    fn responses(&self, slope: &[f64]) -> Vec<f64> {
        let s = self.degree;
        let mut stiffness = Elimination::new(s);
        for (slope, weight) in slope.chunks_exact(s).zip(&self.weights) {
            for row in 0..s {
                for column in 0..s {
                    stiffness.entries()[row * s + column] += weight * slope[row] * slope[column];
                }
            }
        }
        stiffness.factor();
        let mut responses = vec![];
        for (value, weight) in self.value.chunks_exact(s).zip(&self.weights) {
            let mut b: Vec<f64> = value.iter().map(|l| -weight * l).collect();
            stiffness.solve(&mut b);
            for (b, control) in b.iter_mut().zip(&self.controls) {
                *b += weight * control;
            }
            responses.extend(b);
        }
        responses
    }

    /// The row of a table for a quadrature point.
    #[inline]
    pub(super) fn at<'a>(&self, table: &'a [f64], point: usize) -> &'a [f64] {
        &table[point * self.degree..(point + 1) * self.degree]
    }
}

/// Lagrange polynomials and their derivatives at `τ`.
fn lagrange(nodes: &[f64], tau: f64) -> (Vec<f64>, Vec<f64>) {
    let others = |skipped: [usize; 2]| {
        let kept = move |&(index, _): &(usize, &f64)| !skipped.contains(&index);
        nodes.iter().enumerate().filter(kept)
    };
    let each = |(kappa, d): (usize, &f64)| {
        let product = |left_out: usize| -> f64 {
            others([kappa, left_out])
                .map(|(_, other)| (tau - other) / (d - other))
                .product()
        };
        let slope: f64 = others([kappa, kappa])
            .map(|(index, other)| product(index) / (d - other))
            .sum();
        (product(kappa), slope)
    };
    nodes.iter().enumerate().map(each).unzip()
}

/// The coefficients of `ξ^1 … ξ^s`, given the values of the polynomials 0 … s.
fn in_chart(origin: ChartOrigin, polynomials: &[f64]) -> Vec<f64> {
    let mut kept = polynomials[1..].to_vec();
    if let (ChartOrigin::Middle, Some(last)) = (origin, kept.last_mut()) {
        *last -= polynomials[0];
    }
    kept
}
