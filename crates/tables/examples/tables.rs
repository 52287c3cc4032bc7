//! Converts the topics of a bag to tables and prints the result as JSON:
//!
//! ```text
//! cargo run -p lgvi_tables --example tables -- bags/orbital_capture /tmp/tables parquet
//! ```

#![allow(clippy::print_stdout, reason = "an example prints its result")]

use std::{env, error::Error, path::Path};

use lgvi_bag::BagReader;
use lgvi_tables::{Format, Options, convert};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<_> = env::args().skip(1).collect();
    let [bag, output, format] = &arguments[..] else {
        return Err("expected a bag, a directory and a format".into());
    };
    let options = Options {
        format: match &**format {
            "csv" => Format::Csv,
            "parquet" => Format::Parquet,
            format => return Err(format!("format {format}, expected csv or parquet").into()),
        },
        topics: Vec::new(),
        max_elements: 64,
    };
    let made = convert(
        &BagReader::open(Path::new(bag))?,
        Path::new(output),
        &options,
    )?;
    println!("{}", serde_json::to_string(&made)?);
    Ok(())
}
