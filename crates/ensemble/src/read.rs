//! Reads parts from files.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::{ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, FileReader, Length, SerializedFileReader};

use crate::part::{CHECKSUM, FIRST, checksum, entries};
use crate::place::PartFile;
use crate::row::{Failure, FailureKind};
use crate::{EnsembleError, Identity, Row};

/// An open part.
pub(crate) struct Part<'a> {
    file: PartFile<'a>,
    reader: Box<dyn FileReader>,
    metadata: BTreeMap<String, String>,
    columns: Vec<String>,
}

impl<'a> Part<'a> {
    pub(crate) fn read<C: ChunkReader + Length + 'static>(
        file: &PartFile<'a>,
        contents: C,
    ) -> Result<Self, EnsembleError> {
        let length = contents.len();
        let reader = caught(|| SerializedFileReader::new(contents));
        let reader = reader.map_err(|error| file.damaged(error))?;
        let about = reader.metadata().file_metadata();
        let rows = file.range.end - file.range.start;
        if u64::try_from(about.num_rows()) != Ok(rows) {
            let reason = format!("{} rows, expected {rows}", about.num_rows());
            return Err(file.damaged(reason));
        }
        if reader.num_row_groups() != 1 {
            let reason = format!("{} row groups, expected 1", reader.num_row_groups());
            return Err(file.damaged(reason));
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
                return Err(file.damaged("a part of it is missing"));
            }
        }
        let entries = about.key_value_metadata().into_iter().flatten();
        let metadata = entries
            .filter_map(|entry| Some((entry.key.clone(), entry.value.clone()?)))
            .collect();
        let columns = about.schema_descr().columns().iter();
        let mut columns: Vec<_> = columns.map(|column| column.name().to_owned()).collect();
        if columns.len() < FIRST.len() || columns[..FIRST.len()] != FIRST {
            return Err(file.damaged("not the columns of samples"));
        }
        columns.drain(..FIRST.len());
        Ok(Self {
            file: file.clone(),
            reader: Box::new(reader),
            metadata,
            columns,
        })
    }

    pub(crate) fn file(&self) -> &PartFile<'a> {
        &self.file
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
            parsed.map_err(|_| self.file.damaged(format!("`{key}` is {text}")))
        };
        let part = number("lgvi.part")?;
        if part == 0 {
            let reason = "`lgvi.part` is 0";
            return Err(self.file.damaged(reason));
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
        let missing = || self.file.damaged(format!("no `{key}`"));
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
                path: self.file.path(),
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
                    kind: FailureKind::named(kind)
                        .ok_or_else(|| self.file.damaged(format!("failure {kind:?}")))?,
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
            return Err(self.file.damaged(reason));
        }
        for column in 0..self.columns.len() {
            let numbers = self.column::<DoubleType>(FIRST.len() + column)?;
            for (row, number) in rows.iter_mut().zip(numbers) {
                row.numbers.push(number);
            }
        }
        if self.entry(CHECKSUM)? != checksum(&self.identity()?, &self.columns, &rows) {
            let reason = "what is in it is not what was written";
            return Err(self.file.damaged(reason));
        }
        Ok(rows)
    }

    fn column<T: DataType>(&self, index: usize) -> Result<Vec<T::T>, EnsembleError> {
        let descriptor = self.reader.metadata().file_metadata().schema_descr();
        if descriptor.column(index).physical_type() != T::get_physical_type() {
            let name = descriptor.column(index).name().to_owned();
            return Err(self.file.damaged(format!("the type of `{name}`")));
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
        let values = values.map_err(|error| self.file.damaged(error))?;
        if values.len() == rows {
            Ok(values)
        } else {
            let reason = format!("{} values in a column of {rows}", values.len());
            Err(self.file.damaged(reason))
        }
    }
}

/// Turns a panic into an error: on some damaged pages, the crate parquet fails an assertion instead of returning an
/// error.
fn caught<T>(read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    catch_unwind(AssertUnwindSafe(read))
        .unwrap_or_else(|_| Err(ParquetError::General("it cannot be decoded".into())))
}
