//! Checks of single values. Every error names the key of the value.

use lgvi_lie::{orthogonality_error, polish};
use nalgebra::{Matrix3, Vector3};

use crate::SceneError;
use crate::file::AttitudeFile;

/// Largest deviation of a scene's attitude from a rotation: allows for rounded decimals and nothing more.
const ROTATION_TOLERANCE: f64 = 1e-9;

pub(crate) fn positive(key: &str, value: f64) -> Result<f64, SceneError> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(SceneError::value(key, value, "a finite number > 0"))
    }
}

pub(crate) fn not_negative(key: &str, value: f64) -> Result<f64, SceneError> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        Err(SceneError::value(key, value, "a finite number ≥ 0"))
    }
}

pub(crate) fn vector(key: &str, value: [f64; 3]) -> Result<Vector3<f64>, SceneError> {
    if value.iter().all(|c| c.is_finite()) {
        Ok(value.into())
    } else {
        Err(SceneError::value(key, value, "three finite numbers"))
    }
}

pub(crate) fn matrix(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| rows[i][j])
}

/// Returns why a matrix is no rotation: the Frobenius norm of `RᵀR − I` is more than `tolerance`, or the determinant is
/// negative; `None` if it is one.
pub fn rotation_defect(r: &Matrix3<f64>, tolerance: f64) -> Option<String> {
    let error = orthogonality_error(r);
    if error.is_nan() || error > tolerance {
        return Some(format!(
            "|RᵀR − I| is {error:.1e}, expected at most {tolerance:e}"
        ));
    }
    let reflects = r.determinant() < 0.0;
    reflects.then(|| "this is a reflection, its determinant is −1, expected 1".to_owned())
}

/// Returns why a quaternion `w + u` is no unit quaternion: its norm differs from 1 by more than `tolerance`; `None` if it is
/// one.
pub fn quaternion_defect(w: f64, u: &Vector3<f64>, tolerance: f64) -> Option<String> {
    let norm = (w * w + u.norm_squared()).sqrt();
    let fits = (norm - 1.0).abs() <= tolerance;
    (!fits).then(|| format!("its norm is {norm}, expected 1 to within {tolerance:e}"))
}

/// Returns the rotation matrix, orthogonalized to remove the rounding of its decimals.
pub(crate) fn rotation(key: &str, attitude: &AttitudeFile) -> Result<Matrix3<f64>, SceneError> {
    match attitude {
        AttitudeFile::Matrix(rows) => {
            let r = matrix(*rows);
            if let Some(defect) = rotation_defect(&r, ROTATION_TOLERANCE) {
                let expected = format!("a rotation matrix by rows: {defect}");
                return Err(SceneError::value(key, rows, expected));
            }
            Ok(polish(&r))
        }
        AttitudeFile::Quaternion(q) => {
            let (w, u) = (q.w, Vector3::new(q.x, q.y, q.z));
            if let Some(defect) = quaternion_defect(w, &u, ROTATION_TOLERANCE) {
                let expected = format!("a unit quaternion: {defect}");
                return Err(SceneError::value(key, [q.w, q.x, q.y, q.z], expected));
            }
            let norm = (w * w + u.norm_squared()).sqrt();
            let (w, u) = (w / norm, u / norm);
            let s = lgvi_lie::hat(&u);
            Ok(polish(&(Matrix3::identity() + 2.0 * (w * s + s * s))))
        }
    }
}

/// Checks that a name is valid in a ROS topic and as a tf frame, and fits into a shared-memory sample.
pub(crate) fn name(key: &str, value: &str) -> Result<(), SceneError> {
    let mut characters = value.chars();
    let legal = characters.next().is_some_and(|c| c.is_ascii_alphabetic())
        && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !value.contains("__")
        && value.len() <= 31;
    if legal {
        Ok(())
    } else {
        let expected =
            "a letter, then letters, digits and single underscores, 31 characters at most";
        Err(SceneError::value(key, value, expected))
    }
}
