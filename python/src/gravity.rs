//! Gravity on plain arrays.

use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::Scene;
use nalgebra::Vector3;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{array, misshapen, real, room};
use crate::error;
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
    let mut rotations = room(attitude.len())?;
    for (index, attitude) in attitude.iter().enumerate() {
        let rotation = rotation(*attitude).map_err(|defect| {
            let (time, body) = (index / bodies, index % bodies);
            error::rotation(py, &format!("`attitude_xyzw[{time}, {body}]`"), &defect)
        })?;
        rotations.push(rotation);
    }
    let times = position.len() / bodies;
    let [mut force, mut moment] = [room(3 * position.len())?, room(3 * position.len())?];
    let mut potential = room(times)?;
    py.detach(|| {
        let mut system = scene.system();
        let mut states = Vec::with_capacity(bodies);
        let mut loads = vec![Load::default(); bodies];
        for (positions, rotations) in position.chunks(bodies).zip(rotations.chunks(bodies)) {
            states.clear();
            let each = positions.iter().zip(rotations);
            states.extend(each.map(|(position, rotation)| BodyState {
                position: Vector3::from(*position) / scene.units.length,
                linear_momentum: Vector3::zeros(),
                attitude: *rotation,
                angular_momentum: Vector3::zeros(),
            }));
            loads.fill(Load::default());
            system.loads(&states, &mut loads);
            for load in &loads {
                let load = scene.units.load_to_si(load);
                force.extend(load.force.iter());
                moment.extend(load.moment.iter());
            }
            potential.push(system.potential(&states) * scene.units.energy());
        }
    });
    let parts = [
        array(py, &[times, bodies, 3], force)?,
        array(py, &[times, bodies, 3], moment)?,
        array(py, &[times], potential)?,
    ];
    PyTuple::new(py, parts)
}

/// Reads an array of shape (n, bodies, N).
fn blocks<const N: usize>(
    object: &Bound<'_, PyAny>,
    name: &str,
    bodies: usize,
) -> PyResult<Vec<[f64; N]>> {
    let array = real(object, name)?;
    let array = array.as_array();
    if !matches!(array.shape(), [_, count, width] if [*count, *width] == [bodies, N]) {
        return Err(misshapen(&array, name, &format!("(n, {bodies}, {N})")));
    }
    let mut blocks = room(array.len() / N)?;
    for block in array.rows() {
        blocks.push(std::array::from_fn(|index| block[index]));
    }
    Ok(blocks)
}
