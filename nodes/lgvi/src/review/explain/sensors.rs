use std::fmt::{self, Display, Formatter};

use lgvi_scene::Scene;
use serde::Serialize;

/// A sensor of a body.
#[derive(Debug, Serialize)]
pub(super) struct Sensor {
    body: String,
    name: String,
    kind: &'static str,
    /// Where it is fixed.
    frame: String,
    /// From one measurement to the next (s).
    period: f64,
    /// From a measurement to its message (s).
    delay: f64,
    seed: u64,
}

impl Sensor {
    pub(super) fn of(scene: &Scene) -> Vec<Self> {
        let all = scene.sensors.iter().map(|sensor| Self {
            body: scene.bodies[sensor.body].name.clone(),
            name: sensor.name.clone(),
            kind: sensor.kind.name(),
            frame: sensor.frame.clone(),
            period: scene.seconds(sensor.every),
            delay: scene.seconds(sensor.delay),
            seed: sensor.seed,
        });
        all.collect()
    }
}

impl Display for Sensor {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            body,
            name,
            kind,
            frame,
            period,
            delay,
            ..
        } = self;
        write!(
            f,
            "{kind} {name} of {body} in frame {frame}, every {period} s"
        )?;
        if *delay > 0.0 {
            write!(f, ", {delay} s late")?;
        }
        Ok(())
    }
}
