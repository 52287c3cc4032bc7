//! The table of a sweep: a row for each flight.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use lgvi_middleware::node::NodeError;
use serde_json::{Map, Value, json};

use super::flown::Flown;
use super::variation::Combination;

pub(super) struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Columns are those of all flights, in the order in which they come. Scenes of different bodies have different ones.
    pub(super) fn new(combinations: &[Combination], flown: &[Flown], timed: bool) -> Self {
        let mut seen = BTreeSet::new();
        let names = flown.iter().flat_map(|flight| &flight.ends);
        let names = names.map(|(name, _)| name.as_str());
        let ends: Vec<&str> = names.filter(|name| seen.insert(*name)).collect();
        let settings = combinations.first().map_or(&[][..], Combination::settings);
        let keys = settings.iter().map(|(key, _)| key.as_str());
        let own = ["steps", "failure"].into_iter();
        let own = own.chain(timed.then_some("wall_time"));
        let columns = std::iter::once("flight").chain(keys).chain(own);
        let columns = columns.chain(ends.iter().copied()).map(str::to_owned);
        let rows = combinations.iter().zip(flown).enumerate();
        let rows = rows.map(|(index, (combination, flight))| {
            let mut row = vec![index.to_string()];
            let values = combination.settings().iter();
            row.extend(values.map(|(_, value)| plain(value)));
            row.push(flight.steps.to_string());
            row.push(flight.failure.clone().unwrap_or_default());
            if timed {
                row.push(flight.wall_time.to_string());
            }
            let own = flight.ends.iter();
            let own: BTreeMap<_, _> = own.map(|(name, number)| (name.as_str(), number)).collect();
            let end = |column: &&str| {
                own.get(column)
                    .map_or_else(String::new, ToString::to_string)
            };
            row.extend(ends.iter().map(end));
            row
        });
        Self {
            columns: columns.collect(),
            rows: rows.collect(),
        }
    }

    /// Writes it as CSV.
    pub(super) fn write(&self, path: &Path) -> Result<(), NodeError> {
        let fail = |error: csv::Error| {
            NodeError::Runtime(format!("cannot write {}: {error}", path.display()))
        };
        let mut writer = csv::Writer::from_path(path).map_err(fail)?;
        writer.write_record(&self.columns).map_err(fail)?;
        for row in &self.rows {
            writer.write_record(row).map_err(fail)?;
        }
        writer.flush().map_err(|error| fail(error.into()))
    }

    /// Its rows as objects; numbers are numbers.
    pub(super) fn to_json(&self) -> Value {
        let rows = self.rows.iter().map(|row| {
            let cells = self.columns.iter().zip(row);
            let object: Map<_, _> = cells
                .map(|(name, cell)| (name.clone(), of_cell(cell)))
                .collect();
            Value::Object(object)
        });
        rows.collect()
    }
}

/// A value without the quotes of a TOML string.
fn plain(value: &str) -> String {
    match value.parse::<toml_edit::Value>() {
        Ok(toml_edit::Value::String(text)) => text.into_value(),
        _ => value.to_owned(),
    }
}

fn of_cell(cell: &str) -> Value {
    match cell.parse::<f64>() {
        Ok(number) if number.is_finite() => json!(number),
        _ if cell.is_empty() => Value::Null,
        _ => json!(cell),
    }
}
