use std::io::{self, Read};
use std::sync::Arc;

use crate::log::Rosout;
use crate::report::Reporter;
use crate::ros::{Clock, Diagnostics, Executor, Lifecycle, RosError, RosNode, Running};
use crate::shm::{ShmNode, ShmOptions};
use crate::{Environment, NodeArgs, ParameterChange, ParameterSpec, Parameters, Shutdown, log};
use serde::Serialize;

use super::file_lock::{FileLock, LockError};
use super::namesakes::{self, Namesakes};
use super::{NodeError, let_long_files_fail};

/// The one argument of our own: report events on standard output, and stop when standard input ends.
const SUPERVISED: &str = "--supervised";

/// The parameter that has the levels of loggers served; as the option of the same name of `rclcpp` and `rclpy`, off unless
/// set.
const LOGGER_SERVICE: &str = "enable_logger_service";

/// A managed node of the ROS 2 graph. Its parameters, lifecycle and diagnostics are served in the background.
pub struct Node {
    // Fields are dropped in this order.
    _executor: Running,
    _rosout: Rosout,
    /// Name, namespace, remappings.
    pub args: NodeArgs,
    /// Its parameters.
    pub parameters: Parameters,
    /// Its lifecycle.
    pub lifecycle: Lifecycle,
    /// Its parts on `/diagnostics`.
    pub diagnostics: Diagnostics,
    /// Its clock, chosen by `use_sim_time`.
    pub clock: Clock,
    /// Raised by SIGINT, SIGTERM and SIGHUP, and when the supervisor ends.
    pub shutdown: Shutdown,
    /// Reports to the process that started the node.
    pub events: Arc<Reporter>,
    /// The node in the ROS 2 graph.
    pub ros: RosNode,
    pub(crate) autostart: bool,
    pub(crate) namesakes: Namesakes,
    environment: Environment,
    _alone: FileLock,
}

impl Node {
    pub(crate) fn start(
        default_name: &str,
        args: impl IntoIterator<Item = String>,
        mut parameters: Vec<ParameterSpec>,
        events: Option<Arc<Reporter>>,
    ) -> Result<Self, NodeError> {
        let (args, rest) = NodeArgs::parse(default_name, args).map_err(NodeError::input)?;
        let supervised = is_supervised(&rest)?;
        let environment = Environment::from_env().map_err(NodeError::input)?;
        let logging = log::init(&args).map_err(NodeError::input)?;
        parameters.extend(common());
        parameters.push(logging.levels().specification());
        let parameters = Parameters::declare(args.parameters(), parameters)?;
        let_long_files_fail().map_err(NodeError::runtime)?;
        let shutdown = Shutdown::on_signals().map_err(NodeError::runtime)?;
        let events = match events {
            Some(events) => events,
            None if supervised => {
                supervise(&shutdown);
                Arc::new(Reporter::to_writer(io::stdout()).map_err(NodeError::runtime)?)
            }
            None => Arc::new(Reporter::disabled()),
        };
        let alone = only_one(&environment, &args)?;
        let ros = RosNode::new(&args, &environment).map_err(|error| match error {
            RosError::Security(error) => NodeError::input(error),
            error => NodeError::runtime(error),
        })?;
        ros.leave_on(&shutdown);
        let rosout = logging.attach(&ros)?;

        let mut executor = Executor::new();
        let namesakes = Namesakes::watch(&ros, &mut executor, &environment, &shutdown);
        let clock = if parameters.get("use_sim_time")? {
            Clock::simulated(&ros, &mut executor)?
        } else {
            Clock::wall()
        };
        parameters.serve(&ros, &mut executor)?;
        let levels = logging.levels();
        levels.follow(&parameters).map_err(NodeError::runtime)?;
        if parameters.get(LOGGER_SERVICE)? {
            levels.serve(&parameters, &ros, &mut executor)?;
        }
        Ok(Self {
            lifecycle: Lifecycle::serve(&ros, &mut executor)?,
            diagnostics: Diagnostics::serve(&ros, &mut executor, clock.clone())?,
            autostart: parameters.get("autostart")?,
            _executor: executor.start()?,
            _rosout: rosout,
            args,
            parameters,
            clock,
            shutdown,
            events,
            ros,
            namesakes,
            environment,
            _alone: alone,
        })
    }

    /// Whether an active node must stop: a transition was requested, or the process is to end. Does not lock.
    pub fn interrupted(&self) -> bool {
        self.shutdown.requested() || self.lifecycle.asked()
    }

    /// Opens shared memory.
    pub fn shm(&self) -> Result<ShmNode, NodeError> {
        let options = ShmOptions::from_env(&self.environment);
        let shm = ShmNode::new(&self.args.fully_qualified_name(), &options)?;
        Ok(shm.leave_on(&self.shutdown))
    }

    /// Reports to the process that started the node, if that asked for reports. If it has ended, [`Node::shutdown`] is
    /// raised.
    pub fn report(&self, event: impl Serialize + Send + 'static) {
        self.events.report(event);
    }

    /// Reports progress, which later progress may replace. Does not wait.
    pub fn report_progress(&self, event: impl Serialize + Send + 'static) {
        self.events.progress(event);
    }
}

/// The parameters of every node.
pub(crate) fn common() -> [ParameterSpec; 3] {
    [
        ParameterSpec::new(
            LOGGER_SERVICE,
            false,
            "offer ~/get_logger_levels and ~/set_logger_levels",
        )
        .change(ParameterChange::Never),
        ParameterSpec::new(
            "use_sim_time",
            false,
            "use the time of /clock",
        )
        .change(ParameterChange::Never),
        ParameterSpec::new(
            "autostart",
            true,
            "configure and activate at the start, and exit on an error; false: a lifecycle manager does so",
        )
        .change(ParameterChange::Never),
    ]
}

fn is_supervised(rest: &[String]) -> Result<bool, NodeError> {
    match rest.iter().find(|argument| *argument != SUPERVISED) {
        Some(unknown) => Err(NodeError::Input(format!(
            "unknown argument {unknown:?}, expected {SUPERVISED} or --ros-args with what follows"
        ))),
        None => Ok(!rest.is_empty()),
    }
}

/// Raises the shutdown when standard input ends.
fn supervise(shutdown: &Shutdown) {
    let shutdown = shutdown.clone();
    std::thread::spawn(move || {
        let _ = io::stdin().read_to_end(&mut Vec::new());
        shutdown.request();
    });
}

/// Refuses a second node of the same name on this host.
fn only_one(environment: &Environment, args: &NodeArgs) -> Result<FileLock, NodeError> {
    let name = args.fully_qualified_name();
    let lock = format!("node{}", name.replace('/', "."));
    FileLock::take(environment, &lock, &name).map_err(|error| match error {
        LockError::Held(other) => {
            NodeError::Input(namesakes::refusal(&name, environment.domain_id, &other))
        }
        error => NodeError::runtime(error),
    })
}
