//! The command line of a ROS 2 node: what stands between `--ros-args` and `--`.

use std::{fs, io, path::PathBuf};

use serde_yaml_ng::Value;
use tracing_subscriber::filter::LevelFilter;

use crate::{
    names::{self, NameError},
    parameters::Given as GivenParameters,
    params_file,
    remap::{self, Rule, Rules},
};

/// An argument inside `--ros-args` that is not understood.
#[derive(Debug, thiserror::Error)]
pub enum ArgsError {
    /// Not an argument of ROS 2, or one that this node does not support.
    #[error("unknown ROS argument {0:?}")]
    Unknown(String),
    /// The last argument lacks its value.
    #[error("{0} needs a value")]
    MissingValue(String),
    /// Not of the form `[node:]from:=to`.
    #[error("remapping rule {0:?} is not of the form [node:]from:=to")]
    Remap(String),
    /// Not of the form `[node:]name:=value` with a YAML scalar or list as value.
    #[error("parameter {argument:?} is not of the form [node:]name:=value: {reason}")]
    Parameter {
        /// The argument as given.
        argument: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Not `level` or `logger:=level`.
    #[error("log level {0:?} is none of debug, info, warn, error, fatal, or logger:=level")]
    LogLevel(String),
    /// A parameter file cannot be read.
    #[error("cannot read parameter file {}", path.display())]
    ReadFile {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A parameter file is not of the form ROS 2 knows.
    #[error("parameter file {}: {reason}", path.display())]
    ParseFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The node's name or namespace is not allowed.
    #[error(transparent)]
    Name(#[from] NameError),
}

/// What is logged, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogSettings {
    /// `--log-level LEVEL`; `None` if not given.
    pub level: Option<LevelFilter>,
    /// `--log-level LOGGER:=LEVEL`, in order.
    pub loggers: Vec<(String, LevelFilter)>,
    /// The console (`--disable-stdout-logs` as ROS 2 calls it; it is stderr).
    pub console: bool,
    /// The topic `/rosout`.
    pub rosout: bool,
    /// Messages of the libraries underneath.
    pub external: bool,
}

impl Default for LogSettings {
    fn default() -> Self {
        Self {
            level: None,
            loggers: Vec::new(),
            console: true,
            rosout: true,
            external: true,
        }
    }
}

/// Who a node is and what it was told: name, namespace, remappings, parameters, logging.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeArgs {
    name: String,
    namespace: String,
    log: LogSettings,
    rules: Rules,
    parameters: GivenParameters,
}

impl NodeArgs {
    /// Reads a command line without the program's name; returns the arguments that are not for ROS too.
    ///
    /// Parameter files are read here, so that a file that is missing or malformed is reported at once.
    ///
    /// ```
    /// use lgvi_middleware::NodeArgs;
    ///
    /// let line = "scene.toml --ros-args -r __ns:=/chaser -r ~/state:=/truth -- --fast";
    /// let (node, rest) = NodeArgs::parse("lgvi_propagator", line.split(' ').map(Into::into))?;
    /// assert_eq!(node.fully_qualified_name(), "/chaser/lgvi_propagator");
    /// assert_eq!(node.resolve("~/state")?, "/truth");
    /// assert_eq!(rest, ["scene.toml", "--fast"]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn parse(
        default_name: &str,
        args: impl IntoIterator<Item = String>,
    ) -> Result<(Self, Vec<String>), ArgsError> {
        let mut args = args.into_iter();
        let mut rest = Vec::new();
        let mut given = Given::default();
        while let Some(arg) = args.next() {
            match arg.as_str() {
                "--ros-args" => given.read_block(&mut args)?,
                _ => rest.push(arg),
            }
        }
        Ok((given.into_node(default_name)?, rest))
    }

    /// The node's base name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The node's namespace: `/`, or with a leading and no trailing slash.
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// Namespace and name.
    pub fn fully_qualified_name(&self) -> String {
        names::join(&self.namespace, &self.name)
    }

    /// What is logged, and where.
    pub fn log(&self) -> &LogSettings {
        &self.log
    }

