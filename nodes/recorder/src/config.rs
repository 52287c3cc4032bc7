//! The node's parameters.

use std::num::NonZeroU64;
use std::path::PathBuf;
use std::time::Duration;

use lgvi_bag::{BagOptions, Compression};
use lgvi_common::{FramePrefix, Selection};
use lgvi_middleware::node::NodeError;
use lgvi_middleware::{NameError, ParameterSpec, ParameterValue, Parameters};

use crate::log_time::LogTime;
use crate::selection::Wanted;

/// What may wait to be written, unless told otherwise (bytes).
const CACHE: i64 = 64 << 20;

/// Topics that all nodes of a graph share, whatever their namespace.
const SHARED: [&str; 6] = [
    "/tf",
    "/tf_static",
    "/clock",
    "/diagnostics",
    "/rosout",
    "/parameter_events",
];

/// Each name with what it stands for.
const COMPRESSIONS: [(&str, Compression); 3] = [
    ("none", Compression::None),
    ("lz4", Compression::Lz4),
    ("zstd", Compression::Zstd),
];
const LOG_TIMES: [(&str, LogTime); 2] =
    [("received", LogTime::Received), ("stamp", LogTime::Stamp)];

/// The node's parameters.
pub(crate) struct Config {
    /// `output`: the bag's directory, which must not exist; by default named after the time.
    pub(crate) output: PathBuf,
    /// `compression`, `max_bytes`, `max_duration`.
    pub(crate) options: BagOptions,
    /// `max_cache_size`: what may wait to be written (bytes).
    pub(crate) cache: usize,
    states: Vec<String>,
    frame: String,
    frame_prefix: FramePrefix,
    /// `log_time`: what messages are logged at.
    pub(crate) log_time: LogTime,
    /// `await_stamp`: whether messages wait without limit for the first time to be logged at.
    pub(crate) await_stamp: bool,
    /// `start_paused`: whether nothing is recorded before `~/resume`.
    pub(crate) start_paused: bool,
    /// `topics`: topics to take from DDS, each as a name or as `name=package/msg/Type`; none: all that nothing else
    /// chooses among.
    topics: Option<Vec<String>>,
    exclude_topics: Vec<String>,
    include_hidden_topics: bool,
}

pub(crate) fn specifications() -> Vec<ParameterSpec> {
    let none = Vec::<String>::new;
    let [regex, exclude_regex] = Selection::patterns(
        "also record ROS 2 topics whose names match; empty: none",
        "do not record ROS 2 topics whose names match; empty: none",
    );
    vec![
        ParameterSpec::new(
            "output",
            String::new(),
            "directory of the new bag; empty: named after the time",
        ),
        named(
            "compression",
            "zstd",
            &COMPRESSIONS,
            "compression of the bag's chunks",
        ),
        ParameterSpec::new(
            "max_bytes",
            0,
            "size at which a new file of the bag begins (bytes); 0: never",
        )
        .integer_range(0, i64::MAX),
        ParameterSpec::new(
            "max_duration",
            0.0,
            "log time after which a new file of the bag begins (s); 0: never",
        )
        .range(0.0, 1e9),
        ParameterSpec::new(
            "max_cache_size",
            CACHE,
            "size of the write queue (bytes); when it is full, receiving waits",
        )
        .integer_range(1, i64::MAX),
        ParameterSpec::new(
            "states",
            vec!["lgvi_propagator/state".to_owned()],
            "state topics to record from shared memory at full rate",
        ),
        ParameterSpec::optional::<Vec<String>>(
            "topics",
            "ROS 2 topics to record, each as name or name=package/msg/Type; not set: those that match regex, or all of the node's \
             namespace and global ones such as /tf",
        ),
        regex,
        ParameterSpec::new("exclude_topics", none(), "ROS 2 topics not to record"),
        exclude_regex,
        ParameterSpec::new(
            "include_hidden_topics",
            false,
            "also record hidden topics, which have a name part that begins with '_'",
        ),
        ParameterSpec::new(
            "frame",
            "inertial".to_owned(),
            "inertial frame of the states from shared memory, without prefix",
        ),
        FramePrefix::specification(),
        named(
            "log_time",
            "received",
            &LOG_TIMES,
            "log time of a message: when it was received, or its stamp",
        ),
        ParameterSpec::new(
            "await_stamp",
            false,
            "hold messages without a time until the first stamp or /clock message comes; a kill before that loses them",
        ),
        ParameterSpec::new(
            "start_paused",
            false,
            "start paused, until ~/resume is called",
        ),
    ]
}

