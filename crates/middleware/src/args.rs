//! The command line of a ROS 2 node: what stands between `--ros-args` and `--`.

use std::{fs, io, path::PathBuf};

use serde_yaml_ng::Value;

use crate::{
    LogSettings,
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
    /// An argument of ROS 2 that this node cannot honour.
    #[error("{argument} {value:?} is not supported: {reason}")]
    Unsupported {
        /// The argument.
        argument: &'static str,
        /// Its value.
        value: String,
        /// Why.
        reason: &'static str,
    },
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

    /// The security enclave, `/` by default. There is no security: it is checked, and used for nothing.
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
                "--log-config-file" => refuse("--log-config-file", value()?, NO_LOG_CONFIG)?,
                "--log-file-name" => refuse("--log-file-name", value()?, NO_LOG_FILE)?,
                "-e" | "--enclave" => {
                    let enclave = value()?;
                    names::check_enclave(&enclave)?;
                    self.enclave = Some(enclave);
                }
                _ if self.log.set_switch(&arg) => {}
                _ => return Err(ArgsError::Unknown(arg)),
            }
        }
        Ok(())
    }

    fn into_node(mut self, default_name: &str) -> Result<NodeArgs, ArgsError> {
        let name = self.rules.node_name(default_name)?;
        let namespace = self.rules.namespace(&name);
        let qualified = names::join(&namespace, &name);
        self.log.call_node_by(&qualified, &name);
        let mut parameters = Vec::new();
        for source in self.sources {
            match source {
                Source::Argument(assignment) => {
                    if assignment.is_for(&qualified) {
                        parameters.push((assignment.name, assignment.value));
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
            enclave: self.enclave.unwrap_or_else(|| "/".into()),
            notices: self.notices,
        })
    }
}

/// Why some arguments of ROS 2 are refused.
const NO_LOG_CONFIG: &str =
    "logging has no configuration file, as with the default logging of ROS 2";
const NO_LOG_FILE: &str = "no log file is written; redirect standard error";

/// Refuses an argument, unless its value is empty: then it asks for nothing.
fn refuse(argument: &'static str, value: String, reason: &'static str) -> Result<(), ArgsError> {
    if value.is_empty() {
        return Ok(());
    }
    Err(ArgsError::Unsupported {
        argument,
        value,
        reason,
    })
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
    use tracing_subscriber::filter::LevelFilter;

    use super::*;

    fn parse(line: &str) -> Result<(NodeArgs, Vec<String>), ArgsError> {
        NodeArgs::parse("node", line.split_whitespace().map(Into::into))
    }

    #[test]
    fn ros_arguments_are_told_from_the_others() {
        let (node, rest) = parse(
            "a --ros-args -r __node:=b --remap __ns:=/c -- d -- --ros-args --ros-args -p x:=1 --",
        )
        .unwrap();
        assert_eq!(node.fully_qualified_name(), "/c/b");
        assert_eq!(rest, ["a", "d", "--"]);
        assert_eq!(node.parameters().take("x"), Ok(Some(1_i64)));
        assert!(node.notices().is_empty());
    }

    #[test]
    fn rules_outside_of_ros_arguments_count_and_are_remarked_upon() {
        let (node, rest) =
            parse("__node:=a --ros-args -r __node:=b -- __ns:=c x:= tf:=/tf2").unwrap();
        assert_eq!(node.fully_qualified_name(), "/a");
        assert_eq!(node.resolve("tf").unwrap(), "/tf2");
        assert_eq!(rest, ["__ns:=c", "x:="]);
        let [name, topic] = node.notices() else {
            panic!("{:?}", node.notices());
        };
        assert!(name.contains("\"__node:=a\"") && topic.contains("-r tf:=/tf2"));
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
    fn topics_services_and_actions_are_remapped_each_by_their_rules() {
        let line = "--ros-args -r rostopic://~/x:=/topic -r rosservice://~/x:=/service -r ~/x:=/all \
                    -r /all/_action/feedback:=/feedback";
        let (node, _) = parse(line).unwrap();
        assert_eq!(node.resolve("~/x").unwrap(), "/topic");
        assert_eq!(node.resolve_service("~/x").unwrap(), "/service");
        assert_eq!(node.resolve_action("~/x").unwrap(), "/all");
        assert_eq!(node.resolve("/all/_action/feedback").unwrap(), "/feedback");
        let error = node.resolve_service("a//b").unwrap_err().to_string();
        assert!(error.starts_with("service \"/a//b\""), "{error}");
    }

    #[test]
    fn the_enclave_is_the_last_one_given() {
        let enclave = |line| parse(line).unwrap().0.enclave().to_owned();
        assert_eq!(enclave(""), "/");
        assert_eq!(enclave("--ros-args -e /a/b"), "/a/b");
        assert_eq!(enclave("--ros-args --enclave /a -e /"), "/");
    }

    #[test]
    fn parameters_of_other_nodes_and_namespaces_are_not_ours() {
        let taken = |line| {
            parse(line)
                .unwrap()
                .0
                .parameters()
                .take::<i64>("x")
                .unwrap()
        };
        assert_eq!(taken("--ros-args -p node:x:=1"), Some(1));
        assert_eq!(taken("--ros-args -p other:x:=1"), None);
        assert_eq!(taken("--ros-args -r __node:=q -p node:x:=1"), None);
        assert_eq!(taken("--ros-args -r __node:=q -p q:x:=1"), Some(1));
        // A prefix is a name in the root namespace, as in rcl.
        assert_eq!(taken("--ros-args -r __ns:=/ns -p node:x:=1"), None);
    }

    #[test]
    fn later_parameters_win_and_node_prefixes_select() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("p.yaml");
        fs::write(&file, "/**: {ros__parameters: {a: 2, b: 2, c: [p, q]}}").unwrap();
        let line = format!(
            "--ros-args -p a:=1 --params-file {} -p b:=3 -p node:d:=4 -p other:d:=5",
            file.display()
        );
        let mut given = parse(&line).unwrap().0.parameters();
        assert_eq!(given.take("a"), Ok(Some(2_i64)));
        assert_eq!(given.take("b"), Ok(Some(3_i64)));
        assert_eq!(given.take("c"), Ok(Some(vec!["p".to_string(), "q".into()])));
        assert_eq!(given.take("d"), Ok(Some(4_i64)));
        assert_eq!(given.finish(), Ok(()));
    }

    #[test]
    fn logging_is_set_by_level_logger_and_switch() {
        let (node, _) = parse(
            "--ros-args --log-level WARN --log-level lgvi:=debug --disable-rosout-logs \
             --disable-stdout-logs --enable-stdout-logs --disable-external-lib-logs \
             --log-level gone:=info --log-level gone:=UNSET",
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
    fn the_logger_of_a_node_bears_its_namespace() {
        let loggers = |line| parse(line).unwrap().0.log().loggers.clone();
        let expected = [("node".to_owned(), LevelFilter::DEBUG)];
        assert_eq!(
            loggers("--ros-args -r __ns:=/a/b --log-level a.b.node:=debug"),
            expected
        );
        assert_eq!(
            loggers("--ros-args -r __ns:=/a/b --log-level node:=debug"),
            expected
        );
    }

    #[test]
    fn what_asks_for_nothing_is_accepted() {
        let line = ["--ros-args", "--log-config-file", "", "--log-file-name", ""];
        assert!(NodeArgs::parse("node", line.map(Into::into)).is_ok());
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
            ("--ros-args --remap=a:=b", "unknown ROS argument"),
            ("--ros-args __node:=b", "unknown ROS argument \"__node:=b\""),
            (
                "--ros-args --param-file x",
                "unknown ROS argument \"--param-file\"",
            ),
            ("--ros-args -e", "-e needs a value"),
            ("--ros-args -e a", "enclave \"a\" must start with '/'"),
            ("--ros-args -e /a/", "enclave \"/a/\""),
            (
                "--ros-args --log-file-name x",
                "--log-file-name \"x\" is not supported",
            ),
            (
                "--ros-args --log-config-file x",
                "--log-config-file \"x\" is not supported",
            ),
            (
                "--ros-args -r a:b",
                "remapping rule \"a:b\": it is not of the form",
            ),
            (
                "--ros-args -r a:={node}",
                "remapping rule \"a:={node}\": \"{node}\" is no name",
            ),
            (
                "--ros-args -r __ns:=b",
                "namespace \"b\" must start with '/'",
            ),
            ("--ros-args -p a=b", "not of the form"),
            ("--ros-args -p /**:a:=1", "\"/**\" is no name of a node"),
            (
                "--ros-args -p a:=[1,x]",
                "all of a list must be of one type",
            ),
            ("--ros-args -p a:=", "the value is missing"),
            ("--ros-args -p a:={x}", "scalar or a list"),
            ("--ros-args --log-level loud", "\"loud\""),
            ("--ros-args -r __node:=a/b", "must not contain '/'"),
            ("--ros-args --params-file /nowhere.yaml", "/nowhere.yaml"),
        ] {
            let error = parse(line).unwrap_err().to_string();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
