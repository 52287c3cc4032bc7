//! The command `lgvi explain`.

use std::process::ExitCode;

use clap::Args;
use lgvi_middleware::node::NodeError;
use lgvi_review::Explanation;

use crate::choosing::choose;
use crate::output::say;
use crate::scene_input::SceneInput;
use crate::strictness::Strictness;

/// The command line of `lgvi explain`.
#[derive(Args)]
pub(crate) struct Options {
    #[command(flatten)]
    input: SceneInput,
    /// Print the explanation as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    strictness: Strictness,
}

/// Explains the scene in a file.
pub(crate) fn explain(options: &Options) -> Result<ExitCode, NodeError> {
    let scene = options.input.load()?.scene;
    let explanation = Explanation::of(&scene, choose(&scene, None)?.as_ref())?;
    if options.json {
        say(&serde_json::to_string(&explanation).map_err(NodeError::runtime)?)?;
    } else {
        say(&explanation)?;
    }
    Ok(options.strictness.exit_code(&explanation.warnings))
}
