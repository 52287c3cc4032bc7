//! The scene's sensors. The flight's loop reads what is true, where somebody listens ([`Sensors`]); the ROS side adds the
//! errors and publishes ([`errors`]).

pub(crate) mod errors;
mod inertial;
mod sensing;
mod sight;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lgvi_dynamics::docking::Docked;
use lgvi_scene::{Scene, Sensor, SensorKind};
use nalgebra::{Matrix3, Vector3};

use self::inertial::Increments;
use self::sight::Sight;
use crate::Flight;

/// Whether somebody listens to each sensor of the scene.
pub(crate) type Listened = Arc<[AtomicBool]>;

/// What is true at a step, in the scene's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reading {
    /// Index of the sensor.
    pub(crate) sensor: usize,
    pub(crate) step: u64,
    pub(crate) truth: Truth,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Truth {
    /// Mean angular velocity and specific force over a time, in the axes of the sensor.
    Inertial {
        rate: Vector3<f64>,
        force: Vector3<f64>,
        time: f64,
    },
    /// From the sensor's axes to the inertial ones.
    Attitude(Matrix3<f64>),
    /// Of the sensor, in the inertial frame.
    Motion {
        position: Vector3<f64>,
        velocity: Vector3<f64>,
    },
    /// Of the target, in the frame of the sensor.
    Pose {
        position: Vector3<f64>,
        attitude: Matrix3<f64>,
    },
}

impl Truth {
    fn is_finite(&self) -> bool {
        let finite = |vector: &Vector3<f64>| vector.iter().all(|c| c.is_finite());
        match self {
            Self::Inertial { rate, force, .. } => finite(rate) && finite(force),
            Self::Attitude(attitude) => attitude.iter().all(|c| c.is_finite()),
            Self::Motion { position, velocity } => finite(position) && finite(velocity),
            Self::Pose { position, attitude } => {
                finite(position) && attitude.iter().all(|c| c.is_finite())
            }
        }
    }
}

/// The loop's side of the sensors.
pub(crate) struct Sensors {
    scene: Arc<Scene>,
    listened: Listened,
    units: Vec<Unit>,
    /// What is to be published.
    ready: VecDeque<Reading>,
    /// The next step at which a period ends or a delay is over.
    due: u64,
    /// The last step at which that was so: periods begin there.
    boundary: u64,
    /// The step at which the states were last set: no period reaches back beyond it.
    origin: u64,
    /// Dockings before that, whose bodies have separated.
    separated: usize,
}

struct Unit {
    sensor: Sensor,
    /// The running period of an inertial sensor.
    increments: Option<Increments>,
    /// What is published later.
    delayed: VecDeque<Reading>,
}

impl Sensors {
    pub(crate) fn new(scene: &Arc<Scene>, listened: Listened) -> Self {
        let units: Vec<_> = scene
            .sensors
            .iter()
            .map(|sensor| Unit::new(scene, sensor))
            .collect();
        Self {
            // A reading that is new, and one that was delayed.
            ready: VecDeque::with_capacity(2 * units.len()),
            units,
            due: 0,
            boundary: 0,
            origin: 0,
            separated: 0,
            listened,
            scene: Arc::clone(scene),
        }
    }

    /// Whether the scene has none.
    pub(crate) fn is_empty(&self) -> bool {
        self.units.is_empty()
    }

    /// The states have been set at the present step.
    pub(crate) fn begin(&mut self, flight: &Flight) {
        let step = flight.step();
        self.separated = flight.docked().len();
        [self.due, self.boundary, self.origin] = [step; 3];
        for unit in &mut self.units {
            // What was read of the states before is not read of these.
            unit.delayed
                .retain(|reading| step > 0 && reading.step < step);
            unit.increments.iter_mut().for_each(Increments::end);
        }
    }

