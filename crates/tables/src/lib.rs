//! Bags as tables: a CSV or Parquet file of each topic, for pandas, polars, DuckDB, MATLAB and the like.
//!
//! Messages are taken apart by the definitions in the bag, so that any type will do: [`convert`] knows none. Columns:
//!
//! - `log_time` and `publish_time` (ns since the UNIX epoch; a timestamp in Parquet) and `sequence`, with an underscore
//!   before the name where the message has such a field itself;
//! - every field, nested ones with dots: `header.stamp.sec`;
//! - every element, `bodies.0.position.2`, of an array that has the same length in all messages of the topic, at least
//!   one and at most [`Options::max_elements`];
//! - where that would be more than [`MAX_COLUMNS`], arrays have one column from the innermost on;
//! - other arrays have one column: a list in Parquet, a JSON array in CSV; lists of messages are JSON texts in both;
//! - arrays of `uint8`, `byte` or `char` always have one column: bytes in Parquet, hexadecimal digits in CSV.
//!
//! Numbers in CSV are the shortest texts that give the same value again, or `NaN`, `inf`, `-inf`; JSON has the latter
//! three as texts. In Parquet, each number keeps its type.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod cdr;
mod conversion;
mod convert;
mod csv_table;
mod definition;
mod file_names;
mod layout;
mod open;
mod parquet_table;
mod table;
#[cfg(test)]
mod tests;
mod text;

pub use cdr::{DecodeError, Fault};
pub use conversion::{Conversion, ConvertError, Format, LeftOut, Options, TableColumn, TableFile};
pub use convert::convert;
pub use definition::{DefinitionError, MAX_DEPTH};
pub use layout::MAX_COLUMNS;
pub use table::TableError;
