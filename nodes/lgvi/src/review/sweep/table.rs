use std::collections::{BTreeMap, BTreeSet};

use super::{Combination, Flown};

/// The table of a sweep: a row for each flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    columns: Vec<(String, Column)>,
    rows: usize,
}

/// The cells of a column.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Whole numbers.
    Counts(Vec<u64>),
    /// Values of a key in the syntax of TOML; strings without quotes.
    Values(Vec<String>),
    /// Texts.
    Texts(Vec<String>),
    /// Numbers in SI; `None` where a flight has none, as its scene has other bodies or it did not begin.
    Numbers(Vec<Option<f64>>),
}

impl Table {
    /// The table of combinations and their flights. Its keys are those of the first combination. Scenes of different bodies
    /// have different columns, which come in the order of the flights.
    pub fn new(flights: &[(&Combination, &Flown)]) -> Self {
        let settings = flights.first().map_or(&[][..], |(one, _)| one.settings());
        let keys = settings.iter().enumerate().map(|(index, (key, _))| {
            let values = flights.iter().map(|(one, _)| {
                let setting = one.settings().get(index);
                setting.map_or_else(String::new, |(_, value)| plain(value))
            });
            (key.clone(), Column::Values(values.collect()))
        });
        let each = || flights.iter().map(|(_, flown)| *flown);
        let failures = each().map(|flight| flight.failure.clone().unwrap_or_default());
        let mut columns = vec![(
            "flight".to_owned(),
            Column::Counts((0..flights.len() as u64).collect()),
        )];
        columns.extend(keys);
        columns.push((
            "steps".to_owned(),
            Column::Counts(each().map(|flight| flight.steps).collect()),
        ));
        columns.push(("failure".to_owned(), Column::Texts(failures.collect())));
        let ends: Vec<BTreeMap<_, _>> = each()
            .map(|flight| flight.ends.iter().map(|(name, end)| (name, *end)).collect())
            .collect();
        let mut seen = BTreeSet::new();
        let names = each().flat_map(|flight| flight.ends.iter().map(|(name, _)| name));
        columns.extend(names.filter(|name| seen.insert(*name)).map(|name| {
            let numbers = ends.iter().map(|own| own.get(name).copied());
            (name.clone(), Column::Numbers(numbers.collect()))
        }));
        Self {
            columns,
            rows: flights.len(),
        }
    }

    /// Names and cells: `flight`, the keys that vary, `steps`, `failure`, `wall_time` if it has been added, and the numbers at
    /// the end. All have a cell a row.
    pub fn columns(&self) -> &[(String, Column)] {
        &self.columns
    }

    /// The number of flights.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Adds the times that the flights took (s), in their order, as the column `wall_time` after `failure`. It is empty where
    /// there are fewer times than flights.
    pub fn add_wall_times(&mut self, times: &[f64]) {
        let times = (0..self.rows).map(|row| times.get(row).copied()).collect();
        let column = ("wall_time".to_owned(), Column::Numbers(times));
        let failure = self.columns.iter().position(|(name, _)| name == "failure");
        let place = failure.map_or(self.columns.len(), |place| place + 1);
        self.columns.insert(place, column);
    }
}

/// A value without the quotes of a TOML string.
fn plain(value: &str) -> String {
    match value.parse::<toml_edit::Value>() {
        Ok(toml_edit::Value::String(text)) => text.into_value(),
        _ => value.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{Variation, combinations};

    fn flown(ends: &[(&str, f64)]) -> Flown {
        let ends = ends.iter().map(|(name, end)| ((*name).to_owned(), *end));
        Flown {
            steps: 5,
            failure: None,
            ends: ends.collect(),
        }
    }

    #[test]
    fn every_column_has_a_cell_a_row() {
        let values = ["1", "'two'", "[3]"].map(str::to_owned).to_vec();
        let key = "k".to_owned();
        let all = combinations(&[Variation { key, values }]).unwrap();
        let flights = [flown(&[("x", 1.0)]), flown(&[]), flown(&[("y", 2.0)])];
        let mut table = Table::new(&all.iter().zip(&flights).collect::<Vec<_>>());
        table.add_wall_times(&[0.5]);
        let texts = |texts: [&str; 3]| texts.map(str::to_owned).to_vec();
        let expected = [
            ("flight", Column::Counts(vec![0, 1, 2])),
            ("k", Column::Values(texts(["1", "two", "[3]"]))),
            ("steps", Column::Counts(vec![5; 3])),
            ("failure", Column::Texts(texts(["", "", ""]))),
            ("wall_time", Column::Numbers(vec![Some(0.5), None, None])),
            ("x", Column::Numbers(vec![Some(1.0), None, None])),
            ("y", Column::Numbers(vec![None, None, Some(2.0)])),
        ];
        let expected = expected.map(|(name, column)| (name.to_owned(), column));
        assert_eq!(table.columns(), expected);
        assert_eq!(table.rows(), 3);
        assert_eq!(Table::new(&[]).rows(), 0);
    }
}
