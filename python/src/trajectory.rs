//! A flight that has been made.

use std::sync::Arc;

use lgvi_dynamics::ActuatorStates;
use lgvi_dynamics::docking::Docked;
use lgvi_dynamics::{BodyState, Invariants, Load};
use lgvi_scene::Scene;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList, PyTuple};

use crate::arrays::{States, array, forces};
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
    /// Sample by sample; none where no body has actuators.
    pub(crate) actuators: Vec<ActuatorStates>,
    pub(crate) docked: Vec<Docked>,
}

/// A flight: states of all bodies at n times, as NumPy arrays in SI.
///
/// Each array is made when it is first asked for. It is the same object each time, and read-only. Bodies
/// are in the order of `bodies`. The inertial frame is that of the scene, called `frame`.
#[pyclass(frozen, module = "lgvi")]
pub(crate) struct Trajectory {
    scene: Arc<Scene>,
    samples: Samples,
    arrays: [PyOnceLock<Py<PyAny>>; ARRAYS],
}

/// Number of arrays.
const ARRAYS: usize = Kept::Orthogonality as usize + 1;

/// The arrays, in the order in which they are kept.
#[derive(Clone, Copy)]
enum Kept {
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
    fn kept<'py>(
        &self,
        py: Python<'py>,
        kept: Kept,
        of_bodies: bool,
        shape: &[usize],
        make: impl FnOnce(&Self) -> Vec<f64> + Send,
    ) -> PyResult<Bound<'py, PyAny>> {
        let slot = &self.arrays[kept as usize];
        let made = slot.get_or_try_init(py, || -> PyResult<Py<PyAny>> {
            let numbers = py.detach(|| make(self));
            let bodies = self.scene.bodies.len();
            let mut whole = vec![self.samples.times.len()];
            whole.extend(of_bodies.then_some(bodies));
            whole.extend_from_slice(shape);
            let array = array(py, &whole, numbers)?;
            let read_only = PyDict::new(py);
            read_only.set_item("write", false)?;
            array.call_method("setflags", (), Some(&read_only))?;
            Ok(array.into_any().unbind())
        });
        Ok(made?.bind(py).clone())
    }

    /// The invariants of all samples, in the scene's units.
    fn invariants<const N: usize>(&self, of: impl Fn(&Invariants) -> [f64; N]) -> Vec<f64> {
        let mut system = self.scene.system();
        let mut actuators = self.samples.actuators.iter();
        let each = self.samples.states.chunks(self.scene.bodies.len());
        let each = each.flat_map(|states| {
            if let Some(states) = actuators.next() {
                system.set_actuator_states(states);
            }
            of(&Invariants::of(&system, states))
        });
        each.collect()
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
    fn time_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Time, false, &[], |it| it.samples.times.clone())
    }

    /// Centers of mass (m), inertial frame, shape (n, bodies, 3).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Position, true, &[3], |it| it.all().positions())
    }

    /// Velocities of the centers of mass (m/s), inertial frame, shape (n, bodies, 3).
    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Velocity, true, &[3], |it| it.all().velocities())
    }

    /// Attitudes as unit quaternions x, y, z, w from the body frame to the inertial one, shape (n, bodies, 4).
    #[getter]
    fn attitude_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Attitude, true, &[4], |it| it.all().quaternions())
    }

    /// Attitudes as rotation matrices from the body frame to the inertial one, shape (n, bodies, 3, 3).
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Rotation, true, &[3, 3], |it| it.all().rotations())
    }

    /// Angular velocities (rad/s), body frame, shape (n, bodies, 3).
    #[getter]
    fn angular_velocity_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Rate, true, &[3], |it| it.all().rates())
    }

    /// Forces of the controls (N), inertial frame, held over the step before each time, shape (n, bodies, 3). Zero at the
    /// start.
    #[getter]
    fn force_n<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Force, true, &[3], |it| {
            let [force, _] = forces(&it.scene, &it.samples.loads);
            force
        })
    }

    /// Moments of the controls (N m), body frame, held over the step before each time, shape (n, bodies, 3). Zero at the
    /// start.
    #[getter]
    fn moment_n_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Moment, true, &[3], |it| {
            let [_, moment] = forces(&it.scene, &it.samples.loads);
            moment
        })
    }

    /// Sum of kinetic and potential energy of all bodies (J), shape (n,). Forces of `force=` have no part in it.
    #[getter]
    fn energy_j<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Energy, false, &[], |it| {
            let unit = it.scene.units.energy();
            it.invariants(|invariants| [invariants.energy * unit])
        })
    }

    /// Total linear momentum (kg m/s), inertial frame, shape (n, 3).
    #[getter]
    fn linear_momentum_kg_m_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::LinearMomentum, false, &[3], |it| {
            let unit = it.scene.units.momentum();
            it.invariants(|invariants| (invariants.linear_momentum * unit).into())
        })
    }

    /// Total angular momentum about the origin (kg m²/s), inertial frame, shape (n, 3).
    #[getter]
    fn angular_momentum_kg_m2_s<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::AngularMomentum, false, &[3], |it| {
            let unit = it.scene.units.angular_momentum();
            it.invariants(|invariants| (invariants.angular_momentum * unit).into())
        })
    }

    /// Largest Frobenius norm of RᵀR − I over the bodies, shape (n,).
    #[getter]
    fn orthogonality_error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, Kept::Orthogonality, false, &[], |it| {
            it.invariants(|invariants| [invariants.orthogonality_error])
        })
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
    /// Coordinates are `time_s`, `body`, `axis` and `body_axis` (x, y, z), and `component` (x, y, z, w).
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
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
            ("position_m", of_bodies, self.position_m(py)?),
            ("velocity_m_s", of_bodies, self.velocity_m_s(py)?),
            ("attitude_xyzw", quaternions, self.attitude_xyzw(py)?),
            ("rotation", rotations, self.rotation(py)?),
            (
                "angular_velocity_rad_s",
                of_bodies,
                self.angular_velocity_rad_s(py)?,
            ),
            ("force_n", of_bodies, self.force_n(py)?),
            ("moment_n_m", of_bodies, self.moment_n_m(py)?),
            ("energy_j", &["time_s"], self.energy_j(py)?),
            (
                "orthogonality_error",
                &["time_s"],
                self.orthogonality_error(py)?,
            ),
            (
                "linear_momentum_kg_m_s",
                vectors,
                self.linear_momentum_kg_m_s(py)?,
            ),
            (
                "angular_momentum_kg_m2_s",
                vectors,
                self.angular_momentum_kg_m2_s(py)?,
            ),
        ] {
            variables.set_item(name, variable(dims, data)?)?;
        }
        let coordinates = PyDict::new(py);
        let names = |names: &[&str]| PyResult::Ok(PyList::new(py, names)?.into_any());
        let bodies: Vec<_> = self.scene.bodies.iter().map(|body| &*body.name).collect();
        for (name, data) in [
            ("time_s", self.time_s(py)?),
            ("body", names(&bodies)?),
            ("axis", names(&["x", "y", "z"])?),
            ("body_axis", names(&["x", "y", "z"])?),
            ("component", names(&["x", "y", "z", "w"])?),
        ] {
            coordinates.set_item(name, variable(&[name], data)?)?;
        }
        let attributes = PyDict::new(py);
        attributes.set_item("title", &self.scene.title)?;
        attributes.set_item("frame", &self.scene.frame)?;
        let dataset = PyDict::new(py);
        dataset.set_item("coords", coordinates)?;
        dataset.set_item("data_vars", variables)?;
        dataset.set_item("attrs", attributes)?;
        Ok(dataset)
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
