//! SO(3) and SE(3) on arrays of rows. A pose is a homogeneous 4×4 matrix by rows.

use lgvi_lie::{Pose, Quaternion, exp, left_jacobian, log, to_quaternion};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{Array, array, rows};

/// The rotation of a quaternion x, y, z, w of any length; `None` if it is 0 or not finite.
pub(crate) fn rotation([x, y, z, w]: [f64; 4]) -> Option<Matrix3<f64>> {
    let size = [x, y, z, w]
        .iter()
        .fold(0.0, |size: f64, part| size.max(part.abs()));
    let is_valid = size > 0.0 && [x, y, z, w].iter().all(|part| part.is_finite());
    // Squares of parts of this size neither overflow nor underflow.
    is_valid.then(|| {
        let u = Vector3::new(x, y, z) / size;
        Quaternion { w: w / size, u }.matrix()
    })
}

/// Applies a function to each row.
fn each<'py, const N: usize, const M: usize>(
    object: &Bound<'py, PyAny>,
    name: &str,
    function: impl Fn([f64; N]) -> [f64; M] + Sync + Send,
) -> PyResult<Array<'py>> {
    let py = object.py();
    let numbers = rows(object, name, N)?;
    let results = py.detach(|| {
        let (rows, _) = numbers.as_chunks::<N>();
        rows.iter().flat_map(|row| function(*row)).collect()
    });
    array(py, &[numbers.len() / N, M], results)
}

/// Applies a function to each pair of rows.
fn pairs<'py, const N: usize, const P: usize, const M: usize>(
    one: &Bound<'py, PyAny>,
    other: &Bound<'py, PyAny>,
    function: impl Fn([f64; N], [f64; P]) -> [f64; M] + Sync + Send,
) -> PyResult<Array<'py>> {
    let py = one.py();
    let (ones, others) = (rows(one, "a", N)?, rows(other, "b", P)?);
    let [count, expected] = [ones.len() / N, others.len() / P];
    if count != expected {
        let message = format!("{count} and {expected} rows, expected the same number");
        return Err(PyValueError::new_err(message));
    }
    let results = py.detach(|| {
        let (ones, others) = (ones.as_chunks::<N>().0, others.as_chunks::<P>().0);
        let pairs = ones.iter().zip(others);
        pairs
            .flat_map(|(one, other)| function(*one, *other))
            .collect()
    });
    array(py, &[count, M], results)
}

fn matrix(rows: [f64; 9]) -> Matrix3<f64> {
    Matrix3::from_row_slice(&rows)
}

fn by_rows(matrix: &Matrix3<f64>) -> [f64; 9] {
    let transposed = matrix.transpose();
    std::array::from_fn(|index| transposed[index])
}

fn six_by_rows(matrix: &Matrix6<f64>) -> [f64; 36] {
    let transposed = matrix.transpose();
    std::array::from_fn(|index| transposed[index])
}

fn pose(m: [f64; 16]) -> Pose {
    Pose {
        rotation: Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]),
        translation: Vector3::new(m[3], m[7], m[11]),
    }
}

fn homogeneous(pose: &Pose) -> [f64; 16] {
    let (r, x) = (by_rows(&pose.rotation), &pose.translation);
    [
        r[0], r[1], r[2], x.x, r[3], r[4], r[5], x.y, r[6], r[7], r[8], x.z, 0.0, 0.0, 0.0, 1.0,
    ]
}

#[pyfunction]
pub(crate) fn so3_exp<'py>(vectors: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(vectors, "v", |v: [f64; 3]| by_rows(&exp(&v.into())))
}

#[pyfunction]
pub(crate) fn so3_log<'py>(rotations: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(rotations, "r", |r: [f64; 9]| log(&matrix(r)).into())
}

#[pyfunction]
pub(crate) fn so3_left_jacobian<'py>(vectors: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(vectors, "v", |v: [f64; 3]| {
        by_rows(&left_jacobian(&v.into()))
    })
}

#[pyfunction]
pub(crate) fn so3_to_quaternion<'py>(rotations: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(rotations, "r", |r: [f64; 9]| {
        let (w, u) = to_quaternion(&matrix(r));
        [u.x, u.y, u.z, w]
    })
}

#[pyfunction]
pub(crate) fn so3_from_quaternion<'py>(quaternions: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(quaternions, "q", |q: [f64; 4]| {
        by_rows(&rotation(q).unwrap_or_else(|| Matrix3::repeat(f64::NAN)))
    })
}

#[pyfunction]
pub(crate) fn se3_exp<'py>(twists: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(twists, "xi", |xi: [f64; 6]| {
        homogeneous(&Pose::exp(&Vector6::from(xi)))
    })
}

#[pyfunction]
pub(crate) fn se3_log<'py>(poses: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(poses, "t", |t: [f64; 16]| pose(t).log().into())
}

#[pyfunction]
pub(crate) fn se3_inverse<'py>(poses: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(poses, "t", |t: [f64; 16]| homogeneous(&pose(t).inverse()))
}

#[pyfunction]
pub(crate) fn se3_adjoint<'py>(poses: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(poses, "t", |t: [f64; 16]| six_by_rows(&pose(t).adjoint()))
}

#[pyfunction]
pub(crate) fn se3_left_jacobian<'py>(twists: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    each(twists, "xi", |xi: [f64; 6]| {
        six_by_rows(&Pose::left_jacobian(&Vector6::from(xi)))
    })
}

#[pyfunction]
pub(crate) fn se3_compose<'py>(
    one: &Bound<'py, PyAny>,
    other: &Bound<'py, PyAny>,
) -> PyResult<Array<'py>> {
    pairs(one, other, |one: [f64; 16], other: [f64; 16]| {
        homogeneous(&pose(one).compose(&pose(other)))
    })
}

#[pyfunction]
pub(crate) fn se3_act<'py>(
    poses: &Bound<'py, PyAny>,
    points: &Bound<'py, PyAny>,
) -> PyResult<Array<'py>> {
    pairs(poses, points, |t: [f64; 16], p: [f64; 3]| {
        pose(t).act(&p.into()).into()
    })
}
