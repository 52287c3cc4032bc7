//! Gravity on plain arrays.

use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::Scene;
use nalgebra::Vector3;
use numpy::{AllowTypeChange, PyArrayLike3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{aligned, array, forces};
use crate::lie::rotation;

/// Evaluates gravity on the scene's bodies: forces, moments and potentials, in SI.
pub(crate) fn evaluate<'py>(
    py: Python<'py>,
    scene: &Scene,
    position: &Bound<'py, PyAny>,
    attitude: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyTuple>> {
    let bodies = scene.bodies.len();
    let position = blocks::<3>(position, "position_m", bodies)?;
    let attitude = blocks::<4>(attitude, "attitude_xyzw", bodies)?;
    if position.len() != attitude.len() {
        let [positions, attitudes] = [position.len(), attitude.len()].map(|count| count / bodies);
        return Err(PyValueError::new_err(format!(
            "`position_m` has {positions} times and `attitude_xyzw` {attitudes}, expected the same number"
        )));
    }
    let each = position.iter().zip(&attitude).enumerate();
    let states = each.map(|(index, (position, attitude))| {
        let attitude = rotation(*attitude).ok_or_else(|| {
            let (time, body) = (index / bodies, index % bodies);
            PyValueError::new_err(format!(
                "`attitude_xyzw[{time}, {body}]` is {attitude:?}, expected four finite numbers, not all 0"
            ))
        })?;
        Ok(BodyState {
            position: Vector3::from(*position) / scene.units.length,
            linear_momentum: Vector3::zeros(),
            attitude,
            angular_momentum: Vector3::zeros(),
        })
    });
    let states = states.collect::<PyResult<Vec<_>>>()?;
    let (loads, potentials) = py.detach(|| {
        let mut system = scene.system();
        let mut loads = vec![Load::default(); states.len()];
        let mut potentials = Vec::with_capacity(states.len() / bodies);
        for (states, loads) in states.chunks(bodies).zip(loads.chunks_mut(bodies)) {
            system.loads(states, loads);
            potentials.push(system.potential(states) * scene.units.energy());
        }
        (loads, potentials)
    });
    let [force, moment] = forces(scene, &loads);
    let times = potentials.len();
    let parts = [
        array(py, &[times, bodies, 3], force)?,
        array(py, &[times, bodies, 3], moment)?,
        array(py, &[times], potentials)?,
    ];
    PyTuple::new(py, parts)
}

/// Reads an array of shape (n, bodies, N).
fn blocks<const N: usize>(
    object: &Bound<'_, PyAny>,
    name: &str,
    bodies: usize,
) -> PyResult<Vec<[f64; N]>> {
    let array: PyArrayLike3<'_, f64, AllowTypeChange> =
        aligned(object)?.extract().map_err(|error| {
            PyValueError::new_err(format!(
                "`{name}`, expected an array of shape (n, {bodies}, {N}): {error}"
            ))
        })?;
    let array = array.as_array();
    if array.shape()[1..] != [bodies, N] {
        let shape = array.shape();
        return Err(PyValueError::new_err(format!(
            "`{name}` has the shape {shape:?}, expected (n, {bodies}, {N})"
        )));
    }
    let numbers: Vec<f64> = array.iter().copied().collect();
    Ok(numbers.as_chunks::<N>().0.to_vec())
}
