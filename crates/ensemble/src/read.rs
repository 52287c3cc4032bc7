//! Reads parts from files.

use std::collections::BTreeMap;
use std::fs::File;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::{ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};

use crate::part::{CHECKSUM, FIRST, checksum, entries, range_of};
use crate::row::{Failure, FailureKind};
use crate::{EnsembleError, Identity, Row};

/// The file of a part and its samples.
#[derive(Clone, Debug)]
pub(crate) struct PartFile {
    pub(crate) path: PathBuf,
    pub(crate) range: Range<u64>,
}

/// Returns the parts in a directory, ordered by their first samples. The list is empty if the directory does not exist.
pub(crate) fn files(directory: &Path) -> Result<Vec<PartFile>, EnsembleError> {
    let listing = match std::fs::read_dir(directory) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        listing => listing.map_err(EnsembleError::io(directory))?,
    };
    let mut files = Vec::new();
    for entry in listing {
        let entry = entry.map_err(EnsembleError::io(directory))?;
        if let Some(range) = entry.file_name().to_str().and_then(range_of) {
            let path = entry.path();
            files.push(PartFile { path, range });
        }
    }
    files.sort_by_key(|file| (file.range.start, file.range.end));
    Ok(files)
}

/// An open part.
pub(crate) struct Part {
    file: PartFile,
    reader: SerializedFileReader<File>,
    metadata: BTreeMap<String, String>,
    columns: Vec<String>,
}

impl Part {
    pub(crate) fn open(file: &PartFile) -> Result<Self, EnsembleError> {
        let path = &file.path;
        let damaged = |error: ParquetError| EnsembleError::damaged(path, error);
        let opened = File::open(path).map_err(EnsembleError::io(path))?;
        let length = opened.metadata().map_err(EnsembleError::io(path))?.len();
        let reader = caught(|| SerializedFileReader::new(opened)).map_err(damaged)?;
        let about = reader.metadata().file_metadata();
        let rows = file.range.end - file.range.start;
        if u64::try_from(about.num_rows()) != Ok(rows) {
            let reason = format!("{} rows, expected {rows}", about.num_rows());
            return Err(EnsembleError::damaged(path, reason));
        }
        if reader.num_row_groups() != 1 {
            let reason = format!("{} row groups, expected 1", reader.num_row_groups());
            return Err(EnsembleError::damaged(path, reason));
        }
        let chunks = reader.metadata().row_group(0).columns().iter();
        for chunk in chunks {
            let size = chunk.compressed_size();
            let start = chunk
                .dictionary_page_offset()
                .unwrap_or(chunk.data_page_offset());
            let end = start.checked_add(size);
            let end = end.and_then(|end| u64::try_from(end).ok());
            if start < 0 || size < 0 || end.is_none_or(|end| end > length) {
                return Err(EnsembleError::damaged(path, "a part of it is missing"));
            }
        }
        let entries = about.key_value_metadata().into_iter().flatten();
        let metadata = entries
            .filter_map(|entry| Some((entry.key.clone(), entry.value.clone()?)))
            .collect();
        let columns = about.schema_descr().columns().iter();
        let mut columns: Vec<_> = columns.map(|column| column.name().to_owned()).collect();
        if columns.len() < FIRST.len() || columns[..FIRST.len()] != FIRST {
            return Err(EnsembleError::damaged(path, "not the columns of samples"));
        }
        columns.drain(..FIRST.len());
        Ok(Self {
            file: file.clone(),
            reader,
            metadata,
            columns,
        })
    }

    /// Returns the names of its numbers.
    pub(crate) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Returns the identity of the ensemble that the part declares.
    pub(crate) fn identity(&self) -> Result<Identity, EnsembleError> {
        let entry = |key: &str| self.entry(key).map(str::to_owned);
        let number = |key: &str| {
            let text = entry(key)?;
            let parsed = text.parse::<u64>();
            parsed
                .map_err(|_| EnsembleError::damaged(&self.file.path, format!("`{key}` is {text}")))
        };
        let part = number("lgvi.part")?;
        if part == 0 {
            let reason = "`lgvi.part` is 0";
            return Err(EnsembleError::damaged(&self.file.path, reason));
        }
        Ok(Identity {
            hash: entry("lgvi.identity")?,
            scene: entry("lgvi.scene")?,
            seed: number("lgvi.seed")?,
            samples: number("lgvi.samples")?,
            scheme: entry("lgvi.integrator")?,
            version: entry("lgvi.version")?,
            part,
        })
    }

