//! States as NumPy arrays in SI, and arrays as numbers.

use lgvi_dynamics::{BodyState, Load};
use lgvi_lie::to_quaternion;
use lgvi_scene::Scene;
use nalgebra::Vector3;
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{
    AllowTypeChange, IntoPyArray, PyArrayDyn, PyArrayLike1, PyArrayLike2, PyArrayLikeDyn,
    PyUntypedArray,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// An array of any shape.
pub(crate) type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Hands numbers over as an array of this shape, without a copy.
pub(crate) fn array<'py>(
    py: Python<'py>,
    shape: &[usize],
    numbers: Vec<f64>,
) -> PyResult<Array<'py>> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), numbers);
    let array = array.map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(array.into_pyarray(py))
}

/// Vectors of all states, one after another.
fn vectors(count: usize, vectors: impl Iterator<Item = Vector3<f64>>) -> Vec<f64> {
    let mut numbers = Vec::with_capacity(3 * count);
    vectors.for_each(|vector| numbers.extend_from_slice(vector.as_slice()));
    numbers
}

/// The quantities of states: those of all bodies, then those of the next time.
pub(crate) struct States<'s> {
    pub(crate) scene: &'s Scene,
    pub(crate) states: &'s [BodyState],
}

impl States<'_> {
    /// Positions (m), inertial frame.
    pub(crate) fn positions(&self) -> Vec<f64> {
        let unit = self.scene.units.length;
        let each = self.states.iter().map(|state| state.position * unit);
        vectors(self.states.len(), each)
    }

    /// Velocities (m/s), inertial frame.
    pub(crate) fn velocities(&self) -> Vec<f64> {
        let unit = self.scene.units.length / self.scene.units.time;
        let bodies = self.scene.bodies.iter().cycle();
        let each = self.states.iter().zip(bodies);
        let each = each.map(|(state, named)| state.velocity(&named.body) * unit);
        vectors(self.states.len(), each)
    }

    /// Attitudes as quaternions x, y, z, w, body to inertial.
    pub(crate) fn quaternions(&self) -> Vec<f64> {
        let each = self.states.iter().flat_map(|state| {
            let (w, vector) = to_quaternion(&state.attitude);
            [vector.x, vector.y, vector.z, w]
        });
        each.collect()
    }

    /// Attitudes as rotation matrices by rows, body to inertial.
    pub(crate) fn rotations(&self) -> Vec<f64> {
        let mut numbers = Vec::with_capacity(9 * self.states.len());
        for state in self.states {
            numbers.extend_from_slice(state.attitude.transpose().as_slice());
        }
        numbers
    }

    /// Angular velocities (rad/s), body frame.
    pub(crate) fn rates(&self) -> Vec<f64> {
        let unit = 1.0 / self.scene.units.time;
        let bodies = self.scene.bodies.iter().cycle();
        let each = self.states.iter().zip(bodies);
        let each = each.map(|(state, named)| state.angular_velocity(&named.body) * unit);
        vectors(self.states.len(), each)
    }
}

/// Loads (N and N m): those of all bodies, then those of the next time.
pub(crate) fn forces(scene: &Scene, loads: &[Load]) -> [Vec<f64>; 2] {
    let si = || loads.iter().map(|load| scene.units.load_to_si(load));
    [
        vectors(loads.len(), si().map(|load| load.force)),
        vectors(loads.len(), si().map(|load| load.moment)),
    ]
}

/// The same, or a copy of an array whose elements are not aligned, as in packed records: its strides are no whole numbers of
/// elements.
pub(crate) fn aligned<'py>(object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    match object.cast::<PyUntypedArray>() {
        Ok(array) if !array.getattr("flags")?.get_item("ALIGNED")?.is_truthy()? => {
            array.call_method0("copy")
        }
        _ => Ok(object.clone()),
    }
}

/// Reads an array of rows of `width` numbers.
pub(crate) fn rows(object: &Bound<'_, PyAny>, name: &str, width: usize) -> PyResult<Vec<f64>> {
    let expected = || format!("`{name}`, expected an array of shape (n, {width})");
    let array: PyArrayLike2<'_, f64, AllowTypeChange> = aligned(object)?
        .extract()
        .map_err(|error| PyValueError::new_err(format!("{}: {error}", expected())))?;
    let array = array.as_array();
    if array.ncols() != width {
        let shape = array.shape();
        return Err(PyValueError::new_err(format!(
            "`{name}` has the shape {shape:?}, expected (n, {width})"
        )));
    }
    Ok(array.iter().copied().collect())
}

/// Reads an array of one dimension.
pub(crate) fn numbers(object: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let array: PyArrayLike1<'_, f64, AllowTypeChange> =
        aligned(object)?.extract().map_err(|error| {
            PyValueError::new_err(format!("`{name}`, expected an array of numbers: {error}"))
        })?;
    Ok(array.as_array().iter().copied().collect())
}

/// Reads the wrenches of bodies: an array of shape (bodies, 6), (6,) for a single body, a dictionary from names to six
/// numbers each, or None for none. Force (N, inertial frame), then moment (N m, body frame).
pub(crate) fn wrenches(scene: &Scene, object: &Bound<'_, PyAny>) -> PyResult<Vec<Option<Load>>> {
    let bodies = scene.bodies.len();
    let mut loads = vec![None; bodies];
    if object.is_none() {
        return Ok(loads);
    }
    if let Ok(dict) = object.cast::<pyo3::types::PyDict>() {
        for (name, wrench) in dict.iter() {
            let name: String = name.extract()?;
            let body = body_index(scene, &name)?;
            let wrench = numbers(&wrench, &name)?;
            let six = <[f64; 6]>::try_from(wrench.as_slice()).map_err(|_| {
                let found = wrench.len();
                PyValueError::new_err(format!("{found} numbers for {name:?}, expected 6"))
            })?;
            loads[body] = Some(load(scene, six));
        }
        return Ok(loads);
    }
    let array: PyArrayLikeDyn<'_, f64, AllowTypeChange> =
        aligned(object)?.extract().map_err(|error| {
            PyValueError::new_err(format!(
                "the wrench is no array of shape ({bodies}, 6), dict or None: {error}"
            ))
        })?;
    let array = array.as_array();
    let fits = *array.shape() == [bodies, 6] || (bodies == 1 && *array.shape() == [6]);
    if !fits {
        let shape = array.shape();
        return Err(PyValueError::new_err(format!(
            "the wrench has the shape {shape:?}, expected ({bodies}, 6)"
        )));
    }
    let all: Vec<f64> = array.iter().copied().collect();
    let (each, _) = all.as_chunks::<6>();
    for (slot, six) in loads.iter_mut().zip(each) {
        *slot = Some(load(scene, *six));
    }
    Ok(loads)
}

fn load(scene: &Scene, [fx, fy, fz, mx, my, mz]: [f64; 6]) -> Load {
    scene.units.load_from_si(&Load {
        force: Vector3::new(fx, fy, fz),
        moment: Vector3::new(mx, my, mz),
    })
}

/// The body of a name.
pub(crate) fn body_index(scene: &Scene, name: &str) -> PyResult<usize> {
    scene.body_index(name).ok_or_else(|| {
        let known: Vec<_> = scene.bodies.iter().map(|body| &*body.name).collect();
        let known = known.join(", ");
        PyValueError::new_err(format!("body {name:?}, expected one of {known}"))
    })
}
