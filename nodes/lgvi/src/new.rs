//! `lgvi new`: a scene to begin with.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use clap::builder::PossibleValuesParser;
use lgvi_middleware::node::NodeError;
use lgvi_review::SCENES;
use serde_json::json;

use crate::output::say;
use crate::values;

/// The command line of `lgvi new`.
#[derive(Args)]
pub(crate) struct Options {
    /// Template.
    #[arg(value_parser = PossibleValuesParser::new(SCENES.map(|(name, _)| name)))]
    template: String,
    /// Scene file to write; an existing file is not overwritten (default: `<TEMPLATE>.toml`).
    #[arg(long, value_parser = values::path())]
    output: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Writes the template and prints its path.
pub(crate) fn new(options: &Options) -> Result<ExitCode, NodeError> {
    let name = &options.template;
    let output = options.output.clone();
    let output = output.unwrap_or_else(|| format!("{name}.toml").into());
    let text = SCENES.iter().find(|(known, _)| known == name);
    let (_, text) = text.ok_or_else(|| NodeError::Input(format!("no template {name:?}")))?;
    let file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(&output);
    file.and_then(|mut file| file.write_all(text.as_bytes()))
        .map_err(|error| NodeError::Input(format!("{}: {error}", output.display())))?;
    if options.json {
        say(&json!({"template": name, "scene": output}))?;
    } else {
        say(&output.display())?;
    }
    Ok(ExitCode::SUCCESS)
}
