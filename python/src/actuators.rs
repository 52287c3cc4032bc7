//! States of wheels and thrusters that are kept of a flight.

use std::collections::TryReserveError;

use lgvi_dynamics::wheels::WheelState;
use lgvi_dynamics::{ActuatorStates, System};

/// The states of all actuators, sample by sample.
#[derive(Default)]
pub(crate) struct Actuators {
    /// One after another.
    all: ActuatorStates,
    /// That of the last sample.
    last: ActuatorStates,
}

impl Actuators {
    /// Makes room for so many samples of a system.
    pub(crate) fn reserve(
        &mut self,
        system: &System,
        samples: usize,
    ) -> Result<(), TryReserveError> {
        let Self { all, last } = self;
        last.take(system);
        let room = |each: usize| each.saturating_mul(samples);
        all.wheels.try_reserve_exact(room(last.wheels.len()))?;
        (all.propellants).try_reserve_exact(room(last.propellants.len()))?;
        (all.thrusters).try_reserve_exact(room(last.thrusters.len()))
    }

    /// Keeps a sample.
    pub(crate) fn keep(&mut self, system: &System) {
        if self.none() {
            return;
        }
        let Self { all, last } = self;
        last.take(system);
        all.wheels.extend_from_slice(&last.wheels);
        all.propellants.extend_from_slice(&last.propellants);
        all.thrusters.extend_from_slice(&last.thrusters);
    }

    /// Sets the actuators of a system, if it has some, as they were at a sample.
    pub(crate) fn set(&self, system: &mut System, sample: usize) {
        fn at<T: Clone>(all: &[T], last: &[T], sample: usize) -> Vec<T> {
            all[sample * last.len()..][..last.len()].to_vec()
        }
        if self.none() {
            return;
        }
        let Self { all, last } = self;
        system.set_actuator_states(&ActuatorStates {
            wheels: at(&all.wheels, &last.wheels, sample),
            propellants: at(&all.propellants, &last.propellants, sample),
            thrusters: at(&all.thrusters, &last.thrusters, sample),
        });
    }

    /// Whether the system has no actuators.
    fn none(&self) -> bool {
        self.last.wheels.is_empty() && self.last.propellants.is_empty()
    }

    /// The wheels, sample by sample.
    pub(crate) fn wheels(&self) -> &[WheelState] {
        &self.all.wheels
    }
}
