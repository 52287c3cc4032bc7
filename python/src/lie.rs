//! SO(3) and SE(3) on arrays of rows. A pose is a homogeneous 4×4 matrix by rows.

use lgvi_lie::{Pose, Quaternion, exp, left_jacobian, log, polish, to_quaternion};
use lgvi_scene::{quaternion_defect, rotation_defect};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Array, array, by_rows, room, rows};
use crate::error;

/// A row of numbers that a function takes, or what is wrong with it.
type Checked<T> = Result<T, String>;

/// Largest |RᵀR − I| of a matrix and largest ||q| − 1| of a quaternion that are accepted: what Runge–Kutta methods and numbers
/// of single precision leave.
const TOLERANCE: f64 = 1e-4;

/// The rotation of a unit quaternion x, y, z, w, whatever its norm is within the tolerance.
pub(crate) fn rotation([x, y, z, w]: [f64; 4]) -> Checked<Matrix3<f64>> {
    let u = Vector3::new(x, y, z);
    match quaternion_defect(w, &u, TOLERANCE) {
        None => Ok(Quaternion { w, u }.matrix()),
        Some(defect) => Err(format!(
            "[{x}, {y}, {z}, {w}] is no unit quaternion: {defect}"
        )),
    }
}

/// Applies a function to each row.
fn each<'py, const N: usize, const M: usize>(
    object: &Bound<'py, PyAny>,
    name: &str,
    function: impl Fn([f64; N]) -> Checked<[f64; M]> + Sync + Send,
) -> PyResult<Array<'py>> {
    let numbers = rows(object, name, N)?;
    let (rows, _) = numbers.as_chunks::<N>();
    applied(object.py(), rows.len(), |row| {
        function(rows[row]).map_err(|defect| (name, defect))
    })
}

/// An operand with its name and with what makes a row of it, which is checked.
struct Operand<'a, 'py, const N: usize, T> {
    object: &'a Bound<'py, PyAny>,
    name: &'static str,
    read: fn([f64; N]) -> Checked<T>,
}

/// Applies a function to each pair of rows.
fn pairs<'py, const N: usize, const P: usize, const M: usize, A, B>(
    one: &Operand<'_, 'py, N, A>,
    other: &Operand<'_, 'py, P, B>,
    function: impl Fn(A, B) -> [f64; M] + Sync + Send,
) -> PyResult<Array<'py>> {
    let py = one.object.py();
    let ones = rows(one.object, one.name, N)?;
    let others = rows(other.object, other.name, P)?;
    let (ones, others) = (ones.as_chunks::<N>().0, others.as_chunks::<P>().0);
    let [count, expected] = [ones.len(), others.len()];
    if count != expected {
        let message = format!("{count} and {expected} rows, expected the same number");
        return Err(PyValueError::new_err(message));
    }
    let (read, name) = (one.read, one.name);
    let (read_other, other_name) = (other.read, other.name);
    applied(py, count, |row| {
        let a = read(ones[row]).map_err(|defect| (name, defect))?;
        let b = read_other(others[row]).map_err(|defect| (other_name, defect))?;
        Ok(function(a, b))
    })
}

/// An array of the results of `count` rows. An error has the name of the operand and its defect.
fn applied<'py, 'n, const M: usize>(
    py: Python<'py>,
    count: usize,
    function: impl Fn(usize) -> Result<[f64; M], (&'n str, String)> + Sync + Send,
) -> PyResult<Array<'py>> {
    let mut results = room(count.saturating_mul(M))?;
    let made = py.detach(|| {
        (0..count).try_for_each(|row| {
            results.extend(function(row).map_err(|refused| (row, refused))?);
            Ok(())
        })
    });
    made.map_err(|(row, (name, defect)): (usize, (&str, String))| {
        error::rotation(py, &format!("`{name}`, row {row} of {count}"), &defect)
    })?;
    array(py, &[count, M], results)
}

/// The rotation that is nearest to a matrix by rows, which is one within the tolerance.
fn matrix(rows: [f64; 9]) -> Checked<Matrix3<f64>> {
    let matrix = Matrix3::from_row_slice(&rows);
    match rotation_defect(&matrix, TOLERANCE) {
        None => Ok(polish(&matrix)),
        Some(defect) => Err(format!("{rows:?} is no rotation matrix by rows: {defect}")),
    }
}

