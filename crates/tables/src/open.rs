//! A topic's table while its rows are written.

use std::fs::File;
use std::path::PathBuf;

use lgvi_bag::{BagReader, Message, Topic};

use crate::cdr::Value;
use crate::conversion::{ConvertError, Format, TableColumn, TableFile};
use crate::csv_table::CsvTable;
use crate::definition::Number;
use crate::layout::{Cell, Column, Kind, Layout};
use crate::parquet_table::ParquetTable;
use crate::table::{Table, TableError};

/// A topic and its layout.
pub(crate) struct Learnt<'b> {
    pub(crate) topic: &'b Topic,
    pub(crate) layout: Layout,
    pub(crate) rows: u64,
    /// Memory for all its messages together (bytes).
    pub(crate) bytes: usize,
}

/// A table that is being written.
pub(crate) struct Open<'b> {
    learnt: Learnt<'b>,
    columns: Vec<Column>,
    table: Box<dyn Table>,
    path: PathBuf,
}

impl<'b> Open<'b> {
    pub(crate) fn create(
        bag: &BagReader,
        path: PathBuf,
        format: Format,
        learnt: Learnt<'b>,
    ) -> Result<Self, ConvertError> {
        let columns = columns(&learnt.layout);
        let file = File::create_new(&path).map_err(|source| ConvertError::Io {
            path: path.clone(),
            source,
        })?;
        let table = match format {
            Format::Csv => {
                CsvTable::create(file, &columns).map(|table| Box::new(table) as Box<dyn Table>)
            }
            Format::Parquet => ParquetTable::create(file, &columns, &metadata(bag, learnt.topic))
                .map(|table| Box::new(table) as Box<dyn Table>),
        };
        match table {
            Ok(table) => Ok(Self {
                learnt,
                columns,
                table,
                path,
            }),
            Err(source) => Err(ConvertError::Table { path, source }),
        }
    }

    pub(crate) fn topic(&self) -> &'b Topic {
        self.learnt.topic
    }

    pub(crate) fn row(&mut self, message: &Message<'_>) -> Result<(), ConvertError> {
        let added = self.table.row(cells(&self.learnt, message)?);
        added.map_err(|source| self.error(source))
    }

    /// Returns the number of bytes of rows in memory.
    pub(crate) fn buffered(&self) -> usize {
        self.table.buffered()
    }

    /// Writes the rows in memory to the file.
    pub(crate) fn flush(&mut self) -> Result<(), ConvertError> {
        let flushed = self.table.flush();
        flushed.map_err(|source| self.error(source))
    }

    fn error(&self, source: TableError) -> ConvertError {
        ConvertError::Table {
            path: self.path.clone(),
            source,
        }
    }

    /// Completes the file. The result contains its name without the directory.
    pub(crate) fn finish(self) -> Result<TableFile, ConvertError> {
        let path = self.path;
        let name = path.file_name().map(PathBuf::from);
        let finished = self.table.finish();
        finished.map_err(|source| ConvertError::Table { path, source })?;
        let columns = self.columns.into_iter();
        Ok(TableFile {
            topic: self.learnt.topic.name.clone(),
            type_name: self.learnt.topic.type_name.clone(),
            file: name.unwrap_or_default(),
            rows: self.learnt.rows,
            columns: columns
                .map(|column| TableColumn {
                    name: column.name,
                    type_name: column.kind.name(),
                })
                .collect(),
        })
    }
}

/// Returns the cells of a message, in the order of [`columns`].
pub(crate) fn cells<'m>(
    learnt: &Learnt<'_>,
    message: &'m Message<'_>,
) -> Result<Vec<Cell<'m>>, ConvertError> {
    let mut cells = vec![
        Cell::Number(Value::Uint64(message.log_time)),
        Cell::Number(Value::Uint64(message.publish_time)),
        Cell::Number(Value::Uint32(message.sequence)),
    ];
    let fields = learnt.layout.cells(&message.data);
    cells.extend(fields.map_err(|source| ConvertError::Changed {
        topic: message.topic.name.clone(),
        source,
    })?);
    Ok(cells)
}

/// Returns the columns of the bag's own data, followed by those of the message. The former are renamed if a field of
/// the message has the same name.
pub(crate) fn columns(layout: &Layout) -> Vec<Column> {
    let fields = layout.columns();
    let own = [
        ("log_time", Kind::Time),
        ("publish_time", Kind::Time),
        ("sequence", Kind::Number(Number::Uint32)),
    ];
    let mut columns: Vec<_> = own
        .into_iter()
        .map(|(name, kind)| {
            let taken = fields.iter().any(|field| field.name == name);
            Column {
                // No field name begins with an underscore.
                name: format!("{}{name}", if taken { "_" } else { "" }),
                kind,
            }
        })
        .collect();
    columns.extend(fields);
    columns
}

/// Returns the metadata of a Parquet file.
fn metadata(bag: &BagReader, topic: &Topic) -> Vec<(&'static str, String)> {
    let custom: serde_json::Map<_, _> = bag
        .custom()
        .iter()
        .map(|(key, value)| (key.clone(), value.clone().into()))
        .collect();
    vec![
        ("topic", topic.name.clone()),
        ("type", topic.type_name.clone()),
        ("type_hash", topic.type_hash.clone()),
        ("definition", topic.definition.clone()),
        ("custom_data", serde_json::Value::Object(custom).to_string()),
    ]
}
