//! `lgvi new`: a scene to begin with.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use clap::builder::PossibleValuesParser;
use lgvi_middleware::node::NodeError;
use serde_json::json;

use crate::output::say;
use crate::values;

macro_rules! template {
    ($name:literal) => {
        (
            $name,
            include_str!(concat!("../../../scenes/", $name, ".toml")),
        )
    };
}
/// The shipped scenes.
const TEMPLATES: [(&str, &str); 19] = [
    template!("asteroid_orbiter"),
    template!("binary_asteroid"),
    template!("dispersed_capture"),
    template!("docking"),
    template!("docking_corridor"),
    template!("free_body"),
    template!("inclination_change"),
    template!("inclination_replan"),
    template!("low_orbit_approach"),
    template!("oblate_orbit"),
    template!("orbital_capture"),
    template!("pendulum"),
    template!("relative_orbit"),
    template!("rocks"),
    template!("slew_keep_out"),
    template!("thruster_approach"),
    template!("tumbling_target"),
    template!("two_dumbbells"),
    template!("wheel_slew"),
];

/// The command line of `lgvi new`.
#[derive(Args)]
pub(crate) struct Options {
    /// Template.
    #[arg(value_parser = PossibleValuesParser::new(TEMPLATES.map(|(name, _)| name)))]
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
    let text = TEMPLATES.iter().find(|(known, _)| known == name);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_scene_is_a_template() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");
        let files = std::fs::read_dir(folder).unwrap();
        let paths = files.map(|file| file.unwrap().path());
        let scenes = paths.filter(|path| path.extension().is_some_and(|end| end == "toml"));
        let mut names: Vec<_> = scenes
            .map(|path| path.file_stem().unwrap().to_owned())
            .collect();
        names.sort();
        assert_eq!(names, TEMPLATES.map(|(name, _)| name));
    }
}
