use nalgebra::Vector3;

use super::iteration::Progress;

/// The unknown control points of a polynomial in a vector space, as improved by an iteration.
pub(super) struct Curve {
    pub(super) points: Vec<Vector3<f64>>,
    /// The next correction, to be subtracted from the points.
    pub(super) correction: Vec<Vector3<f64>>,
    /// Points of an earlier solution, used for initial guesses.
    pub(super) before: Vec<Vector3<f64>>,
    /// Magnitude of the quantity to which the points are added. Its rounding error limits the useful accuracy of the
    /// points.
    pub(super) base: f64,
}

impl Curve {
    pub(super) fn new(degree: usize) -> Self {
        let zeros = vec![Vector3::zeros(); degree];
        Self {
            points: zeros.clone(),
            correction: zeros.clone(),
            before: zeros,
            base: 1.0,
        }
    }

    /// Stores the current points for later guesses.
    pub(super) fn remember(&mut self) {
        self.before.copy_from_slice(&self.points);
    }

    /// Subtracts the correction.
    pub(super) fn advance(&mut self) -> Progress {
        let mut correction = 0.0;
        for (point, c) in self.points.iter_mut().zip(&self.correction) {
            *point -= c;
            correction = greater(correction, c.norm_squared());
        }
        Progress::new(correction.sqrt(), self.size(), self.base)
    }

    /// The largest norm of a point.
    pub(super) fn size(&self) -> f64 {
        self.points.iter().map(Vector3::norm).fold(0.0, greater)
    }
}

/// The source of the initial guess for a step's unknowns.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Guess {
    /// Constant velocities.
    Uniform,
    /// The polynomials of the previous step of the same length.
    Onward,
    /// The polynomials of a step of half the length.
    Stretched,
}

impl Guess {
    /// Chooses the guess for a step `h`, where `last` is the length of the previous step, or `None` if there was none
    /// since the start.
    pub(super) fn after(last: Option<f64>, h: f64) -> Self {
        if last == Some(h) {
            Self::Onward
        } else {
            Self::Uniform
        }
    }
}

/// The larger of two values, or NaN if one is NaN.
pub(super) fn greater(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

/// `Σ_κ c_κ v^κ`.
#[inline]
pub(super) fn combine(coefficients: &[f64], vectors: &[Vector3<f64>]) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for (c, v) in coefficients.iter().zip(vectors) {
        sum += *c * v;
    }
    sum
}
