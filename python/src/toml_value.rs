//! Python's values as those of TOML.

use lgvi_scene::LONGEST;
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use toml::{Table, Value};

/// Converts dictionaries, sequences, NumPy's arrays and numbers, and strings. Entries that are None are left out.
pub(crate) fn table(dict: &Bound<'_, PyDict>) -> PyResult<Table> {
    Converter { left: LONGEST }.table(dict, "", 0)
}

/// Converts one value.
pub(crate) fn value(object: &Bound<'_, PyAny>, key: &str) -> PyResult<Value> {
    Converter { left: LONGEST }.value(object, key, 0)
}

/// The most tables and arrays in one another: far more than a scene has.
const DEEPEST: usize = 64;

struct Converter {
    /// Values that may follow. A text within the limits of scenes has no more; a list that contains itself has.
    left: usize,
}

impl Converter {
    fn table(&mut self, dict: &Bound<'_, PyDict>, path: &str, depth: usize) -> PyResult<Table> {
        let mut table = Table::new();
        for (key, item) in dict.iter() {
            let name: String = key.extract().map_err(|_| {
                PyTypeError::new_err(format!("key {key} of `{path}` is no str, expected a str"))
            })?;
            if item.is_none() {
                continue;
            }
            let path = match path {
                "" => name.clone(),
                path => format!("{path}.{name}"),
            };
            table.insert(name, self.value(&item, &path, depth + 1)?);
        }
        Ok(table)
    }

    fn value(&mut self, object: &Bound<'_, PyAny>, path: &str, depth: usize) -> PyResult<Value> {
        if depth > DEEPEST {
            let message = format!("`{path}` is nested more than {DEEPEST} times, expected less");
            return Err(PyValueError::new_err(message));
        }
        self.left = self.left.checked_sub(1).ok_or_else(|| {
            PyValueError::new_err(format!(
                "there are more than {LONGEST} values, expected fewer"
            ))
        })?;
        if object.is_instance_of::<PyBool>() {
            return Ok(Value::Boolean(object.extract()?));
        }
        if object.is_instance_of::<PyInt>() {
            return Ok(Value::Integer(object.extract()?));
        }
        if object.is_instance_of::<PyFloat>() {
            return Ok(Value::Float(object.extract()?));
        }
        if object.is_instance_of::<PyString>() {
            return Ok(Value::String(object.extract()?));
        }
        if let Ok(dict) = object.cast::<PyDict>() {
            return self.table(dict, path, depth).map(Value::Table);
        }
        // NumPy's arrays and numbers, as lists and numbers of Python.
        if object.hasattr("tolist")? {
            // Its list may not fit into memory.
            if let Ok(array) = object.cast::<PyUntypedArray>()
                && array.len() > self.left
            {
                let message = format!(
                    "`{path}` has {} elements, expected at most {LONGEST} in all",
                    array.len()
                );
                return Err(PyValueError::new_err(message));
            }
            return self.value(&object.call_method0("tolist")?, path, depth + 1);
        }
        let refuse = |_| {
            let kind = object.get_type();
            PyTypeError::new_err(format!(
                "`{path}` is of {kind}, expected a number, a str, a bool, a dict or a sequence of them"
            ))
        };
        let items = object.try_iter().map_err(refuse)?;
        let each = items.enumerate().map(|(index, item)| {
            let path = format!("{path}[{index}]");
            self.value(&item?, &path, depth + 1)
        });
        each.collect::<PyResult<_>>().map(Value::Array)
    }
}