fn six_by_rows(matrix: &Matrix6<f64>) -> [f64; 36] {
    let transposed = matrix.transpose();
    std::array::from_fn(|index| transposed[index])
}

fn pose(m: [f64; 16]) -> Checked<Pose> {
    let last = &m[12..];
    if last != [0.0, 0.0, 0.0, 1.0] {
        return Err(format!(
            "the last row of the pose is {last:?}, expected [0, 0, 0, 1]"
        ));
    }
    Ok(Pose {
        rotation: matrix([m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]])?,
        translation: Vector3::new(m[3], m[7], m[11]),
    })
}

fn homogeneous(pose: &Pose) -> [f64; 16] {
    let (r, x) = (by_rows(&pose.rotation), &pose.translation);
    [
        r[0], r[1], r[2], x.x, r[3], r[4], r[5], x.y, r[6], r[7], r[8], x.z, 0.0, 0.0, 0.0, 1.0,
    ]
}

#[pyfunction]
pub(crate) fn so3_exp<'py>(vectors: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(vectors, "v", |v: [f64; 3]| Ok(by_rows(&exp(&v.into()))))
}

#[pyfunction]
pub(crate) fn so3_log<'py>(rotations: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(rotations, "r", |r: [f64; 9]| Ok(log(&matrix(r)?).into()))
}

#[pyfunction]
pub(crate) fn so3_left_jacobian<'py>(vectors: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(vectors, "v", |v: [f64; 3]| {
        Ok(by_rows(&left_jacobian(&v.into())))
    })
}

#[pyfunction]
pub(crate) fn so3_to_quaternion<'py>(rotations: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(rotations, "r", |r: [f64; 9]| {
        let (w, u) = to_quaternion(&matrix(r)?);
        Ok([u.x, u.y, u.z, w])
    })
}

#[pyfunction]
pub(crate) fn so3_from_quaternion<'py>(quaternions: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(quaternions, "q", |q: [f64; 4]| {
        rotation(q).map(|rotation| by_rows(&rotation))
    })
}

#[pyfunction]
pub(crate) fn se3_exp<'py>(twists: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(twists, "xi", |xi: [f64; 6]| {
        Ok(homogeneous(&Pose::exp(&Vector6::from(xi))))
    })
}

#[pyfunction]
pub(crate) fn se3_log<'py>(poses: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(poses, "t", |t: [f64; 16]| Ok(pose(t)?.log().into()))
}

#[pyfunction]
pub(crate) fn se3_inverse<'py>(poses: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(poses, "t", |t: [f64; 16]| {
        Ok(homogeneous(&pose(t)?.inverse()))
    })
}

#[pyfunction]
pub(crate) fn se3_adjoint<'py>(poses: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(poses, "t", |t: [f64; 16]| {
        Ok(six_by_rows(&pose(t)?.adjoint()))
    })
}

#[pyfunction]
pub(crate) fn se3_left_jacobian<'py>(twists: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(twists, "xi", |xi: [f64; 6]| {
        Ok(six_by_rows(&Pose::left_jacobian(&Vector6::from(xi))))
    })
}

#[pyfunction]
pub(crate) fn se3_compose<'py>(
    one: &Bound<'py, PyAny>,
    other: &Bound<'py, PyAny>,
) -> PyResult<Array<'py>> {
    let operand = |object, name| Operand {
        object,
        name,
        read: pose,
    };
    pairs(&operand(one, "a"), &operand(other, "b"), |one, other| {
        homogeneous(&one.compose(&other))
    })
}

#[pyfunction]
pub(crate) fn se3_act<'py>(
    poses: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
) -> PyResult<Array<'py>> {
    let poses = Operand {
        object: poses,
        name: "t",
        read: pose,
    };
    let points = Operand {
        object: points,
        name: "p",
        read: |p: [f64; 3]| Ok(Vector3::from(p)),
    };
    pairs(&poses, &points, |pose, point| pose.act(&point).into())
}
