use std::fs;
use std::path::{Path, PathBuf};

use lgvi_ensemble::{Store, Summary, draw};
use lgvi_middleware::node::NodeError;
use serde::Serialize;

use super::failed;
use crate::output::say;

/// What an ensemble has come to, and where.
#[derive(Serialize)]
pub(crate) struct Report<'a> {
    output: &'a Path,
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<PathBuf>,
    remarks: &'a [String],
    #[serde(flatten)]
    summary: &'a Summary,
}

/// Writes summary and picture beside the parts, and says the summary; as JSON with the remarks.
pub(crate) fn report(store: &Store, json: bool, remarks: &[String]) -> Result<(), NodeError> {
    let summary = Summary::of(store).map_err(failed)?;
    let output = store.directory();
    let text = serde_json::to_string_pretty(&summary).map_err(NodeError::runtime)?;
    write(&output.join("summary.json"), &format!("{text}\n"))?;
    write(&output.join("summary.txt"), &format!("{summary}\n"))?;
    let picture = output.join("summary.svg");
    let drawn = draw(&summary, &picture).map_err(failed)?;
    if json {
        let report = Report {
            output,
            picture: drawn.then_some(picture),
            remarks,
            summary: &summary,
        };
        return say(&serde_json::to_string(&report).map_err(NodeError::runtime)?);
    }
    say(&summary)?;
    say(&format_args!("results in {}", output.display()))
}

fn write(path: &Path, text: &str) -> Result<(), NodeError> {
    let failed = |error| NodeError::Runtime(format!("{}: {error}", path.display()));
    fs::write(path, text).map_err(failed)
}