    /// The parameters given to this node.
    pub fn parameters(&self) -> GivenParameters {
        self.parameters.clone()
    }

    /// The absolute name of a topic or service, expanded and remapped.
    pub fn resolve(&self, topic: &str) -> Result<String, NameError> {
        self.rules.topic(topic, &self.namespace, &self.name)
    }
}

/// Where parameters come from, in the order of the command line.
enum Source {
    Argument {
        node: Option<String>,
        name: String,
        value: Value,
    },
    File(PathBuf),
}

/// The arguments as read, before the node's name is known.
#[derive(Default)]
struct Given {
    rules: Rules,
    log: LogSettings,
    sources: Vec<Source>,
}

impl Given {
    fn read_block(&mut self, args: &mut impl Iterator<Item = String>) -> Result<(), ArgsError> {
        while let Some(arg) = args.next() {
            let mut value = || {
                args.next()
                    .ok_or_else(|| ArgsError::MissingValue(arg.clone()))
            };
            match arg.as_str() {
                "--" => break,
                "--ros-args" => {}
                "-r" | "--remap" => {
                    let text = value()?;
                    self.rules
                        .push(Rule::parse(&text).ok_or(ArgsError::Remap(text))?);
                }
                "-p" | "--param" => self.sources.push(parse_parameter(value()?)?),
                "--params-file" => self.sources.push(Source::File(value()?.into())),
                "--log-level" => self.set_level(value()?)?,
                _ => self.set_flag(arg)?,
            }
        }
        Ok(())
    }

    fn set_level(&mut self, text: String) -> Result<(), ArgsError> {
        let (logger, level) = match text.split_once(":=") {
            Some((logger, level)) if !logger.is_empty() => (Some(logger), level),
            Some(_) => return Err(ArgsError::LogLevel(text)),
            None => (None, text.as_str()),
        };
        let level = match level.to_ascii_lowercase().as_str() {
            "debug" => LevelFilter::DEBUG,
            "info" => LevelFilter::INFO,
            "warn" => LevelFilter::WARN,
            "error" | "fatal" => LevelFilter::ERROR,
            _ => return Err(ArgsError::LogLevel(text)),
        };
        match logger {
            Some(logger) => self.log.loggers.push((logger.into(), level)),
            None => self.log.level = Some(level),
        }
        Ok(())
    }

    fn set_flag(&mut self, arg: String) -> Result<(), ArgsError> {
        let (on, what) = if let Some(what) = arg.strip_prefix("--enable-") {
            (true, what)
        } else if let Some(what) = arg.strip_prefix("--disable-") {
            (false, what)
        } else {
            return Err(ArgsError::Unknown(arg));
        };
        match what {
            "rosout-logs" => self.log.rosout = on,
            "stdout-logs" => self.log.console = on,
            "external-lib-logs" => self.log.external = on,
            _ => return Err(ArgsError::Unknown(arg)),
        }
        Ok(())
    }

    fn into_node(self, default_name: &str) -> Result<NodeArgs, ArgsError> {
        let name = self.rules.node_name(default_name)?;
        let namespace = self.rules.namespace(default_name)?;
        let qualified = names::join(&namespace, &name);
        let mut parameters = Vec::new();
        for source in self.sources {
            match source {
                Source::Argument { node, name, value } => {
                    if node.is_none_or(|node| params_file::matches(&node, &qualified)) {
                        parameters.push((name, value));
                    }
                }
                Source::File(path) => parameters.extend(read_file(path, &qualified)?),
            }
        }
        Ok(NodeArgs {
            name,
            namespace,
            log: self.log,
            rules: self.rules,
            parameters: GivenParameters::new(parameters),
        })
    }
}

