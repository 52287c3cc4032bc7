use nalgebra::Vector3;

use super::iteration::Progress;

/// The unknown control points of a polynomial in a vector space, as an iteration improves them.
pub(super) struct Curve {
    pub(super) points: Vec<Vector3<f64>>,
    /// What to subtract from the points next.
    pub(super) correction: Vec<Vector3<f64>>,
    /// Points that a guess may build on.
    pub(super) before: Vec<Vector3<f64>>,
    /// Size of what the points are added to, whose rounding they need not undercut.
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

    /// Lets later guesses build on the present points.
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

    /// Greatest length of a point.
    pub(super) fn size(&self) -> f64 {
        self.points.iter().map(Vector3::norm).fold(0.0, greater)
    }
}

/// What a first guess of a step's unknowns is made from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Guess {
    /// Constant velocities.
    Uniform,
    /// The polynomials of the step before, of the same length.
    Onward,
    /// Those of a step half as long.
    Stretched,
}

impl Guess {
    /// For a step `h` after one of length `last`, if there was one since the start.
    pub(super) fn after(last: Option<f64>, h: f64) -> Self {
        if last == Some(h) {
            Self::Onward
        } else {
            Self::Uniform
        }
    }
}

/// The greater of two, NaN if one is NaN.
pub(super) fn greater(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

/// `Σ_κ c_κ v^κ`
#[inline]
pub(super) fn combine(coefficients: &[f64], vectors: &[Vector3<f64>]) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for (c, v) in coefficients.iter().zip(vectors) {
        sum += *c * v;
    }
    sum
}