    /// A step is about to be made.
    pub(crate) fn depart(&mut self, flight: &Flight) {
        let step = flight.step();
        if step != self.boundary {
            return;
        }
        for (unit, listened) in self.units.iter_mut().zip(&*self.listened) {
            let begins = step.is_multiple_of(unit.sensor.every) || step == self.origin;
            if let Some(increments) = unit.increments.as_mut().filter(|_| begins) {
                if listened.load(Ordering::Relaxed) {
                    increments.begin(flight, &unit.sensor.mount);
                } else {
                    increments.end();
                }
            }
        }
    }

    /// A step has been made.
    pub(crate) fn arrive(&mut self, flight: &Flight) {
        for unit in &mut self.units {
            if let Some(increments) = &mut unit.increments {
                increments.add(flight, self.scene.h());
            }
        }
        if flight.step() == self.due {
            self.read(flight);
        }
    }

    /// Reads the sensors whose turn it is at the present step.
    pub(crate) fn read(&mut self, flight: &Flight) {
        let step = flight.step();
        let docked = &flight.docked()[self.separated..];
        let first = step == self.origin;
        self.boundary = step;
        self.due = u64::MAX;
        let units = self.units.iter_mut().zip(&*self.listened).enumerate();
        for (index, (unit, listened)) in units {
            let every = unit.sensor.every;
            if step.is_multiple_of(every)
                && let Some(truth) = unit.truth(&self.scene, flight, docked, first, listened)
            {
                let reading = Reading {
                    sensor: index,
                    step,
                    truth,
                };
                match unit.sensor.delay {
                    0 => self.ready.push_back(reading),
                    _ => unit.delay(reading),
                }
            }
            while let Some(reading) = unit.over(step) {
                self.ready.push_back(reading);
            }
            let next = (step / every + 1) * every;
            let over = unit.next_over().unwrap_or(next);
            self.due = self.due.min(next).min(over);
        }
    }

    /// Takes what is to be published.
    pub(crate) fn take(&mut self) -> Option<Reading> {
        self.ready.pop_front()
    }
}

impl Unit {
    fn new(scene: &Scene, sensor: &Sensor) -> Self {
        let inertial = matches!(sensor.kind, SensorKind::Imu(_));
        let waiting = sensor.delay.div_ceil(sensor.every) as usize;
        Self {
            increments: inertial.then(|| Increments::new(scene, sensor.body)),
            delayed: VecDeque::with_capacity(waiting + 2),
            sensor: sensor.clone(),
        }
    }

    /// What it reads; `None` where it reads nothing, or nobody listens.
    fn truth(
        &mut self,
        scene: &Scene,
        flight: &Flight,
        docked: &[Docked],
        first: bool,
        listened: &AtomicBool,
    ) -> Option<Truth> {
        let listened = || listened.load(Ordering::Relaxed);
        let sensor = &self.sensor;
        match &mut self.increments {
            Some(increments) if increments.is_running() => {
                increments.mean(scene, flight, docked, &sensor.mount)
            }
            Some(increments) => {
                (first && listened()).then(|| increments.instant(scene, flight, sensor))
            }
            None => {
                let sight = Sight {
                    scene,
                    bodies: flight.system().bodies(),
                    states: flight.states(),
                    sensor,
                };
                listened().then(|| sight.truth()).flatten()
            }
        }
    }

    /// Publishes a reading later. Of two at the same step, the later one is of the state as it has been set.
    fn delay(&mut self, reading: Reading) {
        let last = self.delayed.back();
        if last.is_some_and(|last| last.step == reading.step) {
            self.delayed.pop_back();
        }
        self.delayed.push_back(reading);
    }

    /// The step at which the next delay is over.
    fn next_over(&self) -> Option<u64> {
        Some(self.delayed.front()?.step + self.sensor.delay)
    }

    /// Takes a reading whose delay is over at a step.
    fn over(&mut self, step: u64) -> Option<Reading> {
        self.next_over().filter(|over| *over <= step)?;
        self.delayed.pop_front()
    }
}

#[cfg(test)]
mod tests;
