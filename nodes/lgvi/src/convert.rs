//! `lgvi convert`: a bag as tables for analysis tools.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use lgvi_bag::BagReader;
use lgvi_node::NodeError;
use lgvi_tables::{Conversion, ConvertError, convert as convert_bag};
use serde::Serialize;

use crate::beside::beside;
use crate::output::{self, say};
use crate::values;

/// What `lgvi convert` takes.
#[derive(Args)]
pub(crate) struct Options {
    /// The bag's directory, or its MCAP file.
    #[arg(value_parser = values::path())]
    bag: PathBuf,
    /// Format of the files.
    #[arg(long)]
    format: Format,
    /// The directory to make, or an empty one (default: `<BAG>_<FORMAT>`).
    #[arg(long, value_name = "DIRECTORY", value_parser = values::path())]
    output: Option<PathBuf>,
    /// Convert this topic, instead of all; may be given several times.
    #[arg(long = "topic", value_name = "NAME")]
    topics: Vec<String>,
    /// Arrays of one length up to this have a column for each element, others one column.
    #[arg(long, value_name = "COUNT", default_value_t = 64)]
    max_elements: usize,
    /// Print the result as one JSON object.
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
    /// Files of the bag that are not there.
    missing: Vec<String>,
    #[serde(flatten)]
    conversion: &'a Conversion,
}

/// Makes a file of each topic; exit code 0 where none is left out, 1 where one is or files of the bag are missing.
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

/// A line for each topic, and each file that is missing.
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
