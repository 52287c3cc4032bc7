//! States as NumPy arrays in SI, and arrays as numbers.

use lgvi_dynamics::{BodyState, Load, RigidBody};
use lgvi_lie::to_quaternion;
use lgvi_scene::Scene;
use nalgebra::{Matrix3, Vector3};
use numpy::ndarray::{ArrayD, ArrayViewD, IxDyn};
use numpy::{IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;

/// An array of any shape.
pub(crate) type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Hands numbers over as an array of this shape, without a copy. It is the caller's to change.
pub(crate) fn array<'py>(
    py: Python<'py>,
    shape: &[usize],
    numbers: Vec<f64>,
) -> PyResult<Array<'py>> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), numbers);
    let array = array.map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(array.into_pyarray(py))
}

/// The same, but it cannot be changed: it belongs to an object that does not change either.
pub(crate) fn read_only<'py>(
    py: Python<'py>,
    shape: &[usize],
    numbers: Vec<f64>,
) -> PyResult<Array<'py>> {
    let array = array(py, shape, numbers)?;
    array.try_readwrite()?.make_nonwriteable();
    Ok(array)
}

/// An empty vector with room for so many elements, or a `MemoryError`. An array of NumPy whose strides are 0 may have more
/// elements than there is memory.
pub(crate) fn room<T>(count: usize) -> PyResult<Vec<T>> {
    let mut elements = Vec::new();
    elements.try_reserve_exact(count).map_err(|_| {
        let size = size_of::<T>();
        PyMemoryError::new_err(format!(
            "{count} elements of {size} bytes do not fit into memory"
        ))
    })?;
    Ok(elements)
}

/// The elements of an array by rows, or a `MemoryError`.
fn elements(array: ArrayViewD<'_, f64>) -> PyResult<Vec<f64>> {
    let mut elements = room(array.len())?;
    elements.extend(array.iter());
    Ok(elements)
}

/// So many numbers of each thing, one after another, or a `MemoryError`.
pub(crate) fn flat<const N: usize>(
    each: impl ExactSizeIterator<Item = [f64; N]>,
) -> PyResult<Vec<f64>> {
    let mut numbers = room(each.len().saturating_mul(N))?;
    each.for_each(|own| numbers.extend_from_slice(&own));
    Ok(numbers)
}

/// The quantities of states: those of all bodies, then those of the next time.
pub(crate) struct States<'s> {
    pub(crate) scene: &'s Scene,
    pub(crate) states: &'s [BodyState],
}

impl States<'_> {
    /// Positions (m), inertial frame.
    pub(crate) fn positions(&self) -> PyResult<Vec<f64>> {
        let unit = self.scene.units.length;
        flat::<3>(self.each(|_, state| (state.position * unit).into()))
    }

    /// Velocities (m/s), inertial frame.
    pub(crate) fn velocities(&self) -> PyResult<Vec<f64>> {
        let unit = self.scene.units.length / self.scene.units.time;
        flat::<3>(self.each(|body, state| (state.velocity(body) * unit).into()))
    }

    /// Attitudes as unit quaternions x, y, z, w, body to inertial.
    pub(crate) fn quaternions(&self) -> PyResult<Vec<f64>> {
        flat(self.each(|_, state| {
            let (w, u) = to_quaternion(&state.attitude);
            // An integrator that leaves SO(3) leaves the unit sphere.
            let norm = (w * w + u.norm_squared()).sqrt();
            [u.x, u.y, u.z, w].map(|component| component / norm)
        }))
    }

    /// Attitudes as rotation matrices by rows, body to inertial.
    pub(crate) fn rotations(&self) -> PyResult<Vec<f64>> {
        flat(self.each(|_, state| by_rows(&state.attitude)))
    }

    /// Angular velocities (rad/s), body frame.
    pub(crate) fn rates(&self) -> PyResult<Vec<f64>> {
        let unit = 1.0 / self.scene.units.time;
        flat::<3>(self.each(|body, state| (state.angular_velocity(body) * unit).into()))
    }

    fn each<const N: usize>(
        &self,
        numbers: impl Fn(&RigidBody, &BodyState) -> [f64; N],
    ) -> impl ExactSizeIterator<Item = [f64; N]> {
        let bodies = &self.scene.bodies;
        let each = self.states.iter().enumerate();
        each.map(move |(index, state)| numbers(&bodies[index % bodies.len()].body, state))
    }
}

