use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use lgvi_scene::{LONGEST, Scene, SceneError};

use lgvi_node::NodeError;

/// Reads and compiles a scene file; the scene is named after the file.
pub fn load_scene(path: &Path) -> Result<Scene, NodeError> {
    let refuse = |error: &dyn std::fmt::Display| {
        NodeError::Input(format!("scene {}: {error}", path.display()))
    };
    let bytes = read(path).map_err(|error| refuse(&error))?;
    if bytes.len() > LONGEST {
        return Err(refuse(&SceneError::TooLong));
    }
    let text = String::from_utf8(bytes).map_err(|error| refuse(&error))?;
    let name = path
        .file_stem()
        .map_or_else(|| "scene".into(), |stem| stem.to_string_lossy());
    Scene::parse(&name, &text).map_err(|error| refuse(&error))
}

/// What the file holds, or more of it than a scene may have.
fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?
        .take(LONGEST as u64 + 1)
        .read_to_end(&mut bytes)?;
    Ok(bytes)
}
