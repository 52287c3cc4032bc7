//! The scene's sensors. The flight's loop reads what is true, where somebody listens ([`Sensors`]); the ROS side adds the
//! errors and publishes ([`errors`]).

pub(crate) mod errors;
mod inertial;
mod sensing;
mod sight;

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lgvi_scene::{Scene, SensorKind};
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
    /// The running period of each inertial sensor; `None` of the others.
    increments: Vec<Option<Increments>>,
    /// What is published later, by sensor.
    delayed: Vec<VecDeque<Reading>>,
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

impl Sensors {
    pub(crate) fn new(scene: &Arc<Scene>, listened: &Listened) -> Self {
        let sensors = &scene.sensors;
        let increments = sensors.iter().map(|sensor| match sensor.kind {
            SensorKind::Imu(_) => Some(Increments::new(scene, sensor.body)),
            _ => None,
        });
        let delayed = sensors.iter().map(|sensor| {
            let waiting = sensor.delay.div_ceil(sensor.every) as usize;
            VecDeque::with_capacity(waiting + 2)
        });
        Self {
            increments: increments.collect(),
            delayed: delayed.collect(),
            // A reading that is new, and one that was delayed.
            ready: VecDeque::with_capacity(2 * sensors.len()),
            due: 0,
            boundary: 0,
            origin: 0,
            separated: 0,
            listened: Arc::clone(listened),
            scene: Arc::clone(scene),
        }
    }

    /// Whether the scene has none.
    pub(crate) fn is_empty(&self) -> bool {
        self.delayed.is_empty()
    }

    /// The states have been set at the present step.
    pub(crate) fn begin(&mut self, flight: &Flight) {
        let step = flight.step();
        if step == 0 {
            self.delayed.iter_mut().for_each(VecDeque::clear);
        }
        self.separated = flight.docked().len();
        [self.due, self.boundary, self.origin] = [step; 3];
        let running = self.increments.iter_mut().flatten();
        running.for_each(Increments::end);
    }

    /// A step is about to be made.
    pub(crate) fn depart(&mut self, flight: &Flight) {
        let step = flight.step();
        if step != self.boundary {
            return;
        }
        for (index, increments) in self.increments.iter_mut().enumerate() {
            let Some(increments) = increments else {
                continue;
            };
            let sensor = &self.scene.sensors[index];
            if step.is_multiple_of(sensor.every) || step == self.origin {
                if self.listened[index].load(Ordering::Relaxed) {
                    increments.begin(flight, &sensor.mount);
                } else {
                    increments.end();
                }
            }
        }
    }

    /// A step has been made.
    pub(crate) fn arrive(&mut self, flight: &Flight) {
        for increments in self.increments.iter_mut().flatten() {
            increments.add(flight.loads());
        }
        if flight.step() == self.due {
            self.read(flight);
        }
    }

    /// Reads the sensors whose turn it is at the present step.
    pub(crate) fn read(&mut self, flight: &Flight) {
        let scene = Arc::clone(&self.scene);
        let step = flight.step();
        self.boundary = step;
        self.due = u64::MAX;
        for (index, sensor) in scene.sensors.iter().enumerate() {
            if step.is_multiple_of(sensor.every)
                && let Some(truth) = self.truth(index, flight)
            {
                let reading = Reading {
                    sensor: index,
                    step,
                    truth,
                };
                match sensor.delay {
                    0 => self.ready.push_back(reading),
                    _ => {
                        let delayed = &mut self.delayed[index];
                        // Of two at the same step, the later one is of the state as it has been set.
                        if delayed.back().is_some_and(|last| last.step == step) {
                            delayed.pop_back();
                        }
                        delayed.push_back(reading);
                    }
                }
            }
            let delayed = &mut self.delayed[index];
            let published_at = |reading: &Reading| reading.step + sensor.delay;
            while delayed
                .front()
                .is_some_and(|first| published_at(first) <= step)
            {
                self.ready.extend(delayed.pop_front());
            }
            let next = (step / sensor.every + 1) * sensor.every;
            let over = delayed.front().map_or(next, published_at);
            self.due = self.due.min(next).min(over);
        }
    }

    /// Takes what is to be published.
    pub(crate) fn take(&mut self) -> Option<Reading> {
        self.ready.pop_front()
    }

    /// What a sensor reads; `None` where it reads nothing, or nobody listens.
    fn truth(&mut self, index: usize, flight: &Flight) -> Option<Truth> {
        let sensor = &self.scene.sensors[index];
        let listened = || self.listened[index].load(Ordering::Relaxed);
        let joined = &flight.docked()[self.separated..];
        if let Some(increments) = &mut self.increments[index] {
            if increments.is_running() {
                return increments.mean(&self.scene, flight, joined, &sensor.mount);
            }
            let first = flight.step() == self.origin && listened();
            return first.then(|| increments.instant(&self.scene, flight, sensor));
        }
        let sight = Sight {
            scene: &self.scene,
            bodies: flight.system().bodies(),
            states: flight.states(),
            sensor,
        };
        listened().then(|| sight.truth()).flatten()
    }
}

#[cfg(test)]
mod tests;
