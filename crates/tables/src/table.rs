//! The common interface of both file formats.

use std::io;

use thiserror::Error;

use crate::layout::Cell;

/// A file to which rows are written.
pub(crate) trait Table {
    /// Adds a row with one cell per column.
    fn row(&mut self, cells: Vec<Cell<'_>>) -> Result<(), TableError>;

    /// Returns the number of bytes in memory that [`flush`](Self::flush) would write.
    fn buffered(&self) -> usize;

    /// Writes the rows in memory to the file.
    fn flush(&mut self) -> Result<(), TableError>;

    /// Completes the file.
    fn finish(self: Box<Self>) -> Result<(), TableError>;
}

/// The reason that a file cannot be written.
#[derive(Debug, Error)]
pub enum TableError {
    /// A file operation failed.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The CSV writer failed.
    #[error(transparent)]
    Csv(#[from] csv::Error),
    /// The Parquet writer failed.
    #[error(transparent)]
    Parquet(#[from] parquet::errors::ParquetError),
}