/// The elements of a matrix by rows.
pub(crate) fn by_rows(matrix: &Matrix3<f64>) -> [f64; 9] {
    let transposed = matrix.transpose();
    std::array::from_fn(|index| transposed[index])
}

/// Forces (N): those of all bodies, then those of the next time.
pub(crate) fn forces(scene: &Scene, loads: &[Load]) -> PyResult<Vec<f64>> {
    let each = loads.iter().map(|load| scene.units.load_to_si(load));
    flat::<3>(each.map(|load| load.force.into()))
}

/// Moments (N m): those of all bodies, then those of the next time.
pub(crate) fn moments(scene: &Scene, loads: &[Load]) -> PyResult<Vec<f64>> {
    let each = loads.iter().map(|load| scene.units.load_to_si(load));
    flat::<3>(each.map(|load| load.moment.into()))
}

/// Reads an array of real numbers, which is copied if NumPy has them in another type or order of bytes, or not aligned. A copy
/// that does not fit into memory is a `MemoryError`.
pub(crate) fn real<'py>(
    object: &Bound<'py, PyAny>,
    name: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    if let Ok(array) = object.cast::<PyArrayDyn<f64>>()
        && array.getattr("flags")?.get_item("ALIGNED")?.is_truthy()?
    {
        return Ok(array.try_readonly()?);
    }
    let py = object.py();
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (object,)).map_err(|error| {
        let refused =
            error.is_instance_of::<PyTypeError>(py) || error.is_instance_of::<PyValueError>(py);
        match refused {
            true => PyValueError::new_err(format!("`{name}` is no array of numbers: {error}")),
            false => error,
        }
    })?;
    let dtype = array.getattr("dtype")?;
    if !"biuf".contains(&dtype.getattr("kind")?.extract::<String>()?) {
        return Err(PyValueError::new_err(format!(
            "`{name}` has the type {dtype}, expected real numbers"
        )));
    }
    let array = numpy.call_method1("require", (array, "float64", "A"))?;
    Ok(array.cast::<PyArrayDyn<f64>>()?.try_readonly()?)
}

/// An array of another shape.
pub(crate) fn misshapen(array: &ArrayViewD<'_, f64>, name: &str, expected: &str) -> PyErr {
    let shape = array.shape();
    PyValueError::new_err(format!(
        "`{name}` has the shape {shape:?}, expected {expected}"
    ))
}

/// Reads an array of rows of `width` numbers.
pub(crate) fn rows(object: &Bound<'_, PyAny>, name: &str, width: usize) -> PyResult<Vec<f64>> {
    let array = real(object, name)?;
    let array = array.as_array();
    match array.shape() {
        [_, found] if *found == width => elements(array),
        _ => Err(misshapen(&array, name, &format!("(n, {width})"))),
    }
}

/// Reads an array of one dimension.
pub(crate) fn numbers(object: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let array = real(object, name)?;
    let array = array.as_array();
    match array.shape() {
        [_] => elements(array),
        _ => Err(misshapen(&array, name, "(n,)")),
    }
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
    let array = real(object, "wrench")?;
    let array = array.as_array();
    let fits = *array.shape() == [bodies, 6] || (bodies == 1 && *array.shape() == [6]);
    if !fits {
        return Err(misshapen(&array, "wrench", &format!("({bodies}, 6)")));
    }
    let all = elements(array)?;
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
