//! Recorded flights, and other bags.

use std::path::{Path, PathBuf};

use lgvi_bag::BagReader;
use lgvi_review::{FlightBag, Outcome, Value, Verdict};
use lgvi_tables::{Cells, TopicTable, read};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList, PyTuple};

use crate::error;
use crate::scene::result;
use crate::watch::Watch;

/// A rosbag2 bag of MCAP files: a directory or a single file.
///
/// Raises `FileNotFoundError`, or `BagError` if it cannot be read; `recover` makes a readable one of a damaged one.
#[pyclass(frozen, module = "lgvi")]
pub(crate) struct Bag {
    path: PathBuf,
    reader: BagReader,
}

#[pymethods]
impl Bag {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        error::readable(&path, "the bag")?;
        let reader = py.detach(|| BagReader::open(&path));
        match reader {
            Ok(reader) => Ok(Self { path, reader }),
            Err(error) => Err(error::bag(py, error)),
        }
    }

    /// Path of the bag.
    #[getter]
    fn path(&self) -> &Path {
        &self.path
    }

    /// Types of the topics by their names.
    #[getter]
    fn topics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let topics = PyDict::new(py);
        for topic in self.reader.topics() {
            topics.set_item(&topic.name, &topic.type_name)?;
        }
        Ok(topics)
    }

    /// Number of messages of each topic.
    #[getter]
    fn message_counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let counts = PyDict::new(py);
        for (topic, count) in self.reader.message_counts() {
            counts.set_item(topic, count)?;
        }
        Ok(counts)
    }

    /// Returns the messages of a topic as a table, with a row a message.
    ///
    /// Columns are `log_time` and `publish_time` (ns since the UNIX epoch), `sequence`, and the fields of the messages with
    /// dots for nested ones, as in `lgvi convert`. An array that has the same length in all messages, at most
    /// `max_elements`, has a column an element, such as `bodies.0.position.2`.
    #[pyo3(signature = (topic, max_elements = 256))]
    fn table<'py>(
        &self,
        py: Python<'py>,
        topic: String,
        max_elements: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let made = py.detach(|| read(&self.reader, vec![topic.clone()], max_elements));
        let (tables, left_out) = made.map_err(|error| error::bag(py, error))?;
        match (tables.into_iter().next(), left_out.first()) {
            (Some(made), _) => table(py, made),
            (None, Some(left_out)) => {
                let reason = &left_out.reason;
                Err(error::bag(py, format!("{topic} has no table: {reason}")))
            }
            (None, None) => Err(error::bag(py, format!("{topic} has no table"))),
        }
    }

    /// Returns the tables of all topics by their names, read at once. Topics that cannot be decoded are left out.
    #[pyo3(signature = (max_elements = 256))]
    fn tables<'py>(&self, py: Python<'py>, max_elements: usize) -> PyResult<Bound<'py, PyDict>> {
        let made = py.detach(|| read(&self.reader, Vec::new(), max_elements));
        let (made, _) = made.map_err(|error| error::bag(py, error))?;
        let tables = PyDict::new(py);
        for topic in made {
            tables.set_item(topic.topic.clone(), table(py, topic)?)?;
        }
        Ok(tables)
    }

    /// The scene that was flown.
    ///
    /// `flight` names the propagator, such as `/lgvi_propagator`, if the bag has flights of several.
    #[pyo3(signature = (flight = None))]
    fn scene(&self, py: Python<'_>, flight: Option<&str>) -> PyResult<crate::scene::Scene> {
        let bag = py.detach(|| FlightBag::open(&self.path, flight));
        let bag = bag.map_err(|error| error::bag(py, error))?;
        Ok(crate::scene::Scene::new(bag.scene, None))
    }

    /// Flies the recorded flight again from its own scene and controls, and compares every state bit for bit.
    ///
    /// Returns a dict: `outcome` is `"agrees"`, `"differs"`, or `"incomplete"` if a state differs after messages that were
    /// lost; `states` is the number of states compared, `missing` that of states that the record lacks, `complete` whether
    /// it goes to the last step; `difference` is None or a dict of `step`, `body`, `field`, `recorded` and `computed`;
    /// `text` says all of it.
    ///
    /// `flight` names the propagator, such as `/lgvi_propagator`, if the bag has flights of several.
    #[pyo3(signature = (flight = None, progress = None))]
    fn verify<'py>(
        &self,
        py: Python<'py>,
        flight: Option<&str>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut watch = Watch::new(progress);
        let made = py.detach(|| {
            let bag = FlightBag::open(&self.path, flight)?;
            let count = bag.state_count().max(1) as f64;
            lgvi_review::verify(&bag, &mut |states| watch.go_on(states as f64 / count))
        });
        if let Some(error) = watch.interrupted() {
            return Err(error);
        }
        let made = made.map_err(|error| error::bag(py, error))?;
        watch.end(py)?;
        verdict(py, &made)
    }

    /// Makes a new bag in the directory `output`, which must not exist or be empty, of what is readable of a damaged one.
    ///
    /// Returns a dict: `bag` is the new one's path; `messages` are the numbers of messages by topic; `missing` is the number
    /// of messages that the bag is known to have had and that were not recovered, or None; `whole` tells whether nothing
    /// was left out.
    #[staticmethod]
    fn recover<'py>(
        py: Python<'py>,
        path: PathBuf,
        output: PathBuf,
    ) -> PyResult<Bound<'py, PyDict>> {
        error::readable(&path, "the bag")?;
        let made = py.detach(|| lgvi_bag::recover(&path, &output));
        let made = made.map_err(|error| error::bag(py, error))?;
        let dict = PyDict::new(py);
        dict.set_item("bag", &made.bag)?;
        dict.set_item("messages", &made.messages)?;
        dict.set_item("missing", made.missing)?;
        dict.set_item("whole", made.is_whole())?;
        Ok(dict)
    }

    fn __repr__(&self) -> String {
        let (path, topics) = (self.path.display(), self.reader.topics().len());
        format!("Bag({path}, {topics} topics)")
    }
}

