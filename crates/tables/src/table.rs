//! What a file of either format does.

use std::io;

use thiserror::Error;

use crate::layout::Cell;

/// A file that rows are written to.
pub(crate) trait Table {
    /// Adds a row: a cell for each column.
    fn row(&mut self, cells: Vec<Cell<'_>>) -> Result<(), TableError>;

    /// Bytes in memory that [`flush`](Self::flush) would write.
    fn buffered(&self) -> usize;

    /// Writes what is in memory.
    fn flush(&mut self) -> Result<(), TableError>;

    /// Completes the file.
    fn finish(self: Box<Self>) -> Result<(), TableError>;
}

/// Why a file cannot be written.
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
