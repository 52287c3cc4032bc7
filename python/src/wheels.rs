//! The reaction wheels of a flight.

use lgvi_dynamics::wheels::WheelState;
use pyo3::prelude::*;

use crate::arrays::{flat, room};
use crate::trajectory::{Kept, Trajectory};

impl Trajectory {
    /// The array of a number of each wheel, made at the first call.
    pub(crate) fn of_wheels<'py>(
        &self,
        py: Python<'py>,
        kept: Kept,
        of: impl Fn(&WheelState) -> f64 + Send + Sync,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.kept(py, kept, false, &[self.wheel_names().len()], |it| {
            let each = it.samples.actuators.wheels().iter();
            flat(each.map(|wheel| [of(wheel)]))
        })
    }

    /// Names of bodies and their wheels.
    pub(crate) fn wheel_names(&self) -> Vec<String> {
        let each = self.scene.bodies.iter().flat_map(|body| {
            let wheels = body.wheels.iter();
            wheels.map(|wheel| format!("{}.{wheel}", body.name))
        });
        each.collect()
    }

    /// The speeds of all wheels (rad/s).
    pub(crate) fn wheel_speeds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let wheels = self.wheel_names().len();
        self.kept(py, Kept::WheelSpeed, false, &[wheels], |it| {
            let mut system = it.scene.system();
            let each = it.samples.states.chunks(it.scene.bodies.len());
            let mut speeds = room(wheels.saturating_mul(it.samples.times.len()))?;
            for (sample, states) in each.enumerate() {
                it.samples.actuators.set(&mut system, sample);
                for (body, state) in system.bodies().iter().zip(states) {
                    let rate = state.angular_velocity(body);
                    let Some(wheels) = body.wheels() else {
                        continue;
                    };
                    let all = 0..wheels.wheels().len();
                    speeds.extend(all.map(|k| wheels.speed(k, &rate) / it.scene.units.time));
                }
            }
            Ok(speeds)
        })
    }
}