/// The table of a topic as one of `lgvi.results`.
fn table<'py>(py: Python<'py>, made: TopicTable) -> PyResult<Bound<'py, PyAny>> {
    let columns = PyDict::new(py);
    for (name, cells) in made.columns {
        columns.set_item(name, column(py, cells)?)?;
    }
    let about = PyDict::new(py);
    about.set_item("topic", made.topic)?;
    about.set_item("type", made.type_name)?;
    result(py, "Table", (columns, about))
}

/// A column as an array, or as a list of what no array holds.
fn column(py: Python<'_>, cells: Cells) -> PyResult<Bound<'_, PyAny>> {
    Ok(match cells {
        Cells::Bool(values) => values.into_pyarray(py).into_any(),
        Cells::Int8(values) => values.into_pyarray(py).into_any(),
        Cells::Uint8(values) => values.into_pyarray(py).into_any(),
        Cells::Int16(values) => values.into_pyarray(py).into_any(),
        Cells::Uint16(values) => values.into_pyarray(py).into_any(),
        Cells::Int32(values) => values.into_pyarray(py).into_any(),
        Cells::Uint32(values) => values.into_pyarray(py).into_any(),
        Cells::Int64(values) => values.into_pyarray(py).into_any(),
        Cells::Uint64(values) => values.into_pyarray(py).into_any(),
        Cells::Float32(values) => values.into_pyarray(py).into_any(),
        Cells::Float64(values) => values.into_pyarray(py).into_any(),
        Cells::Text(texts) => PyList::new(py, texts)?.into_any(),
        Cells::Bytes(cells) => {
            let each = cells.iter().map(|bytes| PyBytes::new(py, bytes));
            PyList::new(py, each)?.into_any()
        }
        Cells::List(rows) => {
            let each = rows.into_iter().map(|row| column(py, row));
            PyList::new(py, each.collect::<PyResult<Vec<_>>>()?)?.into_any()
        }
    })
}

fn verdict<'py>(py: Python<'py>, made: &Verdict) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let outcome = match made.outcome {
        Outcome::Agrees => "agrees",
        Outcome::Incomplete => "incomplete",
        Outcome::Differs => "differs",
    };
    dict.set_item("outcome", outcome)?;
    dict.set_item("states", made.states)?;
    dict.set_item("missing", made.missing)?;
    dict.set_item("complete", made.complete)?;
    let difference = made.difference.as_ref().map(|difference| {
        let dict = PyDict::new(py);
        dict.set_item("step", difference.step)?;
        dict.set_item("body", &difference.body)?;
        dict.set_item("field", &difference.field)?;
        dict.set_item("recorded", value(py, &difference.recorded)?)?;
        dict.set_item("computed", value(py, &difference.computed)?)?;
        PyResult::Ok(dict)
    });
    dict.set_item("difference", difference.transpose()?)?;
    dict.set_item("text", made.to_string())?;
    Ok(dict)
}

fn value<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    let tuple = match value {
        Value::Number(number) => PyTuple::new(py, [number])?,
        Value::Integer(number) => PyTuple::new(py, [number])?,
        Value::Text(text) => PyTuple::new(py, [text])?,
    };
    tuple.get_item(0)
}
