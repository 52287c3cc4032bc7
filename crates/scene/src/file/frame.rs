use serde::Deserialize;

use super::AttitudeFile;

#[derive(Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct FrameFile {
    /// Name of the frame.
    pub name: String,
    /// Name of a body, the inertial frame, or an earlier frame.
    pub parent: String,
    /// Origin of the frame, in the parent frame.
    #[serde(default)]
    pub position: [f64; 3],
    /// Attitude, from this frame to the parent's; the identity by default.
    pub attitude: Option<AttitudeFile>,
}
