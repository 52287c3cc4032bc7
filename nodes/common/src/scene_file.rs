use std::path::Path;

use lgvi_scene::Scene;

use crate::NodeError;

/// Reads and compiles a scene file; the scene is named after the file.
pub fn load_scene(path: &Path) -> Result<Scene, NodeError> {
    let refuse = |error: &dyn std::fmt::Display| {
        NodeError::Input(format!("scene {}: {error}", path.display()))
    };
    let text = std::fs::read_to_string(path).map_err(|error| refuse(&error))?;
    let name = path
        .file_stem()
        .map_or_else(|| "scene".into(), |stem| stem.to_string_lossy());
    Scene::parse(&name, &text).map_err(|error| refuse(&error))
}
