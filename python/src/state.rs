//! The state of all bodies at one time.

use std::sync::Arc;

use lgvi_dynamics::BodyState;
use lgvi_propagator::Flight;
use lgvi_scene::Scene;
use pyo3::prelude::*;

use crate::arrays::{Array, States, read_only};

/// The states of all bodies of a scene at one time. Arrays are made when they are asked for, and read-only.
///
/// Bodies are in the order of `Scene.bodies`.
#[pyclass(frozen, module = "lgvi")]
pub(crate) struct State {
    pub(crate) scene: Arc<Scene>,
    pub(crate) step: Option<u64>,
    /// (s)
    pub(crate) time: f64,
    pub(crate) states: Vec<BodyState>,
}

impl State {
    /// That of a flight now.
    pub(crate) fn of(scene: &Arc<Scene>, flight: &Flight) -> Self {
        Self {
            scene: Arc::clone(scene),
            step: Some(flight.step()),
            time: scene.seconds(flight.step()),
            states: flight.states().to_vec(),
        }
    }

    fn all(&self) -> States<'_> {
        States {
            scene: &self.scene,
            states: &self.states,
        }
    }

    fn shaped<'py>(
        &self,
        py: Python<'py>,
        shape: &[usize],
        numbers: PyResult<Vec<f64>>,
    ) -> PyResult<Array<'py>> {
        let shape: Vec<_> = [&[self.states.len()], shape].concat();
        read_only(py, &shape, numbers?)
    }
}

#[pymethods]
impl State {
    /// Steps made; None between two steps.
    #[getter]
    fn step(&self) -> Option<u64> {
        self.step
    }

    /// Time since the start of the run (s); NaN in a force, which has no time.
    #[getter]
    fn time_s(&self) -> f64 {
        self.time
    }

    /// Centers of mass (m), inertial frame, shape (bodies, 3).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.shaped(py, &[3], self.all().positions())
    }

    /// Velocities of the centers of mass (m/s), inertial frame, shape (bodies, 3).
    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.shaped(py, &[3], self.all().velocities())
    }

    /// Attitudes as unit quaternions x, y, z, w from the body frame to the inertial one, shape (bodies, 4).
    #[getter]
    fn attitude_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.shaped(py, &[4], self.all().quaternions())
    }

    /// Attitudes as rotation matrices from the body frame to the inertial one, shape (bodies, 3, 3).
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.shaped(py, &[3, 3], self.all().rotations())
    }

    /// Angular velocities (rad/s), body frame, shape (bodies, 3).
    #[getter]
    fn angular_velocity_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        self.shaped(py, &[3], self.all().rates())
    }

    fn __repr__(&self) -> String {
        let (bodies, time) = (self.states.len(), self.time);
        format!("State(time_s={time}, bodies={bodies})")
    }
}
