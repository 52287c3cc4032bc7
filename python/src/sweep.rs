//! A scene flown with every combination of some values.

use lgvi_review::sweep::{
    Column, Combination, Flown, SweepError, Table, Variation, combinations, fly_all,
};
use numpy::IntoPyArray;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyMapping};
use toml::Value;

use crate::scene::{Refused, Scene};
use crate::watch::Watch;
use crate::{error, toml_value};

/// The most threads.
const MOST_THREADS: usize = 1024;

/// Flies all combinations and returns their columns.
pub(crate) fn fly<'py>(
    py: Python<'py>,
    scene: &Scene,
    vary: &Bound<'py, PyMapping>,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    if threads > MOST_THREADS {
        return Err(PyValueError::new_err(format!(
            "`threads` is {threads}, expected at most {MOST_THREADS}"
        )));
    }
    let all = combinations(&variations(vary)?).map_err(|error| match &error {
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
    let table = Table::new(&all, &flown.iter().collect::<Vec<_>>());
    let columns = PyDict::new(py);
    for (name, column) in table.columns {
        columns.set_item(name, array(py, column)?)?;
    }
    Ok(columns)
}

/// Reads keys and their values.
fn variations(vary: &Bound<'_, PyMapping>) -> PyResult<Vec<Variation>> {
    let items = vary.items()?;
    let each = items.iter().map(|item| {
        let (key, values): (String, Bound<'_, PyAny>) = item.extract()?;
        match toml_value::value(&values, &key)? {
            Value::Array(values) => Ok(Variation {
                key,
                values: values.iter().map(Value::to_string).collect(),
            }),
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
fn array(py: Python<'_>, column: Column) -> PyResult<Bound<'_, PyAny>> {
    Ok(match column {
        Column::Counts(counts) => counts.into_pyarray(py).into_any(),
        Column::Numbers(numbers) => {
            let numbers = numbers.into_iter().map(|number| number.unwrap_or(f64::NAN));
            numbers.collect::<Vec<_>>().into_pyarray(py).into_any()
        }
        Column::Texts(texts) => PyList::new(py, texts)?.into_any(),
        Column::Values(texts) => {
            let whole = texts.iter().map(|text| text.parse::<i64>());
            let numbers = texts.iter().map(|text| text.parse::<f64>());
            match (
                whole.collect::<Result<Vec<_>, _>>(),
                numbers.collect::<Result<Vec<_>, _>>(),
            ) {
                (Ok(whole), _) => whole.into_pyarray(py).into_any(),
                (_, Ok(numbers)) => numbers.into_pyarray(py).into_any(),
                _ => PyList::new(py, texts)?.into_any(),
            }
        }
    })
}
