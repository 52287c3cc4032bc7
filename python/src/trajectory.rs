//! A flight that has been made.

use std::sync::Arc;

use lgvi_dynamics::docking::Docked;
use lgvi_dynamics::{BodyState, Invariants, Load};
use lgvi_scene::Scene;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::actuators::Actuators;
use crate::arrays::{States, flat, forces, moments, read_only};
use crate::dataset::dataset;
use crate::state::State;

/// What has been kept of a flight, in the scene's units.
#[derive(Default)]
pub(crate) struct Samples {
    /// (s)
    pub(crate) times: Vec<f64>,
    /// Of all bodies, sample by sample.
    pub(crate) states: Vec<BodyState>,
    /// What acted in the step before each sample; of all bodies, sample by sample.
    pub(crate) loads: Vec<Load>,
    pub(crate) actuators: Actuators,
    pub(crate) docked: Vec<Docked>,
}

/// A flight: states of all bodies at n times, as NumPy arrays in SI.
///
/// Each array is made when it is first asked for. It is the same object each time, and read-only. Bodies
/// are in the order of `bodies`. The inertial frame is that of the scene, called `frame`.
#[pyclass(frozen, module = "lgvi")]
pub(crate) struct Trajectory {
    pub(crate) scene: Arc<Scene>,
    pub(crate) samples: Samples,
    arrays: [PyOnceLock<Py<PyAny>>; ARRAYS],
}

/// Number of arrays.
const ARRAYS: usize = Kept::WheelTorque as usize + 1;

/// The arrays, in the order in which they are kept.
#[derive(Clone, Copy)]
pub(crate) enum Kept {
    Time,
    Position,
    Velocity,
    Attitude,
    Rotation,
    Rate,
    Energy,
    LinearMomentum,
    AngularMomentum,
    Force,
    Moment,
    Orthogonality,
    WheelAngle,
    WheelSpeed,
    WheelTorque,
}

impl Trajectory {
    pub(crate) fn new(scene: Arc<Scene>, samples: Samples) -> Self {
        Self {
            scene,
            samples,
            arrays: [const { PyOnceLock::new() }; ARRAYS],
        }
    }

    fn all(&self) -> States<'_> {
        States {
            scene: &self.scene,
            states: &self.samples.states,
        }
    }

    /// The array, made at the first call. Its shape begins with the number of times, and of bodies if it has one of each.
    pub(crate) fn kept<'py>(
        &self,
        py: Python<'py>,
        kept: Kept,
        of_bodies: bool,
        shape: &[usize],
        make: impl FnOnce(&Self) -> PyResult<Vec<f64>> + Send,
    ) -> PyResult<Bound<'py, PyAny>> {
        let slot = &self.arrays[kept as usize];
        let made = slot.get_or_try_init(py, || -> PyResult<Py<PyAny>> {
            let numbers = py.detach(|| make(self))?;
            let bodies = self.scene.bodies.len();
            let mut whole = vec![self.samples.times.len()];
            whole.extend(of_bodies.then_some(bodies));
            whole.extend_from_slice(shape);
            Ok(read_only(py, &whole, numbers)?.into_any().unbind())
        });
        Ok(made?.bind(py).clone())
    }

    /// The invariants of all samples, in the scene's units.
    fn invariants<const N: usize>(
        &self,
        of: impl Fn(&Invariants) -> [f64; N],
    ) -> PyResult<Vec<f64>> {
        let mut system = self.scene.system();
        let each = self.samples.states.chunks(self.scene.bodies.len());
        flat(each.enumerate().map(|(sample, states)| {
            self.samples.actuators.set(&mut system, sample);
            of(&Invariants::of(&system, states))
        }))
    }
}

