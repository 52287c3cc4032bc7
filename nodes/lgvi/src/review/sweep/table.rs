use std::collections::{BTreeMap, BTreeSet};

use super::{Combination, Flown};

/// The table of a sweep: a row for each flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Names and cells: `flight`, the keys that vary, `steps`, `failure`, and the numbers at the end.
    pub columns: Vec<(String, Column)>,
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
    /// The table of these flights of all combinations. Scenes of different bodies have different columns, which come in the
    /// order of the flights.
    pub fn new(combinations: &[Combination], flown: &[&Flown]) -> Self {
        let settings = combinations.first().map_or(&[][..], Combination::settings);
        let keys = settings.iter().enumerate().map(|(index, (key, _))| {
            let values = combinations.iter();
            let values = values.map(|one| plain(&one.settings()[index].1)).collect();
            (key.clone(), Column::Values(values))
        });
        let each = || flown.iter();
        let failures = each().map(|flight| flight.failure.clone().unwrap_or_default());
        let mut columns = vec![(
            "flight".to_owned(),
            Column::Counts((0..flown.len() as u64).collect()),
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
        Self { columns }
    }
}

/// A value without the quotes of a TOML string.
fn plain(value: &str) -> String {
    match value.parse::<toml_edit::Value>() {
        Ok(toml_edit::Value::String(text)) => text.into_value(),
        _ => value.to_owned(),
    }
}
