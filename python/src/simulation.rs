//! A simulation that is advanced step by step.

use std::sync::{Arc, Mutex, PoisonError};

use lgvi_dynamics::StepError;
use lgvi_propagator::Flight;
use pyo3::prelude::*;

use crate::arrays::wrenches;
use crate::controls::{check, sequence};
use crate::error;
use crate::flight::Flown;
use crate::force::Raised;
use crate::state::State;
use crate::watch::Watch;

/// A scene on its way. Made by `Scene.simulation`.
#[pyclass(module = "lgvi")]
pub(crate) struct Simulation {
    flown: Flown,
    /// Never locked: what it is made of is not shared between threads.
    flight: Mutex<Flight>,
    raised: Raised,
}

impl Simulation {
    pub(crate) fn new(py: Python<'_>, flown: Flown) -> PyResult<Self> {
        let (flight, raised) = flown.begin(py)?;
        Ok(Self {
            flown,
            flight: Mutex::new(flight),
            raised,
        })
    }

    fn flight(&mut self) -> &mut Flight {
        self.flight
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Simulation {
    /// Makes `n` steps of `Scene.step_s` each. They may go beyond the scene's duration.
    ///
    /// Raises `FlightError` if one cannot be made; the simulation is then where it was before that step.
    #[pyo3(signature = (n = 1))]
    fn step(&mut self, py: Python<'_>, n: u64) -> PyResult<()> {
        let flight = self.flight();
        if n == 1 {
            let made = py.detach(|| flight.advance().err());
            let Some(error) = made else {
                return Ok(());
            };
            return Err(self.failed(py, &error));
        }
        let mut watch = Watch::new(None);
        let made = py.detach(|| {
            for step in 0..n {
                if let Err(error) = flight.advance() {
                    return Some(error);
                }
                if step.is_multiple_of(32) && !watch.go_on(0.0) {
                    break;
                }
            }
            None
        });
        match made {
            Some(error) => Err(self.failed(py, &error)),
            None => watch.end(py),
        }
    }

    /// Lets a wrench act over the next `steps` steps, in addition to controls and to wrenches applied before.
    ///
    /// It acts as it is: errors of actuators, the scene's `disturbance` table, change controls but not applied wrenches. A wrench
    /// that is refused changes nothing.
    ///
    /// A wrench is an array of shape (bodies, 6), force (N, inertial frame) then moment (N m, body frame), of shape (6,) for a
    /// single body, or a dict from names to six numbers.
    #[pyo3(signature = (wrench, steps = 1))]
    fn apply(&mut self, py: Python<'_>, wrench: &Bound<'_, PyAny>, steps: u64) -> PyResult<()> {
        if steps == 0 {
            return Err(error::controls(py, "`steps` is 0, expected at least 1"));
        }
        let scene = Arc::clone(&self.flown.scene);
        let loads = wrenches(&scene, wrench)?;
        let loads = || loads.iter().enumerate();
        let flight = self.flight();
        for (body, load) in loads() {
            let Some(load) = load else { continue };
            check(&scene, flight, body, load).map_err(|reason| error::controls(py, reason))?;
        }
        for (body, load) in loads() {
            let Some(load) = *load else { continue };
            flight.push(body, load, steps);
        }
        Ok(())
    }

    /// Accepts a plan or `lgvi.Controls`, which act from their first step on in place of any accepted before them. Wrenches that
    /// were applied act in addition.
    fn accept(&mut self, py: Python<'_>, controls: &Bound<'_, PyAny>) -> PyResult<()> {
        let controls = sequence(&self.flown.scene, controls)?;
        let admitted = self.flight().admit(controls);
        admitted.map_err(|error| error::controls(py, error))
    }

    /// The state of all bodies now.
    fn state(&mut self) -> State {
        let scene = Arc::clone(&self.flown.scene);
        State::of(&scene, self.flight())
    }

    /// Steps made.
    #[getter]
    fn steps(&mut self) -> u64 {
        self.flight().step()
    }

    /// Time since the start (s).
    #[getter]
    fn time_s(&mut self) -> f64 {
        let step = self.steps();
        self.flown.scene.seconds(step)
    }

    /// Sum of kinetic and potential energy of all bodies (J).
    #[getter]
    fn energy_j(&mut self) -> f64 {
        self.flight().invariants().energy * self.flown.scene.units.energy()
    }

    fn __repr__(&mut self) -> String {
        let step = self.steps();
        let name = &self.flown.scene.name;
        format!("Simulation({name:?}, steps={step})")
    }
}

impl Simulation {
    #[cold]
    fn failed(&mut self, py: Python<'_>, error: &StepError) -> PyErr {
        let step = self.steps();
        let raised = self.raised.take();
        raised.unwrap_or_else(|| error::step(py, &self.flown.scene, step, error))
    }
}
