//! A flight as `xarray.Dataset.from_dict` takes it.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::trajectory::Trajectory;

/// All arrays with their dimensions.
pub(crate) fn dataset<'py>(py: Python<'py>, flight: &Trajectory) -> PyResult<Bound<'py, PyDict>> {
    let variable = |dims: &[&str], data: Bound<'py, PyAny>| {
        let entry = PyDict::new(py);
        entry.set_item("dims", PyTuple::new(py, dims)?)?;
        entry.set_item("data", data)?;
        PyResult::Ok(entry)
    };
    let variables = PyDict::new(py);
    let of_bodies: &[&str] = &["time_s", "body", "axis"];
    let quaternions: &[&str] = &["time_s", "body", "component"];
    let rotations: &[&str] = &["time_s", "body", "axis", "body_axis"];
    let vectors: &[&str] = &["time_s", "axis"];
    for (name, dims, data) in [
        ("position_m", of_bodies, flight.position_m(py)?),
        ("velocity_m_s", of_bodies, flight.velocity_m_s(py)?),
        ("attitude_xyzw", quaternions, flight.attitude_xyzw(py)?),
        ("rotation", rotations, flight.rotation(py)?),
        (
            "angular_velocity_rad_s",
            of_bodies,
            flight.angular_velocity_rad_s(py)?,
        ),
        ("force_n", of_bodies, flight.force_n(py)?),
        ("moment_n_m", of_bodies, flight.moment_n_m(py)?),
        ("energy_j", &["time_s"], flight.energy_j(py)?),
        (
            "orthogonality_error",
            &["time_s"],
            flight.orthogonality_error(py)?,
        ),
        (
            "linear_momentum_kg_m_s",
            vectors,
            flight.linear_momentum_kg_m_s(py)?,
        ),
        (
            "angular_momentum_kg_m2_s",
            vectors,
            flight.angular_momentum_kg_m2_s(py)?,
        ),
    ] {
        variables.set_item(name, variable(dims, data)?)?;
    }
    let coordinates = PyDict::new(py);
    let wheels = flight.wheel_names();
    if !wheels.is_empty() {
        let dims: &[&str] = &["time_s", "wheel"];
        for (name, data) in [
            ("wheel_angle_rad", flight.wheel_angle_rad(py)?),
            ("wheel_speed_rad_s", flight.wheel_speed_rad_s(py)?),
            ("wheel_torque_n_m", flight.wheel_torque_n_m(py)?),
        ] {
            variables.set_item(name, variable(dims, data)?)?;
        }
        let names = PyList::new(py, wheels)?.into_any();
        coordinates.set_item("wheel", variable(&["wheel"], names)?)?;
    }
    let names = |names: &[&str]| PyResult::Ok(PyList::new(py, names)?.into_any());
    let bodies: Vec<_> = flight.scene.bodies.iter().map(|body| &*body.name).collect();
    for (name, data) in [
        ("time_s", flight.time_s(py)?),
        ("body", names(&bodies)?),
        ("axis", names(&["x", "y", "z"])?),
        ("body_axis", names(&["x", "y", "z"])?),
        ("component", names(&["x", "y", "z", "w"])?),
    ] {
        coordinates.set_item(name, variable(&[name], data)?)?;
    }
    let attributes = PyDict::new(py);
    attributes.set_item("title", &flight.scene.title)?;
    attributes.set_item("frame", &flight.scene.frame)?;
    let dataset = PyDict::new(py);
    dataset.set_item("coords", coordinates)?;
    dataset.set_item("data_vars", variables)?;
    dataset.set_item("attrs", attributes)?;
    Ok(dataset)
}
