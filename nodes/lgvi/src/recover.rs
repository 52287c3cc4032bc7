//! Makes a new bag of what is readable of a damaged one.

use std::fmt::{self, Display, Formatter};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use lgvi_bag::{LeftOut, RecoveredFile, Recovery};
use lgvi_middleware::node::NodeError;

use crate::beside::beside;
use crate::output::{say, shown};
use crate::values;

/// The command line of `lgvi recover`.
#[derive(Args)]
pub(crate) struct Options {
    /// Directory of the bag, or one MCAP file.
    #[arg(value_parser = values::path())]
    bag: PathBuf,
    /// Directory of the new bag (default: `<BAG>_recovered`).
    #[arg(long, value_parser = values::path())]
    output: Option<PathBuf>,
    /// Replace the bag's files once the new ones are complete. A file that lost something is kept as `<name>.damaged`.
    #[arg(long, conflicts_with = "output")]
    in_place: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Recovers a bag; exit code 1 if something is left out or missing.
pub(crate) fn recover(options: &Options) -> Result<ExitCode, NodeError> {
    let bag = &options.bag;
    let recovery = if options.in_place {
        if bag.is_file() {
            let bag = bag.display();
            let error = format!("{bag}: is a file, --in-place takes a bag's directory");
            return Err(NodeError::Input(error));
        }
        lgvi_bag::recover_in_place(bag)
    } else {
        let output = options
            .output
            .clone()
            .unwrap_or_else(|| beside(bag, "_recovered"));
        lgvi_bag::recover(bag, &output)
    };
    let recovery = recovery.map_err(NodeError::input)?;
    if options.json {
        say(&serde_json::to_string(&recovery).map_err(NodeError::runtime)?)?;
    } else {
        say(&Text(&recovery))?;
    }
    Ok(ExitCode::from(u8::from(!recovery.is_whole())))
}

/// The result for a person.
struct Text<'a>(&'a Recovery);

impl Display for Text<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self(recovery) = self;
        for file in &recovery.files {
            describe(file, f)?;
        }
        if let Some(why) = &recovery.metadata_rebuilt {
            writeln!(f, "metadata.yaml was rebuilt: {why}")?;
        }
        if recovery.unverified > 0 {
            let messages = recovery.unverified;
            writeln!(
                f,
                "{messages} messages have no checksum: they are as they were found"
            )?;
        }
        if let Some(missing) = recovery.missing {
            writeln!(f, "missing: {missing} messages, by the bag's own counts")?;
        }
        let messages: u64 = recovery.messages.values().sum();
        let topics = recovery.messages.len();
        write!(f, "recovered {messages} messages on {topics} topics")?;
        if let Some((first, last)) = recovery.times {
            write!(f, " over {:.3} s", (last - first) as f64 * 1e-9)?;
        }
        write!(f, " in {}", recovery.bag.display())
    }
}

fn describe(file: &RecoveredFile, f: &mut Formatter<'_>) -> fmt::Result {
    let path = file.path.display();
    let Some(bytes) = file.bytes else {
        write!(f, "{path}: is not there")?;
        if let Some(missing) = file.missing {
            write!(f, ", {missing} messages missing")?;
        }
        return writeln!(f);
    };
    let messages = file.messages;
    write!(f, "{path}: {bytes} bytes, {messages} messages")?;
    if let Some(missing @ 1..) = file.missing {
        write!(f, ", {missing} missing")?;
    }
    match (file.complete, file.kept) {
        (true, _) => writeln!(f)?,
        (false, true) => writeln!(f, ", its end is missing")?,
        (false, false) => writeln!(f, ", its end is missing; dropped")?,
    }
    for place in &file.left_out {
        let LeftOut {
            offset,
            bytes,
            reason,
            times,
        } = place;
        let reason = shown(reason);
        write!(f, "  left out {bytes} bytes at byte {offset}: {reason}")?;
        if let Some((first, last)) = times {
            write!(f, "; log times {first} to {last} ns")?;
        }
        writeln!(f)?;
    }
    let further = file.left_out_places - file.left_out.len() as u64;
    if further > 0 {
        let bytes = file.left_out_bytes;
        writeln!(f, "  and {further} further places: {bytes} bytes in all")?;
    }
    Ok(())
}
