//! Plans of maneuvers.

use std::sync::Arc;

use lgvi_control::Certificate;
use lgvi_msgs::msg::ControlSequence;
use lgvi_planner::{Iteration, NominalPlan, plan, plan_rest};
use lgvi_scene::{Commands, Maneuver, Scene};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Array, States, flat, forces, moments, read_only, room};
use crate::error;
use crate::state::State;
use crate::watch::Watch;

/// A plan of a scene's maneuver: controls of each step, the states that belong to them, and gains of feedback.
///
/// Made by `Scene.plan`; `Scene.fly(controls=plan)` flies it. It has n steps. Arrays are made when they are asked for, and
/// read-only.
#[pyclass(frozen, module = "lgvi")]
pub(crate) struct Plan {
    scene: Arc<Scene>,
    plan: NominalPlan,
    iterations: u32,
}

impl Plan {
    /// Plans the whole maneuver, or the rest of it from a state on.
    pub(crate) fn make(
        py: Python<'_>,
        scene: &Arc<Scene>,
        from: Option<&State>,
        warm: Option<&Self>,
    ) -> PyResult<Self> {
        let mut watch = Watch::new(None);
        let mut iterations = 0;
        let begin = from.map(|state| begin(scene, state)).transpose()?;
        if warm.is_some_and(|plan| !plan.fits(scene)) {
            let message =
                "`warm` is a plan in other units, steps or for another body than the scene's";
            return Err(PyValueError::new_err(message));
        }
        let warm = warm.map(|plan| &plan.plan);
        let made = py.detach(|| {
            let mut go_on = |now: &Iteration| {
                iterations = now.iteration;
                watch.go_on(0.0)
            };
            match begin {
                None => plan(scene, &mut go_on),
                Some(begin) => plan_rest(scene, begin, warm, &mut go_on),
            }
        });
        if let Some(error) = watch.interrupted() {
            return Err(error);
        }
        let plan = made.map_err(|error| error::plan(py, &error))?;
        Ok(Self {
            scene: Arc::clone(scene),
            plan,
            iterations,
        })
    }

    /// Its control sequence.
    pub(crate) fn message(&self) -> PyResult<ControlSequence> {
        let message = self.plan.message(&self.scene);
        message.map_err(|error| PyValueError::new_err(error.to_string()))
    }

    pub(crate) fn nominal(&self) -> &NominalPlan {
        &self.plan
    }

    /// Whether it is made for the units, the steps, the body and the actuators of a scene.
    pub(crate) fn fits(&self, scene: &Scene) -> bool {
        let of = |scene: &Scene| {
            let maneuver = scene.maneuver.as_ref();
            let body = maneuver.and_then(|maneuver| scene.bodies.get(maneuver.body));
            let actuators = maneuver.map(|maneuver| (maneuver.commands(), maneuver.actuators()));
            let name = body.map(|body| body.name.clone());
            (scene.units, scene.h(), name, actuators)
        };
        of(&self.scene) == of(scene)
    }

    fn states(&self) -> States<'_> {
        States {
            scene: &self.scene,
            states: &self.plan.solution().states,
        }
    }

    /// The commands of so many actuators in SI, shape (n, actuators), or (n, 0) if others are commanded.
    fn efforts<'py>(
        &self,
        py: Python<'py>,
        (of, count): (Commands, usize),
        in_si: impl Fn(f64) -> f64,
    ) -> PyResult<Array<'py>> {
        let count = if self.plan.commands() == of { count } else { 0 };
        let commands = &self.plan.solution().commands;
        let each = commands
            .iter()
            .flat_map(|command| command.iter().take(count));
        let efforts = each.map(|effort| in_si(*effort)).collect();
        read_only(py, &[commands.len(), count], efforts)
    }

    /// The masses of the body at `0 … N`.
    fn masses(&self) -> Vec<f64> {
        let plan = self.plan.solution();
        let mass = self.scene.bodies[self.body()].body.mass();
        match self.scene.transfer() {
            Some(Ok(transfer)) => plan.masses(&transfer),
            _ => vec![mass; plan.states.len()],
        }
    }

    fn body(&self) -> usize {
        let maneuver = self.scene.maneuver.as_ref();
        maneuver.map_or(0, |maneuver| maneuver.body)
    }
}

