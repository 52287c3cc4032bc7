//! A scene flown with every combination of some values.

use std::fmt::Display;
use std::str::FromStr;

use lgvi_review::sweep::{
    Column, Combination, Flown, SweepError, Table, Variation, combinations, fly_all,
};
use numpy::{Element, IntoPyArray, PyArray1};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyMapping};
use toml::Value;

use crate::scene::{Refused, Scene};
use crate::watch::Watch;
use crate::{error, toml_value};

/// Flies all combinations and returns their columns.
pub(crate) fn fly<'py>(
    py: Python<'py>,
    scene: &Scene,
    vary: &Bound<'py, PyMapping>,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    error::threads(threads)?;
    let (variations, kinds): (Vec<_>, Vec<_>) = variations(vary)?.into_iter().unzip();
    let all = combinations(&variations).map_err(|error| match &error {
        SweepError::Empty { key } => error::no_values(py, key, &error),
        _ => PyValueError::new_err(error.to_string()),
    })?;
    let compile = |combination: &Combination| {
        let compiled = scene.compiled(combination.settings());
        compiled.map_err(|refused| (combination.clone(), refused))
    };
    let fly = |_: usize, combination: &Combination, go_on: &dyn Fn() -> bool| {
        Ok(Flown::of(compile(combination)?, go_on, |_, _| ()))
    };
    let count = all.len().max(1) as f64;
    let mut watch = Watch::new(progress);
    let flown = py.detach(|| {
        // A value that the scene refuses is told before the first flight.
        for combination in &all {
            if !watch.go_on(0.0) {
                return Ok(None);
            }
            compile(combination)?;
        }
        fly_all(&all, threads, fly, |flown| {
            watch.go_on(flown as f64 / count)
        })
    });
    let flown: Option<Vec<_>> =
        flown.map_err(|(combination, refused)| with(py, scene, &combination, &refused))?;
    watch.end(py)?;
    let flown = flown.unwrap_or_default();
    let table = Table::new(&all.iter().zip(&flown).collect::<Vec<_>>());
    let columns = PyDict::new(py);
    let mut kinds = kinds.into_iter();
    for (name, column) in table.columns() {
        let column = match column {
            Column::Values(texts) => typed(py, texts, kinds.next().unwrap_or(Kind::Text))?,
            column => array(py, column)?,
        };
        columns.set_item(name, column)?;
    }
    Ok(columns)
}

/// The type of the values of a key.
enum Kind {
    Whole,
    Number,
    Truth,
    Text,
}

impl Kind {
    /// That which all values have; tables, lists, and values of several types are texts of TOML.
    fn of(values: &[Value]) -> Self {
        let all = |is: fn(&Value) -> bool| values.iter().all(is);
        if all(Value::is_integer) {
            Self::Whole
        } else if all(|value| value.is_integer() || value.is_float()) {
            Self::Number
        } else if all(Value::is_bool) {
            Self::Truth
        } else {
            Self::Text
        }
    }
}

/// Reads keys and their values, and of what type these are.
fn variations(vary: &Bound<'_, PyMapping>) -> PyResult<Vec<(Variation, Kind)>> {
    let items = vary.items()?;
    let each = items.iter().map(|item| {
        let (key, values): (String, Bound<'_, PyAny>) = item.extract()?;
        match toml_value::value(&values, &key)? {
            Value::Array(values) => {
                let kind = Kind::of(&values);
                let values = values.iter().map(Value::to_string).collect();
                Ok((Variation { key, values }, kind))
            }
            value => Err(PyTypeError::new_err(format!(
                "`{key}` is {value}, expected a sequence of values"
            ))),
        }
    });
    each.collect()
}

/// The exception of a combination that is no scene, which it names.
fn with(py: Python<'_>, scene: &Scene, combination: &Combination, refused: &Refused) -> PyErr {
    let settings = combination.settings().iter();
    let settings: Vec<_> = settings
        .map(|(key, value)| format!("{key}={value}"))
        .collect();
    let context = format!("with {}: ", settings.join(", "));
    error::refused(py, scene.file(), &context, refused)
}

/// A column as an array, or as a list of texts.
fn array<'py>(py: Python<'py>, column: &Column) -> PyResult<Bound<'py, PyAny>> {
    Ok(match column {
        Column::Counts(counts) => PyArray1::from_slice(py, counts).into_any(),
        Column::Numbers(numbers) => {
            let numbers = numbers.iter().map(|number| number.unwrap_or(f64::NAN));
            PyArray1::from_iter(py, numbers).into_any()
        }
        Column::Texts(texts) | Column::Values(texts) => PyList::new(py, texts)?.into_any(),
    })
}

/// Values of a key as an array of their type, or as a list of texts.
fn typed<'py>(py: Python<'py>, texts: &[String], kind: Kind) -> PyResult<Bound<'py, PyAny>> {
    fn parsed<'py, T: Element + FromStr>(
        py: Python<'py>,
        texts: &[String],
    ) -> PyResult<Bound<'py, PyAny>>
    where
        T::Err: Display,
    {
        let each = texts.iter().map(|text| {
            let value = text.parse::<T>();
            value.map_err(|error| PyValueError::new_err(format!("{text}: {error}")))
        });
        let values = each.collect::<PyResult<Vec<_>>>()?;
        Ok(values.into_pyarray(py).into_any())
    }
    match kind {
        Kind::Whole => parsed::<i64>(py, texts),
        Kind::Number => parsed::<f64>(py, texts),
        Kind::Truth => parsed::<bool>(py, texts),
        Kind::Text => Ok(PyList::new(py, texts)?.into_any()),
    }
}
