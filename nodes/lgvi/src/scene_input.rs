//! The scene that a command is given.

use std::path::{Path, PathBuf};

use clap::Args;
use lgvi_common::{parse_scene, read_scene, set_key};
use lgvi_middleware::node::NodeError;
use lgvi_scene::Scene;
use tempfile::TempDir;

use crate::values;

/// A scene file, and changes of it.
#[derive(Args)]
pub(crate) struct SceneInput {
    /// Scene file.
    #[arg(value_parser = values::path())]
    pub(crate) scene: PathBuf,
    /// Change a value of the scene, such as `run.duration=10` or `bodies.NAME.mass=2`; can be repeated.
    #[arg(long, value_name = "KEY=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,
}

/// The scene, and a file that nodes can read it from.
pub(crate) struct Loaded {
    pub(crate) scene: Scene,
    pub(crate) file: PathBuf,
    /// Keeps a changed scene's file until the nodes have ended.
    _directory: Option<TempDir>,
}

impl SceneInput {
    /// Reads, changes and compiles the scene.
    pub(crate) fn load(&self) -> Result<Loaded, NodeError> {
        self.load_with("", &[])
    }

    /// The same with further changes, which are those of an `option`.
    pub(crate) fn load_with(
        &self,
        option: &str,
        further: &[(String, String)],
    ) -> Result<Loaded, NodeError> {
        let (text, scene) = self.compile(option, further)?;
        if self.set.is_empty() && further.is_empty() {
            return Ok(Loaded {
                scene,
                file: self.scene.clone(),
                _directory: None,
            });
        }
        let directory = tempfile::tempdir().map_err(NodeError::runtime)?;
        let name = self.scene.file_name().unwrap_or("scene.toml".as_ref());
        let file = directory.path().join(Path::new(name));
        std::fs::write(&file, text).map_err(NodeError::runtime)?;
        Ok(Loaded {
            scene,
            file,
            _directory: Some(directory),
        })
    }

    /// The scene with further changes.
    pub(crate) fn with(&self, further: &[(String, String)]) -> Result<Scene, NodeError> {
        Ok(self.compile("--vary", further)?.1)
    }

    fn compile(
        &self,
        option: &str,
        further: &[(String, String)],
    ) -> Result<(String, Scene), NodeError> {
        let mut text = read_scene(&self.scene)?;
        let changes = || self.set.iter().chain(further);
        for (key, value) in &self.set {
            text = set_key(&text, key, value)?;
        }
        for (key, value) in further {
            text = set_key(&text, key, value)
                .map_err(|error| NodeError::Input(format!("{option} {error}")))?;
        }
        // Lines and values that an error names are those after the changes.
        let scene = parse_scene(&self.scene, &text).map_err(|error| {
            let set: Vec<_> = changes()
                .map(|(key, value)| format!("{key}={value}"))
                .collect();
            match (NodeError::from(error), set.as_slice()) {
                (NodeError::Input(error), [_, ..]) => {
                    NodeError::Input(format!("with {}: {error}", set.join(" ")))
                }
                (error, _) => error,
            }
        })?;
        Ok((text, scene))
    }
}

fn setting(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE")?;
    Ok((key.trim().into(), value.trim().into()))
}
