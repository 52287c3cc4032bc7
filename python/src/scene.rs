//! Scenes.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use lgvi_common::KeyError;
use lgvi_dynamics::auto::{Choice, ChoiceError};
use lgvi_review::{Explanation, SCENES, Unusable, choose, decided};
use lgvi_scene::{self as scene, SceneError, Scheme};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping, PyTuple};

use crate::arrays::numbers;
use crate::controls::Commands;
use crate::flight::{Flown, outputs};
use crate::plan::Plan;
use crate::simulation::Simulation;
use crate::trajectory::Trajectory;
use crate::watch::Watch;
use crate::{ensemble, error, gravity, sweep, toml_value};

/// What is flown: bodies, gravity, integrator, and perhaps a maneuver and the dispersions of an ensemble.
///
/// Made by `Scene.load`, `Scene.from_toml`, `Scene.from_dict` or `lgvi.rigid_bodies`. It does not change: `with_values`
/// returns another one.
#[pyclass(frozen, module = "lgvi", name = "Scene")]
pub(crate) struct Scene {
    scene: Arc<scene::Scene>,
    /// The file that it came from.
    file: Option<PathBuf>,
    /// The scene with the choice of an automatic integrator, and what flies it.
    ready: OnceLock<(Arc<scene::Scene>, Scheme)>,
}

/// Why a scene has no such values.
pub(crate) enum Refused {
    /// A key cannot be set.
    Key(KeyError),
    /// The scene with them cannot be flown.
    Scene(SceneError),
}

impl Scene {
    pub(crate) fn new(scene: scene::Scene, file: Option<PathBuf>) -> Self {
        Self {
            scene: Arc::new(scene),
            file,
            ready: OnceLock::new(),
        }
    }

    /// The file that it came from.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// The scene with other values of some keys, which are texts of TOML.
    pub(crate) fn compiled(&self, settings: &[(String, String)]) -> Result<scene::Scene, Refused> {
        let mut text = self.scene.text.clone();
        for (key, value) in settings {
            text = lgvi_common::set_key(&text, key, value).map_err(Refused::Key)?;
        }
        scene::Scene::parse(&self.scene.name, &text).map_err(Refused::Scene)
    }

    /// Parses a text.
    fn parse(py: Python<'_>, name: &str, text: &str, file: Option<PathBuf>) -> PyResult<Self> {
        let parsed = py.detach(|| scene::Scene::parse(name, text));
        match parsed {
            Ok(parsed) => Ok(Self::new(parsed, file)),
            Err(error) => Err(error::scene(py, file.as_deref(), &error)),
        }
    }

    /// The choice of an automatic integrator, unless the scene has it.
    fn choice(&self, py: Python<'_>) -> PyResult<Option<Choice>> {
        let mut watch = Watch::new(None);
        let choice = py.detach(|| choose(&self.scene, &mut |part| watch.go_on(part)));
        match choice {
            Ok(choice) => watch.end(py).map(|()| choice),
            Err(ChoiceError::Interrupted) => Err(watch
                .end(py)
                .err()
                .unwrap_or_else(|| error::unfit(py, ChoiceError::Interrupted))),
            Err(error) => Err(error::unfit(py, error)),
        }
    }

    /// The scene as it is flown, and what flies it. Found out at the first call.
    pub(crate) fn ready(&self, py: Python<'_>) -> PyResult<&(Arc<scene::Scene>, Scheme)> {
        if let Some(ready) = self.ready.get() {
            return Ok(ready);
        }
        let scene = match self.choice(py)? {
            None => Arc::clone(&self.scene),
            Some(choice) => {
                let decided = decided(scene::Scene::clone(&self.scene), Some(&choice));
                Arc::new(decided.map_err(|error| error::scene(py, None, &error))?)
            }
        };
        let scheme = py.detach(|| scene.scheme());
        let scheme = scheme.map_err(|error| error::unfit(py, error))?;
        Ok(self.ready.get_or_init(|| (scene, scheme)))
    }

