use serde::Deserialize;

use super::AttitudeFile;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FrameFile {
    pub name: String,
    pub parent: String,
    #[serde(default)]
    pub position: [f64; 3],
    pub attitude: Option<AttitudeFile>,
}
