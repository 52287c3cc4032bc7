use std::fmt::{self, Display, Formatter};

use lgvi_scene::Scene;
use serde::Serialize;

/// Two bodies that dock, and when.
#[derive(Debug, Serialize)]
pub(super) struct Docking {
    bodies: [String; 2],
    /// Largest distance of the ports (m).
    distance: f64,
    /// Largest angle of their axes (rad).
    angle: f64,
    /// Largest relative speed (m/s).
    speed: Option<f64>,
    /// Largest relative angular velocity (rad/s).
    rate: Option<f64>,
}

impl Docking {
    pub(super) fn of(scene: &Scene) -> Vec<Self> {
        let units = &scene.units;
        let limit = |value: f64, unit: f64| value.is_finite().then_some(value * unit);
        let all = scene.docking.iter().map(|docking| Self {
            bodies: docking
                .ports
                .map(|port| scene.bodies[port.body].name.clone()),
            distance: docking.distance * units.length,
            angle: docking.angle,
            speed: limit(docking.speed, units.length / units.time),
            rate: limit(docking.rate, 1.0 / units.time),
        });
        all.collect()
    }
}

impl Display for Docking {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self {
            bodies: [one, other],
            distance,
            angle,
            speed,
            rate,
        } = self;
        write!(
            f,
            "{one} and {other} join when their ports are within {distance} m and {:.3}°",
            angle.to_degrees()
        )?;
        if let Some(speed) = speed {
            write!(f, ", at {speed} m/s at most")?;
        }
        if let Some(rate) = rate {
            write!(f, ", at {rate} rad/s at most")?;
        }
        Ok(())
    }
}
