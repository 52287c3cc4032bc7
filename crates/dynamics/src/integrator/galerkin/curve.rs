use nalgebra::Vector3;

use super::iteration::Progress;

/// The unknown control points of a polynomial in a vector space, as an iteration improves them.
pub(super) struct Curve {
    pub(super) points: Vec<Vector3<f64>>,
    /// What to subtract from the points next.
    pub(super) correction: Vec<Vector3<f64>>,
    /// Points of the last accepted step.
    pub(super) last: Last,
    /// Size of what the points are added to, whose rounding they need not undercut.
    pub(super) base: f64,
}

impl Curve {
    pub(super) fn new(degree: usize) -> Self {
        let zeros = vec![Vector3::zeros(); degree];
        Self {
            points: zeros.clone(),
            correction: zeros.clone(),
            last: Last {
                points: zeros,
                known: false,
            },
            base: 1.0,
        }
    }

    /// Forgets the trajectory so far.
    pub(super) fn forget(&mut self) {
        self.last.known = false;
    }

    /// Takes the present points as those of an accepted step.
    pub(super) fn remember(&mut self) {
        self.last.points.copy_from_slice(&self.points);
        self.last.known = true;
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

/// The points of the last accepted step, if there was one since the start.
pub(super) struct Last {
    points: Vec<Vector3<f64>>,
    known: bool,
}

impl Last {
    pub(super) fn get(&self) -> Option<&[Vector3<f64>]> {
        self.known.then_some(&self.points)
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
