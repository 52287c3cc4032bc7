//! Conversion of bags to tables: a CSV or Parquet file per topic, for pandas, polars, DuckDB, MATLAB and similar tools.
//!
//! [`convert`] decodes messages by the definitions in the bag and therefore supports any message type. The columns are:
//!
//! - `log_time` and `publish_time` (ns since the UNIX epoch, a timestamp in Parquet) and `sequence`. The name gets an
//!   underscore in front if the message has a field with the same name.
//! - Every field, with dots for nested fields: `header.stamp.sec`.
//! - Every element, such as `bodies.0.position.2`, of an array that has the same length in all messages of the topic,
//!   at least one and at most [`Options::max_elements`].
//! - If this results in more than [`MAX_COLUMNS`] columns, arrays get a single column, starting with the innermost
//!   ones.
//! - Other arrays have a single column: a list in Parquet, a JSON array in CSV. Lists of messages are JSON texts in
//!   both.
//! - Arrays of `uint8`, `byte` or `char` always have a single column: bytes in Parquet, hexadecimal digits in CSV.
//!
//! Numbers in CSV are the shortest texts that parse to the same value, or `NaN`, `inf`, `-inf`. JSON stores the latter
//! three as strings. In Parquet, each number keeps its type.
//!
//! [`read`] makes the same tables in memory, with columns like those in Parquet.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod cdr;
mod conversion;
mod convert;
mod csv_table;
mod definition;
mod file_names;
mod layout;
mod memory;
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
pub use memory::{Cells, TopicTable, read};
pub use table::TableError;
