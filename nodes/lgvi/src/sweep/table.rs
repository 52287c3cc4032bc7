//! The table of a sweep as CSV and JSON.

use std::path::Path;

use lgvi_middleware::node::NodeError;
use lgvi_review::sweep::{Column, Table};
use serde_json::{Map, Value, json};

/// Writes a table as CSV.
pub(super) fn write(table: &Table, path: &Path) -> Result<(), NodeError> {
    let fail =
        |error: csv::Error| NodeError::Runtime(format!("cannot write {}: {error}", path.display()));
    let mut writer = csv::Writer::from_path(path).map_err(fail)?;
    let names = table.columns().iter().map(|(name, _)| name);
    writer.write_record(names).map_err(fail)?;
    for row in 0..table.rows() {
        let cells = table.columns().iter().map(|(_, column)| cell(column, row));
        writer.write_record(cells).map_err(fail)?;
    }
    writer.flush().map_err(|error| fail(error.into()))
}

/// The rows of a table as objects; numbers are numbers.
pub(super) fn to_json(table: &Table) -> Value {
    let rows = (0..table.rows()).map(|row| {
        let cells = table.columns().iter();
        let object: Map<_, _> = cells
            .map(|(name, column)| (name.clone(), of_cell(&cell(column, row))))
            .collect();
        Value::Object(object)
    });
    rows.collect()
}

fn cell(column: &Column, row: usize) -> String {
    match column {
        Column::Counts(counts) => counts[row].to_string(),
        Column::Values(texts) | Column::Texts(texts) => texts[row].clone(),
        Column::Numbers(numbers) => {
            numbers[row].map_or_else(String::new, |number| number.to_string())
        }
    }
}

fn of_cell(cell: &str) -> Value {
    match cell.parse::<f64>() {
        Ok(number) if number.is_finite() => json!(number),
        _ if cell.is_empty() => Value::Null,
        _ => json!(cell),
    }
}
