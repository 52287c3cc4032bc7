//! SO(3) and SE(3) on arrays of rows. A pose is a homogeneous 4×4 matrix by rows.

use lgvi_lie::{Pose, Quaternion, exp, left_jacobian, log, to_quaternion};
use lgvi_scene::{quaternion_defect, rotation_defect};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Array, array, room, rows};
use crate::error;

/// A row of numbers that a function takes, or what is wrong with it.
type Checked<T> = Result<T, String>;

/// The rotation of a unit quaternion x, y, z, w.
pub(crate) fn rotation([x, y, z, w]: [f64; 4]) -> Checked<Matrix3<f64>> {
    let u = Vector3::new(x, y, z);
    match quaternion_defect(w, &u) {
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
    applied(object.py(), name, rows.len(), |row| function(rows[row]))
}

/// Applies a function to each pair of rows.
fn pairs<'py, const N: usize, const P: usize, const M: usize>(
    one: &Bound<'py, PyAny>,
    other: &Bound<'py, PyAny>,
    function: impl Fn([f64; N], [f64; P]) -> Checked<[f64; M]> + Sync + Send,
) -> PyResult<Array<'py>> {
    let (ones, others) = (rows(one, "a", N)?, rows(other, "b", P)?);
    let (ones, others) = (ones.as_chunks::<N>().0, others.as_chunks::<P>().0);
    let [count, expected] = [ones.len(), others.len()];
    if count != expected {
        let message = format!("{count} and {expected} rows, expected the same number");
        return Err(PyValueError::new_err(message));
    }
    applied(one.py(), "poses", count, |row| {
        function(ones[row], others[row])
    })
}

/// An array of the results of `count` rows.
fn applied<'py, const M: usize>(
    py: Python<'py>,
    name: &str,
    count: usize,
    function: impl Fn(usize) -> Checked<[f64; M]> + Sync + Send,
) -> PyResult<Array<'py>> {
    let mut results = room(count.saturating_mul(M))?;
    let made = py.detach(|| {
        (0..count).try_for_each(|row| {
            results.extend(function(row).map_err(|defect| (row, defect))?);
            Ok(())
        })
    });
    made.map_err(|(row, defect): (usize, String)| {
        error::rotation(py, &format!("`{name}`, row {row} of {count}"), &defect)
    })?;
    array(py, &[count, M], results)
}

/// A rotation matrix by rows.
fn matrix(rows: [f64; 9]) -> Checked<Matrix3<f64>> {
    let matrix = Matrix3::from_row_slice(&rows);
    match rotation_defect(&matrix) {
        None => Ok(matrix),
        Some(defect) => Err(format!("{rows:?} is no rotation matrix by rows: {defect}")),
    }
}

fn by_rows(matrix: &Matrix3<f64>) -> [f64; 9] {
    let transposed = matrix.transpose();
    std::array::from_fn(|index| transposed[index])
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
    pairs(one, other, |one: [f64; 16], other: [f64; 16]| {
        Ok(homogeneous(&pose(one)?.compose(&pose(other)?)))
    })
}

#[pyfunction]
pub(crate) fn se3_act<'py>(
    poses: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
) -> PyResult<Array<'py>> {
    pairs(poses, points, |t: [f64; 16], p: [f64; 3]| {
        Ok(pose(t)?.act(&p.into()).into())
    })
}
