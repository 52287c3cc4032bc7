use serde::Deserialize;

use crate::angle::AngleFile;

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct DockingFile {
    /// Two ports of two free bodies.
    pub ports: [PortFile; 2],
    /// The bodies join if the ports are this close.
    pub distance: f64,
    /// Largest angle between one axis and the opposite of the other; 5 deg by default (rad, or a text such as "25 deg").
    pub angle: Option<AngleFile>,
    /// Largest relative speed of the ports; any by default.
    pub speed: Option<f64>,
    /// Largest relative angular velocity of the bodies; any by default (rad per unit of time).
    pub rate: Option<f64>,
}

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct PortFile {
    /// Name of the body.
    pub body: String,
    /// Position in the body frame.
    pub position: [f64; 3],
    /// Outward axis in the body frame, of any length.
    pub axis: [f64; 3],
}
