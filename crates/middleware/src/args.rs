//! The command line of a ROS 2 node: what stands between `--ros-args` and `--`.

use std::{
    fs::File,
    io::{self, Read},
    path::PathBuf,
};

use crate::{
    LogSettings, ParameterValue,
    assignment::Assignment,
    names::{self, Kind, NameError},
    parameters::Given as GivenParameters,
    params_file,
    remap::{Rule, Rules},
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
    /// Not of the form `[node:]from:=to`, or with a name that ROS 2 does not allow.
    #[error("remapping rule {rule:?}: {reason}")]
    Remap {
        /// The rule as given.
        rule: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Not of the form `[node:]name:=value` with a YAML scalar or list as value.
    #[error("parameter {argument:?} is not of the form [node:]name:=value: {reason}")]
    Parameter {
        /// The argument as given.
        argument: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Not `level` or `logger:=level`.
    #[error("log level {0:?} is none of debug, info, warn, error, fatal, unset, or logger:=level")]
    LogLevel(String),
    /// An argument about files of logging, and its value.
    #[error("{0} {1:?} is not supported: logging has no files; redirect standard error")]
    LogFile(String, String),
    /// A parameter file cannot be read.
    #[error("cannot read parameter file {}: {source}", path.display())]
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

/// Who a node is and what it was told: name, namespace, remappings, parameters, logging.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeArgs {
    name: String,
    namespace: String,
    log: LogSettings,
    rules: Rules,
    parameters: GivenParameters,
    enclave: String,
    notices: Vec<String>,
}

impl NodeArgs {
    /// Reads a command line without the program's name; returns the arguments that are not for ROS too.
    ///
    /// ROS arguments stand between `--ros-args` and `--` or the end, in any number of blocks. Outside of them a
    /// remapping rule is one too, as in ROS 2, which calls it deprecated; see [`notices`](Self::notices). Parameter
    /// files are read here, so that a file that is missing or malformed is reported at once.
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
                _ => match Rule::parse(&arg) {
                    Ok(rule) => given.push_deprecated(rule, &arg),
                    Err(_) => rest.push(arg),
                },
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

    /// The security enclave, `/` by default; [`Security`](crate::Security) may override it.
    pub fn enclave(&self) -> &str {
        &self.enclave
    }

    /// What is to be said about the command line when logging is set up.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// The absolute name of a topic, expanded and remapped.
    pub fn resolve(&self, topic: &str) -> Result<String, NameError> {
        self.resolve_as(Kind::Topic, topic)
    }

    /// The absolute name of a service, expanded and remapped.
    pub fn resolve_service(&self, service: &str) -> Result<String, NameError> {
        self.resolve_as(Kind::Service, service)
    }

    /// The absolute name of an action, expanded and remapped by rules that are neither for topics nor for services
    /// only. Its topics and services, `<action>/_action/…`, are remapped on their own, which is all that ROS 2 Jazzy
    /// does.
    pub fn resolve_action(&self, action: &str) -> Result<String, NameError> {
        self.resolve_as(Kind::Action, action)
    }

    fn resolve_as(&self, kind: Kind, name: &str) -> Result<String, NameError> {
        self.rules.resolve(kind, name, &self.namespace, &self.name)
    }
}

/// Where parameters come from, in the order of the command line.
enum Source {
    Argument(Assignment),
    File(PathBuf),
}

/// The arguments as read, before the node's name is known.
#[derive(Default)]
struct Given {
    rules: Rules,
    log: LogSettings,
    sources: Vec<Source>,
    enclave: Option<String>,
    notices: Vec<String>,
}

impl Given {
    fn push_deprecated(&mut self, rule: Rule, text: &str) {
        self.rules.push(rule);
        self.notices.push(format!(
            "the remapping rule {text:?} stands outside of --ros-args, which is deprecated: use --ros-args -r {text}"
        ));
    }

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
                    let rule = value()?;
                    match Rule::parse(&rule) {
                        Ok(rule) => self.rules.push(rule),
                        Err(reason) => return Err(ArgsError::Remap { rule, reason }),
                    }
                }
                "-p" | "--param" => {
                    let argument = value()?;
                    match Assignment::parse(&argument) {
                        Ok(assignment) => self.sources.push(Source::Argument(assignment)),
                        Err(reason) => return Err(ArgsError::Parameter { argument, reason }),
                    }
                }
                "--params-file" => self.sources.push(Source::File(value()?.into())),
                "--log-level" => {
                    let text = value()?;
                    if !self.log.set_level(&text) {
                        return Err(ArgsError::LogLevel(text));
                    }
                }
                "--log-config-file" | "--log-file-name" => {
                    let value = value()?;
                    // An empty one asks for nothing.
                    if !value.is_empty() {
                        return Err(ArgsError::LogFile(arg, value));
                    }
                }
                "-e" | "--enclave" => {
                    let enclave = value()?;
                    names::check_namespace(names::ENCLAVE, &enclave)?;
                    self.enclave = Some(enclave);
                }
                _ if self.log.set_switch(&arg) => {}
                _ => return Err(ArgsError::Unknown(arg)),
            }
        }
        Ok(())
    }

    fn into_node(self, default_name: &str) -> Result<NodeArgs, ArgsError> {
        let name = self.rules.node_name(default_name)?;
        let namespace = self.rules.namespace(&name);
        let qualified = names::join(&namespace, &name);
        let mut parameters = GivenParameters::new();
        for source in self.sources {
            match source {
                Source::Argument(assignment) if assignment.is_for(&qualified) => {
                    parameters.insert(assignment.name, assignment.value);
                }
                Source::Argument(_) => {}
                Source::File(path) => parameters.extend(read_file(path, &qualified)?),
            }
        }
        Ok(NodeArgs {
            name,
            namespace,
            log: self.log,
            rules: self.rules,
            parameters,
            enclave: self.enclave.unwrap_or_else(|| "/".into()),
            notices: self.notices,
        })
    }
}

/// Bytes of the longest parameter file: what is longer is none, and a device may have no end.
const LONGEST_FILE: u64 = 4 << 20;

fn read_file(path: PathBuf, node: &str) -> Result<Vec<(String, ParameterValue)>, ArgsError> {
    let read = || {
        let mut text = String::new();
        let file = File::open(&path)?;
        file.take(LONGEST_FILE + 1).read_to_string(&mut text)?;
        Ok(text)
    };
    match read() {
        Err(source) => Err(ArgsError::ReadFile { path, source }),
        Ok(text) if text.len() as u64 > LONGEST_FILE => {
            let reason = format!("it is longer than {LONGEST_FILE} bytes");
            Err(ArgsError::ParseFile { path, reason })
        }
        Ok(text) => {
            params_file::read(&text, node).map_err(|reason| ArgsError::ParseFile { path, reason })
        }
    }
}

#[cfg(test)]
mod tests;