fn parse_parameter(argument: String) -> Result<Source, ArgsError> {
    let fail = |reason: String| ArgsError::Parameter {
        argument: argument.clone(),
        reason,
    };
    let (node, name, text) = remap::split_assignment(&argument)
        .ok_or_else(|| fail("':=' or a name is missing".into()))?;
    let value = serde_yaml_ng::from_str(text).map_err(|error| fail(error.to_string()))?;
    match value {
        Value::Null => Err(fail("the value is missing".into())),
        Value::Mapping(_) | Value::Tagged(_) => {
            Err(fail("the value must be a scalar or a list".into()))
        }
        value => Ok(Source::Argument {
            node: node.map(Into::into),
            name: name.into(),
            value,
        }),
    }
}

fn read_file(path: PathBuf, node: &str) -> Result<Vec<(String, Value)>, ArgsError> {
    match fs::read_to_string(&path) {
        Err(source) => Err(ArgsError::ReadFile { path, source }),
        Ok(text) => {
            params_file::read(&text, node).map_err(|reason| ArgsError::ParseFile { path, reason })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<(NodeArgs, Vec<String>), ArgsError> {
        NodeArgs::parse("node", line.split_whitespace().map(Into::into))
    }

    #[test]
    fn ros_arguments_are_told_from_the_others() {
        let (node, rest) =
            parse("a --ros-args -r __node:=b --remap __ns:=/c -- d --ros-args -p x:=1").unwrap();
        assert_eq!(node.fully_qualified_name(), "/c/b");
        assert_eq!(rest, ["a", "d"]);
        assert_eq!(node.parameters().take("x"), Ok(Some(1_i64)));
    }

    #[test]
    fn names_are_expanded_and_remapped() {
        let (node, _) = parse("--ros-args -r ~/state:=/truth -r other:tf:=/no").unwrap();
        assert_eq!(node.resolve("~/state").unwrap(), "/truth");
        assert_eq!(node.resolve("tf").unwrap(), "/tf");
        assert_eq!(
            node.resolve("~/odometry/chaser").unwrap(),
            "/node/odometry/chaser"
        );
    }

    #[test]
    fn later_parameters_win_and_node_prefixes_select() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("p.yaml");
        fs::write(&file, "/**: {ros__parameters: {a: 2, b: 2, c: [x, y]}}").unwrap();
        let line = format!(
            "--ros-args -p a:=1 --params-file {} -p b:=3 -p node:d:=4 -p other:d:=5",
            file.display()
        );
        let mut given = parse(&line).unwrap().0.parameters();
        assert_eq!(given.take("a"), Ok(Some(2_i64)));
        assert_eq!(given.take("b"), Ok(Some(3_i64)));
        assert_eq!(given.take("c"), Ok(Some(vec!["x".to_string(), "y".into()])));
        assert_eq!(given.take("d"), Ok(Some(4_i64)));
        assert_eq!(given.finish(), Ok(()));
    }

    #[test]
    fn logging_is_set_by_level_logger_and_switch() {
        let (node, _) = parse(
            "--ros-args --log-level WARN --log-level lgvi:=debug --disable-rosout-logs \
             --disable-stdout-logs --enable-stdout-logs --disable-external-lib-logs",
        )
        .unwrap();
        assert_eq!(
            node.log(),
            &LogSettings {
                level: Some(LevelFilter::WARN),
                loggers: vec![("lgvi".into(), LevelFilter::DEBUG)],
                console: true,
                rosout: false,
                external: false,
            }
        );
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (line, expected) in [
            (
                "--ros-args --nonsense",
                "unknown ROS argument \"--nonsense\"",
            ),
            ("--ros-args stray", "unknown ROS argument \"stray\""),
            ("--ros-args --enable-magic", "unknown ROS argument"),
            ("--ros-args -r", "-r needs a value"),
            ("--ros-args -r a:b", "not of the form [node:]from:=to"),
            ("--ros-args -p a=b", "not of the form"),
            ("--ros-args -p a:=", "the value is missing"),
            ("--ros-args -p a:={x:1}", "scalar or a list"),
            ("--ros-args --log-level loud", "\"loud\""),
            ("--ros-args -r __node:=a/b", "must not contain '/'"),
            ("--ros-args --params-file /nowhere.yaml", "/nowhere.yaml"),
        ] {
            let error = parse(line).unwrap_err().to_string();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