    fn entry(&self, key: &str) -> Result<&str, EnsembleError> {
        let missing = || EnsembleError::damaged(&self.file.path, format!("no `{key}`"));
        self.metadata
            .get(key)
            .map(String::as_str)
            .ok_or_else(missing)
    }

    /// Returns an error if the part belongs to another ensemble. The error names the most specific property that
    /// differs.
    pub(crate) fn check(&self, expected: &Identity) -> Result<(), EnsembleError> {
        let found = self.identity()?;
        let names = [
            "scene or commands",
            "scene",
            "seed",
            "samples",
            "integrator",
            "version",
            "size of parts",
        ];
        let each = entries(&found)
            .into_iter()
            .zip(entries(expected))
            .zip(names);
        let mut differing = each.filter(|(((_, found), (_, expected)), _)| found != expected);
        // The hash comes first but is the least specific.
        let first = differing.next();
        match differing.next().or(first) {
            None => Ok(()),
            Some((((_, found), (_, expected)), what)) => Err(EnsembleError::Foreign {
                path: self.file.path.clone(),
                what,
                found,
                expected,
            }),
        }
    }

    /// Returns the samples after checking them against the checksum.
    pub(crate) fn rows(&self) -> Result<Vec<Row>, EnsembleError> {
        let indices = self.column::<Int64Type>(0)?;
        let steps = self.column::<Int64Type>(1)?;
        let kinds = self.column::<ByteArrayType>(2)?;
        let messages = self.column::<ByteArrayType>(3)?;
        let mut rows = Vec::with_capacity(indices.len());
        for (((index, steps), kind), message) in
            indices.iter().zip(&steps).zip(&kinds).zip(&messages)
        {
            let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
            let failure = match text(kind.data()).as_str() {
                "" => None,
                kind => Some(Failure {
                    kind: FailureKind::named(kind).ok_or_else(|| {
                        EnsembleError::damaged(&self.file.path, format!("failure {kind:?}"))
                    })?,
                    message: text(message.data()),
                }),
            };
            rows.push(Row {
                index: index.cast_unsigned(),
                steps: steps.cast_unsigned(),
                failure,
                numbers: Vec::with_capacity(self.columns.len()),
            });
        }
        let expected = self.file.range.clone();
        if !rows.iter().map(|row| row.index).eq(expected) {
            let reason = "its samples are not those of its name";
            return Err(EnsembleError::damaged(&self.file.path, reason));
        }
        for column in 0..self.columns.len() {
            let numbers = self.column::<DoubleType>(FIRST.len() + column)?;
            for (row, number) in rows.iter_mut().zip(numbers) {
                row.numbers.push(number);
            }
        }
        if self.entry(CHECKSUM)? != checksum(&self.identity()?, &self.columns, &rows) {
            let reason = "what is in it is not what was written";
            return Err(EnsembleError::damaged(&self.file.path, reason));
        }
        Ok(rows)
    }

    fn column<T: DataType>(&self, index: usize) -> Result<Vec<T::T>, EnsembleError> {
        let path = &self.file.path;
        let damaged = |error: ParquetError| EnsembleError::damaged(path, error);
        let descriptor = self.reader.metadata().file_metadata().schema_descr();
        if descriptor.column(index).physical_type() != T::get_physical_type() {
            let name = descriptor.column(index).name().to_owned();
            return Err(EnsembleError::damaged(
                path,
                format!("the type of `{name}`"),
            ));
        }
        let rows = (self.file.range.end - self.file.range.start) as usize;
        let values = caught(|| {
            let group = self.reader.get_row_group(0)?;
            let reader = group.get_column_reader(index)?;
            let mut reader = get_typed_column_reader::<T>(reader);
            let mut values = Vec::with_capacity(rows);
            reader.read_records(rows, None, None, &mut values)?;
            Ok(values)
        });
        let values = values.map_err(damaged)?;
        if values.len() == rows {
            Ok(values)
        } else {
            let reason = format!("{} values in a column of {rows}", values.len());
            Err(EnsembleError::damaged(path, reason))
        }
    }
}

/// Turns a panic into an error: on some damaged pages, the crate parquet fails an assertion instead of returning an
/// error.
fn caught<T>(read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    catch_unwind(AssertUnwindSafe(read))
        .unwrap_or_else(|_| Err(ParquetError::General("it cannot be decoded".into())))
}
