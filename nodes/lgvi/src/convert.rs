//! `lgvi convert`: a bag as tables for analysis tools.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use lgvi_bag::BagReader;
use lgvi_middleware::node::NodeError;
use lgvi_tables::{Conversion, ConvertError, convert as convert_bag};
use serde::Serialize;

use crate::beside::beside;
use crate::output::{self, say};
use crate::values;

/// The command line of `lgvi convert`.
#[derive(Args)]
pub(crate) struct Options {
    /// Directory of the bag, or one MCAP file.
    #[arg(value_parser = values::path())]
    bag: PathBuf,
    /// Format of the files.
    #[arg(long)]
    format: Format,
    /// Directory of the tables, new or empty (default: `<BAG>_<FORMAT>`).
    #[arg(long, value_name = "DIRECTORY", value_parser = values::path())]
    output: Option<PathBuf>,
    /// Convert only this topic; can be repeated (default: all topics).
    #[arg(long = "topic", value_name = "NAME")]
    topics: Vec<String>,
    /// Longest fixed-length array that gets one column per element; longer ones get one column.
    #[arg(long, value_name = "COUNT", default_value_t = 64)]
    max_elements: usize,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Formats of tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Comma-separated values, for every tool.
    Csv,
    /// Apache Parquet: smaller, and numbers keep their types.
    Parquet,
}

impl From<Format> for lgvi_tables::Format {
    fn from(format: Format) -> Self {
        match format {
            Format::Csv => Self::Csv,
            Format::Parquet => Self::Parquet,
        }
    }
}

/// The result as JSON.
#[derive(Serialize)]
struct Report<'a> {
    bag: String,
    output: String,
    format: &'static str,
    /// Missing files of the bag.
    missing: Vec<String>,
    #[serde(flatten)]
    conversion: &'a Conversion,
}

/// Writes one file per topic; exit code 1 if a topic is left out or a file of the bag is missing.
pub(crate) fn convert(options: &Options) -> Result<ExitCode, NodeError> {
    let format = lgvi_tables::Format::from(options.format);
    let bag = BagReader::open(&options.bag).map_err(NodeError::input)?;
    let output = match &options.output {
        Some(output) => output.clone(),
        None => beside(&options.bag, &format!("_{}", format.name())),
    };
    let wanted = lgvi_tables::Options {
        format,
        topics: options.topics.clone(),
        max_elements: options.max_elements,
    };
    let conversion = convert_bag(&bag, &output, &wanted).map_err(|error| match error {
        ConvertError::Io { .. } | ConvertError::Table { .. } => NodeError::runtime(error),
        ConvertError::Bag(_) | ConvertError::Exists { .. } | ConvertError::NoName { .. } => {
            NodeError::input(error)
        }
        ConvertError::UnknownTopic { .. } | ConvertError::Changed { .. } => {
            NodeError::Input(format!("{}: {error}", options.bag.display()))
        }
    })?;
    let missing: Vec<_> = bag.missing().iter().map(ToString::to_string).collect();
    let is_whole = missing.is_empty() && conversion.left_out.is_empty();
    if options.json {
        let report = Report {
            bag: options.bag.display().to_string(),
            output: output.display().to_string(),
            format: format.name(),
            missing,
            conversion: &conversion,
        };
        say(&serde_json::to_string(&report).map_err(NodeError::runtime)?)?;
    } else {
        say(&text(&conversion, &missing))?;
    }
    Ok(ExitCode::from(u8::from(!is_whole)))
}

/// One line per topic and per missing file.
fn text(conversion: &Conversion, missing: &[String]) -> String {
    let made = conversion.files.iter().map(|file| {
        let (path, columns) = (file.file.display(), file.columns.len());
        format!("{path}: {} rows, {columns} columns", file.rows)
    });
    let left_out = conversion.left_out.iter();
    let left_out =
        left_out.map(|topic| output::left_out(&topic.topic, &topic.type_name, &topic.reason));
    made.chain(left_out)
        .chain(missing.iter().cloned())
        .collect::<Vec<_>>()
        .join("\n")
}