#[pymethods]
impl Trajectory {
    /// Names of the bodies.
    #[getter]
    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.scene.bodies.iter().map(|body| &body.name))
    }

    /// Name of the inertial frame.
    #[getter]
    fn frame(&self) -> &str {
        &self.scene.frame
    }

    /// Times since the start of the run (s), shape (n,).
    #[getter]
    pub(crate) fn time_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Time, false, &[], |it| {
            flat(it.samples.times.iter().map(|time| [*time]))
        })
    }

    /// Centers of mass (m), inertial frame, shape (n, bodies, 3).
    #[getter]
    pub(crate) fn position_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Position, true, &[3], |it| it.all().positions())
    }

    /// Velocities of the centers of mass (m/s), inertial frame, shape (n, bodies, 3).
    #[getter]
    pub(crate) fn velocity_m_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Velocity, true, &[3], |it| it.all().velocities())
    }

    /// Attitudes as unit quaternions x, y, z, w from the body frame to the inertial one, shape (n, bodies, 4).
    #[getter]
    pub(crate) fn attitude_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Attitude, true, &[4], |it| it.all().quaternions())
    }

    /// Attitudes as rotation matrices from the body frame to the inertial one, shape (n, bodies, 3, 3).
    #[getter]
    pub(crate) fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Rotation, true, &[3, 3], |it| it.all().rotations())
    }

    /// Angular velocities (rad/s), body frame, shape (n, bodies, 3).
    #[getter]
    pub(crate) fn angular_velocity_rad_s<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Rate, true, &[3], |it| it.all().rates())
    }

    /// Forces of the controls (N), inertial frame, held over the step before each time, shape (n, bodies, 3). Zero at the
    /// start.
    #[getter]
    pub(crate) fn force_n<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Force, true, &[3], |it| {
            forces(&it.scene, &it.samples.loads)
        })
    }

    /// Moments of the controls (N m), body frame, held over the step before each time, shape (n, bodies, 3). Zero at the
    /// start.
    #[getter]
    pub(crate) fn moment_n_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Moment, true, &[3], |it| {
            moments(&it.scene, &it.samples.loads)
        })
    }

    /// Sum of kinetic and potential energy of all bodies (J), shape (n,). Forces of `force=` have no part in it.
    #[getter]
    pub(crate) fn energy_j<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Energy, false, &[], |it| {
            let unit = it.scene.units.energy();
            it.invariants(|invariants| [invariants.energy * unit])
        })
    }

    /// Total linear momentum (kg m/s), inertial frame, shape (n, 3).
    #[getter]
    pub(crate) fn linear_momentum_kg_m_s<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::LinearMomentum, false, &[3], |it| {
            let unit = it.scene.units.momentum();
            it.invariants(|invariants| (invariants.linear_momentum * unit).into())
        })
    }

    /// Total angular momentum about the origin (kg m²/s), inertial frame, shape (n, 3).
    #[getter]
    pub(crate) fn angular_momentum_kg_m2_s<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::AngularMomentum, false, &[3], |it| {
            let unit = it.scene.units.angular_momentum();
            it.invariants(|invariants| (invariants.angular_momentum * unit).into())
        })
    }

    /// Largest Frobenius norm of RᵀR − I over the bodies, shape (n,).
    #[getter]
    pub(crate) fn orthogonality_error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Orthogonality, false, &[], |it| {
            it.invariants(|invariants| [invariants.orthogonality_error])
        })
    }

    /// Names of the reaction wheels, as `<body>.<wheel>`, body by body.
    #[getter]
    fn wheels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.wheel_names())
    }

    /// Angles by which the wheels have turned relative to their bodies since the start (rad), shape (n, wheels).
    #[getter]
    pub(crate) fn wheel_angle_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.of_wheels(py, Kept::WheelAngle, |wheel| wheel.angle)
    }

    /// Speeds of the wheels relative to their bodies (rad/s), shape (n, wheels).
    #[getter]
    pub(crate) fn wheel_speed_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.wheel_speeds(py)
    }

    /// Torques on the wheels by motors and friction over the step before each time (N m), shape (n, wheels). Zero at the start.
    #[getter]
    pub(crate) fn wheel_torque_n_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let unit = self.scene.units.energy();
        self.of_wheels(py, Kept::WheelTorque, move |wheel| wheel.torque * unit)
    }

    /// The dockings of the flight, in their order: dicts of `bodies` (two names), `time_s` and `energy_loss_j`.
    #[getter]
    fn docked<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let each = self.samples.docked.iter().map(|docked| {
            let ports = self.scene.docking[docked.docking].ports;
            let bodies = ports.map(|port| self.scene.body_name(port.body));
            let entry = PyDict::new(py);
            entry.set_item("bodies", PyTuple::new(py, bodies)?)?;
            entry.set_item("time_s", self.scene.seconds(docked.step))?;
            let loss = docked.energy_loss * self.scene.units.energy();
            entry.set_item("energy_loss_j", loss)?;
            Ok(entry)
        });
        PyList::new(py, each.collect::<PyResult<Vec<_>>>()?)
    }

    /// All arrays and their dimensions, as `xarray.Dataset.from_dict` takes them.
    ///
    /// Coordinates are `time_s`, `body`, `axis` and `body_axis` (x, y, z), `component` (x, y, z, w), and `wheel` where bodies have
    /// reaction wheels.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        dataset(py, self)
    }

    /// The state at a sample, counted from 0, from the end if it is negative.
    fn state(&self, index: isize) -> PyResult<State> {
        let count = self.samples.times.len();
        let position = if index < 0 {
            count.checked_add_signed(index)
        } else {
            usize::try_from(index).ok()
        };
        let position = position.filter(|position| *position < count);
        let position = position.ok_or_else(|| {
            PyIndexError::new_err(format!("sample {index}, expected one of {count}"))
        })?;
        let bodies = self.scene.bodies.len();
        let time = self.samples.times[position];
        let step = (time / self.scene.seconds(1)).round() as u64;
        Ok(State {
            scene: Arc::clone(&self.scene),
            step: Some(step).filter(|step| self.scene.seconds(*step) == time),
            time,
            states: self.samples.states[position * bodies..][..bodies].to_vec(),
        })
    }

    fn __len__(&self) -> usize {
        self.samples.times.len()
    }

    fn __repr__(&self) -> String {
        let (samples, bodies) = (self.samples.times.len(), self.scene.bodies.len());
        let end = self.samples.times.last().copied().unwrap_or(0.0);
        format!("Trajectory({samples} samples of {bodies} bodies to {end} s)")
    }
}