    fn flown(&self, py: Python<'_>, force: Option<Py<PyAny>>) -> PyResult<Flown> {
        let (scene, scheme) = self.ready(py)?;
        Ok(Flown {
            scene: Arc::clone(scene),
            scheme: *scheme,
            force,
        })
    }
}

/// Makes an object of a class of `lgvi.results`.
pub(crate) fn result<'py>(
    py: Python<'py>,
    class: &str,
    arguments: impl pyo3::call::PyCallArgs<'py>,
) -> PyResult<Bound<'py, PyAny>> {
    py.import("lgvi.results")?.getattr(class)?.call1(arguments)
}

#[pymethods]
impl Scene {
    /// Reads a scene file. A mesh that it names by `obj_file`, relative to its own directory, is read too.
    ///
    /// Raises `OSError` such as `FileNotFoundError`, or `SceneError` with the file, the key, the value and what was expected.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        error::readable(&path, "the scene")?;
        let loaded = py.detach(|| lgvi_common::load_scene(&path));
        match loaded {
            Ok(loaded) => Ok(Self::new(loaded, Some(path))),
            Err(error) => Err(error::scene_file(py, &error)),
        }
    }

    /// Returns one of the scenes that lgvi is shipped with, such as `"inclination_change"`.
    ///
    /// Raises `ValueError` with the names of all of them for another name.
    #[staticmethod]
    fn example(py: Python<'_>, name: &str) -> PyResult<Self> {
        let scene = SCENES.iter().find(|(known, _)| *known == name);
        let (_, text) = scene.ok_or_else(|| {
            let known = SCENES.map(|(name, _)| name).join(", ");
            PyValueError::new_err(format!("example {name:?}, expected one of {known}"))
        })?;
        Self::parse(py, name, text, None)
    }

    /// Makes a scene of a text in the format of scene files.
    #[staticmethod]
    #[pyo3(signature = (text, name = "scene"))]
    fn from_toml(py: Python<'_>, text: &str, name: &str) -> PyResult<Self> {
        Self::parse(py, name, text, None)
    }

    /// Makes a scene of a dictionary with the keys of scene files. NumPy arrays and numbers may be values; None is no value.
    #[staticmethod]
    #[pyo3(signature = (scene, name = "scene"))]
    fn from_dict(py: Python<'_>, scene: &Bound<'_, PyDict>, name: &str) -> PyResult<Self> {
        let table = toml_value::table(scene)?;
        Self::parse(py, name, &table.to_string(), None)
    }

    /// Returns the scene with other values of some keys, such as `{"run.steps": 100, "bodies.station.mass": 2.0}`.
    ///
    /// A body is named or numbered, as in `bodies[0].mass`. Comments of the text stay.
    fn with_values(&self, py: Python<'_>, values: &Bound<'_, PyMapping>) -> PyResult<Self> {
        let items = values.items()?;
        let each = items.iter().map(|item| {
            let (key, value): (String, Bound<'_, PyAny>) = item.extract()?;
            let value = toml_value::value(&value, &key)?.to_string();
            PyResult::Ok((key, value))
        });
        let settings = each.collect::<PyResult<Vec<_>>>()?;
        match py.detach(|| self.compiled(&settings)) {
            Ok(compiled) => Ok(Self::new(compiled, self.file.clone())),
            Err(refused) => Err(error::refused(py, self.file(), "", &refused)),
        }
    }

    /// Short name: that of the file.
    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    /// Title.
    #[getter]
    fn title(&self) -> &str {
        &self.scene.title
    }

    /// Text in the format of scene files, with which `from_toml` makes the same scene.
    #[getter]
    fn text(&self) -> &str {
        &self.scene.text
    }

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

    /// Duration of the run (s).
    #[getter]
    fn duration_s(&self) -> f64 {
        self.scene.seconds(self.scene.steps)
    }

    /// Steps of the run.
    #[getter]
    fn steps(&self) -> u64 {
        self.scene.steps
    }

    /// Length of a step (s).
    #[getter]
    fn step_s(&self) -> f64 {
        self.scene.seconds(1)
    }

    /// The integrator that flies the scene, in words. An automatic one is chosen at the first call, by pilot flights.
    #[getter]
    fn integrator(&self, py: Python<'_>) -> PyResult<String> {
        Ok(self.ready(py)?.1.to_string())
    }

    /// Explains how the scene is flown, from a trial of its first steps.
    ///
    /// Returns an `Explanation`: `print` shows it; `data` has the same as a dict, in SI; `warnings` lists what is doubtful.
    fn explain<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let choice = self.choice(py)?;
        let explained = py.detach(|| {
            let explanation = Explanation::of(&self.scene, choice.as_ref())?;
            let json = serde_json::to_string(&explanation).map_err(Unusable::new)?;
            Ok((explanation.to_string(), json))
        });
        let explained = explained.map_err(|error: Unusable| error::unfit(py, error))?;
        result(py, "Explanation", explained)
    }

    /// Flies the scene from its start and returns the trajectory.
    ///
    /// Parameters
    /// ----------
    /// t_eval : array_like, shape (n,), optional
    ///     Increasing times of the samples (s), 0 to `duration_s`. A time between two steps is reached by a shorter step from
    ///     the one before, of the same integrator; steps are the same with any `t_eval`. By default, a sample is kept every
    ///     `publish.state_every` steps of the scene and at the end.
    /// controls : optional
    ///     A plan, `lgvi.Controls`, a list of them, or a controller: a function `controller(t_s, state)` that is called once
    ///     a period and returns the wrench until the next call. A wrench is an array of shape (bodies, 6), force (N, inertial
    ///     frame) then moment (N m, body frame), of shape (6,) for a single body, a dict from names to six numbers, or None.
    ///     Without controls nothing but gravity and the scene's drag acts: a maneuver is not flown by itself.
    /// progress : callable, optional
    ///     Called with the completed fraction some times a second. An exception in it ends the flight.
    /// period_s : float, optional
    ///     Period of a controller (s), a whole number of steps; one by default.
    /// force : callable, optional
    ///     A function `force(state)` of positions and attitudes that returns a wrench as a controller does. It is evaluated
    ///     wherever the integrator evaluates gravity, so that the order of the integrator holds. In splittings such as LGVI,
    ///     velocities and rates in `state` may be those of another time within the step: a force that depends on them is of
    ///     first order there, and of the order of the method with Runge–Kutta methods; `drag` of a body in the scene has the order
    ///     of the method. Not for `closed_form` and
    ///     `taylor`. Slow: each evaluation calls Python, which takes some 10 µs, and a step has up to 30 of them.
    ///
    /// Raises
    /// ------
    /// FlightError
    ///     A step cannot be made.
    /// ControlError
    ///     Controls do not fit the scene or are not finite.
    ///
    /// Notes
    /// -----
    /// The interpreter is released during the flight. The same scene and controls give the same bits as the nodes of lgvi.
    #[pyo3(signature = (t_eval = None, controls = None, progress = None, *, period_s = None, force = None))]
    fn fly(
        &self,
        py: Python<'_>,
        t_eval: Option<&Bound<'_, PyAny>>,
        controls: Option<&Bound<'_, PyAny>>,
        progress: Option<Py<PyAny>>,
        period_s: Option<f64>,
        force: Option<Py<PyAny>>,
    ) -> PyResult<Trajectory> {
        let flown = self.flown(py, force)?;
        let times = t_eval.map(|times| numbers(times, "t_eval")).transpose()?;
        let outputs = outputs(&flown.scene, times)?;
        let commands = Commands::read(&flown.scene, controls, period_s)?;
        let samples = flown.fly(py, &outputs, commands, progress)?;
        Ok(Trajectory::new(flown.scene, samples))
    }

    /// Returns the simulation of the scene at step 0, to be advanced step by step.
    ///
    /// `force` is as in `fly`.
    #[pyo3(signature = (*, force = None))]
    fn simulation(&self, py: Python<'_>, force: Option<Py<PyAny>>) -> PyResult<Simulation> {
        Simulation::new(py, self.flown(py, force)?)
    }

    /// Plans the maneuver of the scene.
    ///
    /// Parameters
    /// ----------
    /// state : State, optional
    ///     A state of the flight, such as `simulation.state()`: the rest of the maneuver is planned from its step on. By
    ///     default, the whole maneuver is planned from the start of the scene.
    /// warm : Plan, optional
    ///     A plan of the same scene that is flown until the state. The solver starts from the rest of it, and the new plan
    ///     arrives when it does. What reaction wheels store and what propellant is left follow from it, so that maneuvers by
    ///     wheels and with propellant need it beside a state. Without a state it is not used.
    ///
    /// Raises
    /// ------
    /// PlanError
    ///     There is no plan; `reason` says why.
    #[pyo3(signature = (state = None, warm = None))]
    fn plan(
        &self,
        py: Python<'_>,
        state: Option<&Bound<'_, crate::state::State>>,
        warm: Option<&Bound<'_, Plan>>,
    ) -> PyResult<Plan> {
        let state = state.map(|state| state.get());
        let warm = warm.map(|plan| plan.get());
        Plan::make(py, &self.scene, state, warm)
    }

    /// Flies dispersed samples of the scene (Monte Carlo) on all cores and returns their table.
    ///
    /// Parameters
    /// ----------
    /// samples, seed : int, optional
    ///     Number of samples of the ensemble and its seed; those of the scene's `ensemble` table by default.
    /// range : tuple of int, optional
    ///     Samples `(start, end)` to fly, of these; all by default. A sample depends on scene, seed and its number alone.
    /// plan : Plan, optional
    ///     The plan that all samples fly, if the scene has a maneuver. It is made if it is not given.
    /// threads : int
    ///     Threads, or 0 for one a core. Numbers do not depend on it.
    /// progress : callable, optional
    ///     Called with the completed fraction of all steps some times a second. An exception in it ends the flights, once each
    ///     thread has flown its next 32 samples at most.
    ///
    /// Returns
    /// -------
    /// Table
    ///     A mapping from names to columns, which are NumPy arrays with a row a sample: `index`, `steps`, `failure` (empty
    ///     for a complete flight), `message`, and the columns of docs/ensembles.md, in SI, such as
    ///     `spacecraft.final.position.x`.
    ///
    /// Raises
    /// ------
    /// EnsembleError
    ///     The scene has no `ensemble` table, or a number is out of its range.
    /// ValueError
    ///     More than 1024 threads.
    #[pyo3(signature = (samples = None, seed = None, range = None, *, plan = None, threads = 0, progress = None))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of Python")]
    fn ensemble<'py>(
        &self,
        py: Python<'py>,
        samples: Option<u64>,
        seed: Option<u64>,
        range: Option<(u64, u64)>,
        plan: Option<&Bound<'py, Plan>>,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (scene, _) = self.ready(py)?;
        let wanted = ensemble::Wanted {
            settings: lgvi_ensemble::Settings { samples, seed },
            range: range.map(|(start, end)| start..end),
            threads,
        };
        let made = match (plan, &scene.maneuver) {
            (None, Some(_)) => Some(Plan::make(py, scene, None, None)?),
            _ => None,
        };
        let plan = plan.map(|plan| plan.get()).or(made.as_ref());
        let flown = ensemble::fly(py, scene, &wanted, plan, progress)?;
        result(py, "Table", flown)
    }

    /// Flies the scene with every combination of some values on all cores and returns one table.
    ///
    /// A maneuver is planned for each combination and flown with its feedback law if the scene has `feedback`.
    ///
    /// Parameters
    /// ----------
    /// vary : mapping
    ///     Keys of the scene as in `with_values`, and for each a sequence of its values, such as
    ///     `{"run.steps": [100, 1000], "bodies[0].mass": numpy.linspace(1.0, 2.0, 5)}`. The last key varies fastest; there are
    ///     100 000 combinations at most.
    /// threads : int
    ///     Threads, or 0 for one a core. Numbers do not depend on it.
    /// progress : callable, optional
    ///     Called with the completed fraction some times a second. An exception in it ends the flights.
    ///
    /// Returns
    /// -------
    /// Table
    ///     A mapping from names to columns, which are NumPy arrays with a row a flight. They are those of `lgvi sweep`, with
    ///     the same bits: `flight` (number, from 0), the keys of `vary` with their values (arrays of int, float,
    ///     bool or str if all are of this type; lists, dicts and values of several types are texts of TOML), `steps` (steps made), `failure`
    ///     (why the flight ended early or has no plan, empty otherwise), and for each body in SI `<body>.final.position.x`
    ///     (m, inertial frame), `.velocity.x` (m/s, inertial frame), `.attitude.w` (quaternion from the body frame to the
    ///     inertial one), `.angular_velocity.x` (rad/s, body frame); `change.energy` and other changes relative to the size
    ///     of the quantity; with a target `miss.position` (m) and others. NaN is where a flight has no such number.
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     A combination is no scene. None is flown then. `key`, `value` and `expected` say why.
    /// ValueError
    ///     More than 100 000 combinations or 1024 threads.
    ///
    /// Examples
    /// --------
    /// >>> import lgvi
    /// >>> scene = lgvi.rigid_bodies(1.0, [1.0, 2.0, 3.0], velocity_m_s=[1.0, 0.0, 0.0], duration_s=1.0, steps=10)
    /// >>> table = scene.sweep({"run.duration": [1.0, 2.0], "run.steps": [10, 20]})
    /// >>> print(table["run.duration"], table["run.steps"], table["body_0.final.position.x"].round(12))
    /// [1. 1. 2. 2.] [10 20 10 20] [1. 1. 2. 2.]
    #[pyo3(signature = (vary, *, threads = 0, progress = None))]
    fn sweep<'py>(
        &self,
        py: Python<'py>,
        vary: &Bound<'py, PyMapping>,
        threads: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let columns = sweep::fly(py, self, vary, threads, progress)?;
        let about = PyDict::new(py);
        about.set_item("scene", &self.scene.name)?;
        result(py, "Table", (columns, about))
    }

    /// Returns the gravity on the scene's bodies at given positions and attitudes.
    ///
    /// Parameters
    /// ----------
    /// position_m : array_like, shape (n, bodies, 3)
    ///     Centers of mass (m), inertial frame.
    /// attitude_xyzw : array_like, shape (n, bodies, 4)
    ///     Unit quaternions x, y, z, w from the body frame to the inertial one. What their norms differ from 1 by is removed.
    ///
    /// Returns
    /// -------
    /// force_n : ndarray, shape (n, bodies, 3)
    ///     Forces (N), inertial frame.
    /// moment_n_m : ndarray, shape (n, bodies, 3)
    ///     Moments about the centers of mass (N m), body frame.
    /// potential_j : ndarray, shape (n,)
    ///     Potential energies (J).
    ///
    /// Raises
    /// ------
    /// RotationError
    ///     The norm of a quaternion is not 1 to 1e-4.
    fn gravity<'py>(
        &self,
        py: Python<'py>,
        position_m: &Bound<'py, PyAny>,
        attitude_xyzw: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        gravity::evaluate(py, &self.scene, position_m, attitude_xyzw)
    }

    fn __repr__(&self) -> String {
        let scene::Scene {
            name,
            steps,
            bodies,
            ..
        } = &*self.scene;
        let bodies: Vec<_> = bodies.iter().map(|body| &*body.name).collect();
        format!("Scene({name:?}, bodies={bodies:?}, steps={steps})")
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String, String))> {
        let scene = &slf.get().scene;
        Ok((
            slf.get_type().getattr("from_toml")?,
            (scene.text.clone(), scene.name.clone()),
        ))
    }
}
