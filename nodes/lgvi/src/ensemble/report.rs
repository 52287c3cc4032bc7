use std::path::PathBuf;

use lgvi_ensemble::{Store, Summary, draw};
use lgvi_middleware::node::NodeError;
use serde::Serialize;

use super::failed;
use crate::output::say;

/// What an ensemble has come to, and where.
#[derive(Serialize)]
pub(crate) struct Report<'a> {
    output: PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<PathBuf>,
    remarks: &'a [String],
    #[serde(flatten)]
    summary: Option<&'a Summary>,
}

/// Writes summary and picture beside the parts, and says the summary; as JSON with the remarks.
pub(crate) fn report(store: &Store, json: bool, remarks: &[String]) -> Result<(), NodeError> {
    let summary = Summary::of(store).map_err(failed)?;
    let place = store.place();
    let write = |name: &str, text: &str| place.write(name, text.into()).map_err(failed);
    let text = serde_json::to_string_pretty(&summary).map_err(NodeError::runtime)?;
    write("summary.json", &format!("{text}\n"))?;
    write("summary.txt", &format!("{summary}\n"))?;
    let picture = draw(&summary).map_err(failed)?;
    if let Some(picture) = &picture {
        write("summary.svg", picture)?;
    }
    if json {
        let report = Report {
            output: place.path(),
            picture: picture.map(|_| place.path().join("summary.svg")),
            remarks,
            summary: Some(&summary),
        };
        return say(&serde_json::to_string(&report).map_err(NodeError::runtime)?);
    }
    say(&summary)?;
    say(&format_args!("results in {place}"))
}

/// Says where the parts of an ensemble are of which others fly the rest.
pub(crate) fn say_place(store: &Store, json: bool, remarks: &[String]) -> Result<(), NodeError> {
    let place = store.place();
    if json {
        let report = Report {
            output: place.path(),
            picture: None,
            remarks,
            summary: None,
        };
        return say(&serde_json::to_string(&report).map_err(NodeError::runtime)?);
    }
    say(&format_args!(
        "results in {place}; a run without --range summarizes them"
    ))
}
