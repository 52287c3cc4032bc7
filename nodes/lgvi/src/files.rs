//! How a bag's files are written.

use clap::{Args, ValueEnum};

use crate::parameters::{number, text};
use crate::values;

/// Compression and splitting of a bag.
#[derive(Args)]
pub(crate) struct Files {
    /// Compression of the bag's chunks (default: zstd).
    #[arg(long)]
    compression: Option<Compression>,
    /// Begin a new file at this size; 0: never (default: 0).
    #[arg(
        long,
        value_name = "BYTES",
        visible_alias = "max-bag-size",
        value_parser = values::bytes(0),
        allow_negative_numbers = true
    )]
    max_bytes: Option<i64>,
    /// Begin a new file after this much log time; 0: never (default: 0).
    #[arg(
        long,
        value_name = "SECONDS",
        visible_alias = "max-bag-duration",
        value_parser = values::seconds,
        allow_negative_numbers = true
    )]
    max_duration: Option<f64>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Compression {
    None,
    Lz4,
    Zstd,
}

impl Compression {
    /// The parameter's value.
    fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Lz4 => "lz4",
            Self::Zstd => "zstd",
        }
    }
}

impl Files {
    /// The recorder's parameters.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = String> {
        let compression = self.compression.map(Compression::name);
        [
            text("compression", compression),
            number("max_bytes", self.max_bytes),
            number("max_duration", self.max_duration),
        ]
        .into_iter()
        .flatten()
    }
}