/// The step of a state, and the state of the maneuver's body there.
fn begin(scene: &Scene, state: &State) -> PyResult<(u64, lgvi_dynamics::BodyState)> {
    let refuse = |reason: &str| PyValueError::new_err(reason.to_owned());
    let maneuver = scene.maneuver.as_ref();
    let maneuver = maneuver.ok_or_else(|| refuse("the scene has no maneuver"))?;
    let step = state.step.ok_or_else(|| {
        refuse("`state` is between two steps, expected one at a whole number of steps")
    })?;
    let body = state.states.get(maneuver.body).filter(|_| {
        let names = |scene: &Scene| -> Vec<String> {
            scene.bodies.iter().map(|body| body.name.clone()).collect()
        };
        names(&state.scene) == names(scene) && state.scene.units == scene.units
    });
    let found = body.ok_or_else(|| refuse("`state` is of another scene, expected one of this"))?;
    if state.scene.h() != scene.h() {
        let (found, expected) = (state.scene.seconds(1), scene.seconds(1));
        return Err(refuse(&format!(
            "`state` is of a scene with steps of {found} s, expected {expected} s"
        )));
    }
    // The same motion of this scene's body, whose mass and inertia may be others.
    let [own, other] = [scene, &state.scene].map(|scene| &scene.bodies[maneuver.body].body);
    let body = lgvi_dynamics::BodyState::from_velocities(
        own,
        found.position,
        found.velocity(other),
        found.attitude,
        found.angular_velocity(other),
    );
    let same = own.mass() == other.mass() && own.inertia() == other.inertia();
    let changes = own.wheels().is_some() || maneuver.uses_propellant(scene);
    if changes && !(same && own.wheels() == other.wheels()) {
        return Err(refuse(
            "`state` is of a scene whose body has another mass, inertia or wheels, expected those of this scene",
        ));
    }
    Ok((step, if same { *found } else { body }))
}

#[pymethods]
impl Plan {
    /// Name of the controlled body.
    #[getter(body)]
    fn name(&self) -> &str {
        &self.scene.bodies[self.body()].name
    }

    /// The step of the run at which it begins.
    #[getter]
    fn first_step(&self) -> u64 {
        self.plan.first_step()
    }

    /// The step of the run at which it arrives.
    #[getter]
    fn last_step(&self) -> u64 {
        self.plan.arrival()
    }

