//! CSV tables according to RFC 4180 with line feeds, a header line, and text in UTF-8.

use std::fs::File;

use csv::{Writer, WriterBuilder};

use crate::layout::{Cell, Column};
use crate::table::{Table, TableError};
use crate::text;

pub(crate) struct CsvTable {
    writer: Writer<File>,
    /// Buffer for the text of the current cell.
    text: String,
}

impl CsvTable {
    pub fn create(file: File, columns: &[Column]) -> Result<Self, TableError> {
        let mut writer = WriterBuilder::new().from_writer(file);
        writer.write_record(columns.iter().map(|column| &column.name))?;
        Ok(Self {
            writer,
            text: String::new(),
        })
    }
}

impl Table for CsvTable {
    fn row(&mut self, cells: Vec<Cell<'_>>) -> Result<(), TableError> {
        for cell in cells {
            self.text.clear();
            match cell {
                Cell::Number(value) => text::number(&mut self.text, value),
                Cell::Text(value) => self.text.push_str(&value),
                Cell::Octets(value) => text::octets(&mut self.text, value),
                Cell::Numbers(values) => text::numbers(&mut self.text, values),
                Cell::Texts(values) => {
                    text::texts(&mut self.text, values.iter().map(|text| &**text))
                }
                Cell::Json(value) => self.text.push_str(&value),
            }
            self.writer.write_field(&self.text)?;
        }
        self.writer.write_record(None::<&[u8]>)?;
        Ok(())
    }

    fn buffered(&self) -> usize {
        0
    }

    fn flush(&mut self) -> Result<(), TableError> {
        Ok(self.writer.flush()?)
    }

    fn finish(mut self: Box<Self>) -> Result<(), TableError> {
        self.flush()
    }
}
