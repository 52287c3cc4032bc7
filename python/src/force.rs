//! A force that is a function of Python.

use std::sync::{Arc, Mutex, PoisonError};

use lgvi_dynamics::gravity::Gravity;
use lgvi_dynamics::{BodyState, Load, RigidBody, Simulation};
use lgvi_scene::{Scene, Scheme};
use pyo3::prelude::*;

use crate::arrays::wrenches;
use crate::error;
use crate::state::State;

/// The first exception of a force, which integrators know nothing of.
#[derive(Clone, Default)]
pub(crate) struct Raised(Arc<Mutex<Option<PyErr>>>);

impl Raised {
    /// Takes the exception.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn is_set(&self) -> bool {
        let slot = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        slot.is_some()
    }

    fn set(&self, error: PyErr) {
        let mut slot = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        slot.get_or_insert(error);
    }
}

/// Acts wherever an integrator evaluates gravity. Has no potential.
struct Force {
    scene: Arc<Scene>,
    function: Py<PyAny>,
    raised: Raised,
}

impl Force {
    fn loads(&self, states: &[BodyState]) -> PyResult<Vec<Option<Load>>> {
        Python::attach(|py| {
            let state = State {
                scene: Arc::clone(&self.scene),
                step: None,
                time: f64::NAN,
                states: states.to_vec(),
            };
            let wrench = self.function.bind(py).call1((state,))?;
            wrenches(&self.scene, &wrench)
        })
    }
}

impl Gravity for Force {
    fn add_loads(&mut self, _: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        let refused = Load {
            force: nalgebra::Vector3::repeat(f64::NAN),
            moment: nalgebra::Vector3::repeat(f64::NAN),
        };
        // After an exception no step is made any more.
        if self.raised.is_set() {
            loads.fill(refused);
            return;
        }
        match self.loads(states) {
            Ok(own) => {
                for (load, own) in loads.iter_mut().zip(own) {
                    *load += own.unwrap_or_default();
                }
            }
            Err(error) => {
                self.raised.set(error);
                loads.fill(refused);
            }
        }
    }

    fn potential(&self, _: &[RigidBody], _: &[BodyState]) -> f64 {
        0.0
    }
}

/// Returns the simulation of a scene from these states, with a function's force in addition to gravity.
pub(crate) fn simulation(
    py: Python<'_>,
    scene: &Arc<Scene>,
    states: Vec<BodyState>,
    scheme: Scheme,
    force: Option<(&Py<PyAny>, &Raised)>,
) -> PyResult<Simulation> {
    let made = match force {
        None => py.detach(|| scene.simulation_from(states, scheme)),
        Some((function, raised)) => {
            let bodies = scene.bodies.iter().map(|named| named.body.clone());
            let (bodies, owner) = (bodies.collect(), Arc::clone(scene));
            let (function, raised) = (function.clone_ref(py), raised.clone());
            let gravity = move || {
                let mut gravity = owner.gravity.of_system();
                gravity.push(Box::new(Force {
                    scene: Arc::clone(&owner),
                    function: Python::attach(|py| function.clone_ref(py)),
                    raised: raised.clone(),
                }));
                gravity
            };
            let made = py.detach(|| scene.simulation_under(bodies, states, scheme, gravity));
            made.map_err(Into::into)
        }
    };
    if let Some(error) = force.and_then(|(_, raised)| raised.take()) {
        return Err(error);
    }
    made.map_err(|error| error::unfit(py, error))
}