impl Config {
    pub(crate) fn read(parameters: &Parameters) -> Result<Self, NodeError> {
        let output: String = parameters.get("output")?;
        let bytes: i64 = parameters.get("max_bytes")?;
        let cache: i64 = parameters.get("max_cache_size")?;
        let seconds: f64 = parameters.get("max_duration")?;
        Ok(Self {
            output: if output.is_empty() {
                chrono::Local::now()
                    .format("rosbag2_%Y_%m_%d-%H_%M_%S")
                    .to_string()
                    .into()
            } else {
                output.into()
            },
            options: BagOptions {
                compression: chosen(parameters, "compression", &COMPRESSIONS)?,
                max_bytes: NonZeroU64::new(bytes.unsigned_abs()),
                max_duration: (seconds > 0.0).then(|| Duration::from_secs_f64(seconds)),
            },
            cache: usize::try_from(cache).unwrap_or(usize::MAX),
            states: parameters.get("states")?,
            frame: parameters.get("frame")?,
            frame_prefix: FramePrefix::read(parameters)?,
            log_time: chosen(parameters, "log_time", &LOG_TIMES)?,
            await_stamp: parameters.get("await_stamp")?,
            start_paused: parameters.get("start_paused")?,
            topics: parameters.get_optional("topics")?,
            exclude_topics: parameters.get("exclude_topics")?,
            include_hidden_topics: parameters.get("include_hidden_topics")?,
        })
    }

    /// `states`: topics of full-rate states to take from shared memory, each once, where `resolve` makes names absolute.
    pub(crate) fn states(
        &self,
        resolve: impl Fn(&str) -> Result<String, NameError>,
    ) -> Result<Vec<String>, NameError> {
        let mut names = Vec::with_capacity(self.states.len());
        for name in &self.states {
            let name = resolve(name)?;
            if !names.contains(&name) {
                names.push(name);
            }
        }
        Ok(names)
    }

    /// The inertial frame of a topic of states from shared memory, which do not carry it: `frame`, behind `frame_prefix` for
    /// the namespace of the node that the topic is named after.
    pub(crate) fn frame_of(&self, topic: &str) -> String {
        let namespace = topic.rsplitn(3, '/').nth(2).unwrap_or_default();
        self.frame_prefix.of(namespace) + &self.frame
    }

    /// The topics of known types among `topics`: names and types.
    pub(crate) fn typed(&self) -> impl Iterator<Item = (&str, &str)> {
        let topics = self.topics.iter().flatten();
        topics.filter_map(|topic| topic.split_once('='))
    }

    /// What is taken from DDS by the node of this name, where `resolve` makes names absolute.
    pub(crate) fn wanted(
        &self,
        parameters: &Parameters,
        node: &str,
        resolve: impl Fn(&str) -> Result<String, NameError>,
    ) -> Result<Wanted, NodeError> {
        let resolve = |topic: &String| {
            let name = topic.split_once('=').map_or(&**topic, |(name, _)| name);
            resolve(name)
        };
        let all = |topics: &[String]| topics.iter().map(resolve).collect::<Result<_, _>>();
        let names = self.topics.as_deref().map(all).transpose()?;
        Ok(Wanted {
            selection: Selection::read(parameters, names, all(&self.exclude_topics)?)?,
            namespace: node[..=node.rfind('/').unwrap_or_default()].to_owned(),
            shared: all(&SHARED.map(String::from))?,
            hidden: self.include_hidden_topics,
        })
    }
}

/// A parameter that is one of some names.
fn named<T>(
    name: &str,
    default: &str,
    choices: &'static [(&str, T)],
    description: &str,
) -> ParameterSpec
where
    T: Sync,
{
    let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
    let names = names.join(", ");
    ParameterSpec::new(name, default.to_owned(), description)
        .constraints(&names)
        .check(move |value| {
            let known = |(name, _): &(&str, T)| matches!(value, ParameterValue::String(value) if value == name);
            if choices.iter().any(known) {
                Ok(())
            } else {
                Err(format!("expected one of {names}"))
            }
        })
}

fn chosen<T: Copy>(
    parameters: &Parameters,
    name: &str,
    choices: &[(&str, T)],
) -> Result<T, NodeError> {
    let value: String = parameters.get(name)?;
    let found = choices.iter().find(|(choice, _)| *choice == value);
    // Others are refused before.
    found
        .map(|(_, chosen)| *chosen)
        .ok_or_else(|| NodeError::Input(format!("parameter {name:?} is {value:?}")))
}