    /// Times of the states (s), shape (n + 1,).
    #[getter]
    fn time_s<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let steps = self.plan.first_step()..=self.plan.arrival();
        let mut times = room(self.plan.solution().states.len())?;
        times.extend(steps.map(|step| self.scene.seconds(step)));
        read_only(py, &[times.len()], times)
    }

    /// Forces (N), inertial frame, each held over a step, shape (n, 3). Those of thrusters turn with the body; they are given
    /// in its attitude at the start of the step.
    #[getter]
    fn force_n<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let mut controls = self.plan.solution().controls.clone();
        if let Some(Maneuver { actuation, .. }) = &self.scene.maneuver {
            for (control, state) in controls.iter_mut().zip(&self.plan.solution().states) {
                *control = actuation.in_inertial_axes(control, &state.attitude);
            }
        }
        let force = forces(&self.scene, &controls)?;
        read_only(py, &[controls.len(), 3], force)
    }

    /// Forces of the body's thrusters (N), in the scene's order, each held over a step, shape (n, thrusters); (n, 0) unless the
    /// commands are thrusters.
    #[getter]
    fn thrust_n<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let scene = &self.scene;
        let thrusters = scene.bodies[self.body()].thrusters.len();
        let unit = scene.units.force();
        self.efforts(py, (Commands::Thrusters, thrusters), |thrust| {
            thrust.max(0.0) * unit
        })
    }

    /// Torques on the body's reaction wheels (N m), in the scene's order, each held over a step, shape (n, wheels); (n, 0)
    /// unless the commands are wheels.
    #[getter]
    fn wheel_torque_n_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let scene = &self.scene;
        let wheels = scene.bodies[self.body()].wheels.len();
        let unit = scene.units.energy();
        self.efforts(py, (Commands::Wheels, wheels), |torque| torque * unit)
    }

    /// Moments (N m), body frame, each held over a step, shape (n, 3).
    #[getter]
    fn moment_n_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let controls = &self.plan.solution().controls;
        let moment = moments(&self.scene, controls)?;
        read_only(py, &[controls.len(), 3], moment)
    }

    /// Planned centers of mass (m), inertial frame, shape (n + 1, 3).
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        read_only(
            py,
            &[self.states().states.len(), 3],
            self.states().positions()?,
        )
    }

    /// Planned velocities (m/s), inertial frame, shape (n + 1, 3).
    #[getter]
    fn velocity_m_s<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let states = &self.plan.solution().states;
        let body = &self.scene.bodies[self.body()].body;
        let unit = self.scene.units.length / self.scene.units.time;
        let each = states.iter().zip(self.masses());
        let numbers = flat::<3>(each.map(|(state, mass)| {
            let lighter = body.mass() / mass;
            (state.velocity(body) * (lighter * unit)).into()
        }))?;
        read_only(py, &[states.len(), 3], numbers)
    }

    /// Planned attitudes as unit quaternions x, y, z, w from the body frame to the inertial one, shape (n + 1, 4).
    #[getter]
    fn attitude_xyzw<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        read_only(
            py,
            &[self.states().states.len(), 4],
            self.states().quaternions()?,
        )
    }

    /// Planned angular velocities (rad/s), body frame, shape (n + 1, 3).
    #[getter]
    fn angular_velocity_rad_s<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let states = &self.plan.solution().states;
        let body = &self.scene.bodies[self.body()].body;
        let unit = 1.0 / self.scene.units.time;
        let each = states.iter().zip(self.masses());
        let numbers = flat::<3>(each.map(|(state, mass)| {
            let lighter = body.mass() / mass;
            (state.angular_velocity(body) * (lighter * unit)).into()
        }))?;
        read_only(py, &[states.len(), 3], numbers)
    }

    /// Planned masses of the body (kg), shape (n + 1,).
    #[getter]
    fn mass_kg<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let masses = self.masses().into_iter();
        let masses: Vec<_> = masses.map(|mass| mass * self.scene.units.mass).collect();
        read_only(py, &[masses.len()], masses)
    }

    /// Gains K of the feedback u = u* − K δz, shape (n, 6, 12), or n = 0 if the solver has none.
    ///
    /// Rows are force (N, inertial frame) and moment (N m, body frame). Where thrusters (N) or wheels (N m) are commanded, there is one
    /// for each in the place of these six. Columns are the deviations of position (m), linear
    /// momentum (kg m/s), attitude log(R*ᵀR) (rad, body frame) and angular momentum (kg m²/s, body frame).
    #[getter]
    fn gain<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let units = &self.scene.units;
        let plan = self.plan.solution();
        let unit = match self.plan.commands() {
            Commands::Loads => {
                let gains = plan.feedback.iter();
                let numbers = gains.flat_map(|gain| lgvi_common::gain_si(gain, units));
                return read_only(py, &[plan.feedback.len(), 6, 12], numbers.collect());
            }
            Commands::Thrusters => units.force(),
            Commands::Wheels => units.energy(),
        };
        let each = lgvi_common::row_units(unit, units);
        let count = self.scene.maneuver.as_ref().map_or(0, Maneuver::actuators);
        let gains = &plan.actuator_feedback;
        let numbers = gains.iter().flat_map(|gain| {
            let rows = (0..count).flat_map(|row| gain.row(row).iter().copied().collect::<Vec<_>>());
            rows.zip(each.into_iter().cycle())
                .map(|(gain, unit)| gain * unit)
        });
        read_only(py, &[gains.len(), count, 12], numbers.collect())
    }

    /// Whether it is flown with its feedback, as the scene says.
    #[getter]
    fn feedback(&self) -> bool {
        self.plan.has_feedback()
    }

    /// The objective, in the scene's units.
    #[getter]
    fn cost(&self) -> f64 {
        self.plan.solution().cost
    }

    /// Iterations of the solver.
    #[getter]
    fn iterations(&self) -> u32 {
        self.iterations
    }

    /// What is to be said of the plan: which of several it is, or that it may be no minimum. Empty if there is nothing.
    #[getter]
    fn remark(&self) -> &str {
        self.plan.remark()
    }

    /// Errors of the optimality conditions, which anyone can check: a dict.
    ///
    /// `stationarity`, `defect` (of the dynamics), `terminal` (miss of the target), `inequality`, `priced` (violation of
    /// constraints that have a price), `complementarity`: relative to the size of each quantity. `condition`: condition number of
    /// the map from initial multipliers to the terminal conditions. `sufficient`: whether the plan is known to be a strict local
    /// minimum. At minimum fuel also `switching`: a dict of the numbers of `switches`, of steps `at_limit` and `between` and of
    /// the `longest` row of the latter, and the largest `contradiction` of a switching function.
    #[getter]
    fn certificate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Certificate {
            stationarity,
            defect,
            terminal,
            inequality,
            priced,
            complementarity,
            condition,
            sufficient,
            switching,
        } = self.plan.solution().certificate;
        let dict = PyDict::new(py);
        for (name, number) in [
            ("stationarity", stationarity),
            ("defect", defect),
            ("terminal", terminal),
            ("inequality", inequality),
            ("priced", priced),
            ("complementarity", complementarity),
            ("condition", condition),
        ] {
            dict.set_item(name, number)?;
        }
        dict.set_item("sufficient", sufficient)?;
        if let Some(switching) = switching {
            let own = PyDict::new(py);
            for (name, count) in [
                ("switches", switching.switches),
                ("at_limit", switching.at_limit),
                ("between", switching.between),
                ("longest", switching.longest),
            ] {
                own.set_item(name, count)?;
            }
            own.set_item("contradiction", switching.contradiction)?;
            dict.set_item("switching", own)?;
        }
        Ok(dict)
    }

    fn __len__(&self) -> usize {
        self.plan.solution().controls.len()
    }

    fn __repr__(&self) -> String {
        let (first, last, cost) = (self.first_step(), self.last_step(), self.cost());
        format!("Plan(first_step={first}, last_step={last}, cost={cost})")
    }
}
