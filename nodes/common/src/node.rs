use std::io::Read;
use std::process::ExitCode;
use std::sync::Arc;

use lgvi_middleware::log::{Logging, Rosout};
use lgvi_middleware::report::Reporter;
use lgvi_middleware::ros::RosNode;
use lgvi_middleware::shm::{ShmNode, ShmOptions};
use lgvi_middleware::{Environment, NodeArgs, Parameters, Shutdown, log};
use tracing::error;

use crate::{Event, NodeError, complain};

/// The one argument of our own: report [`Event`]s on standard output, and stop when standard input ends.
const SUPERVISED: &str = "--supervised";

/// A node that has understood its command line and environment.
pub struct Node {
    /// Name, namespace, remappings.
    pub args: NodeArgs,
    /// Parameters not yet taken.
    pub parameters: Parameters,
    /// Raised by SIGINT and SIGTERM, and by the end of a supervisor.
    pub shutdown: Shutdown,
    /// To the supervisor, if there is one.
    pub events: Arc<Reporter<Event>>,
    environment: Environment,
    logging: Logging,
}

impl Node {
    fn start(
        default_name: &str,
        args: impl IntoIterator<Item = String>,
    ) -> Result<Self, NodeError> {
        let (args, rest) = NodeArgs::parse(default_name, args).map_err(NodeError::input)?;
        let supervised = match rest.iter().find(|argument| *argument != SUPERVISED) {
            Some(unknown) => {
                let message = format!(
                    "unknown argument {unknown:?}, expected {SUPERVISED} or --ros-args with what follows"
                );
                return Err(NodeError::Input(message));
            }
            None => !rest.is_empty(),
        };
        let environment = Environment::from_env().map_err(NodeError::input)?;
        let logging = log::init(&args).map_err(NodeError::input)?;
        let shutdown = Shutdown::on_signals().map_err(NodeError::runtime)?;
        let events = if supervised {
            let shutdown = shutdown.clone();
            std::thread::spawn(move || {
                let _ = std::io::stdin().read_to_end(&mut Vec::new());
                shutdown.request();
            });
            Arc::new(Reporter::stdout())
        } else {
            Arc::new(Reporter::disabled())
        };
        let parameters = args.parameters();
        Ok(Self {
            args,
            parameters,
            shutdown,
            events,
            environment,
            logging,
        })
    }

    /// Joins the ROS 2 graph; logs go to `/rosout` as long as the guard lives.
    pub fn ros(&self) -> Result<(RosNode, Rosout), NodeError> {
        let node = RosNode::new(&self.args, &self.environment).map_err(NodeError::runtime)?;
        let rosout = self.logging.attach(&node).map_err(NodeError::runtime)?;
        Ok((node, rosout))
    }

    /// Opens shared memory.
    pub fn shm(&self) -> Result<ShmNode, NodeError> {
        let options = ShmOptions::from_env(&self.environment);
        ShmNode::new(&self.args.fully_qualified_name(), &options).map_err(NodeError::runtime)
    }

    /// Tells the supervisor. One that has gone has raised [`Node::shutdown`] already.
    pub fn report(&self, event: &Event) {
        let _ = self.events.report(event);
    }
}

/// The main function of a node: starts it, runs `body`, and turns its outcome into an exit code (0 done, 1 failed on the
/// way, 2 unusable input).
pub fn main(
    default_name: &str,
    args: impl IntoIterator<Item = String>,
    body: impl FnOnce(&mut Node) -> Result<(), NodeError>,
) -> ExitCode {
    let mut node = match Node::start(default_name, args) {
        Ok(node) => node,
        Err(error) => {
            // Logging needs the arguments that could not be understood.
            complain(&format_args!("{default_name}: {error}"));
            return error.exit_code();
        }
    };
    match body(&mut node) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            error!("{error}");
            node.report(&Event::Failed {
                message: error.to_string(),
            });
            error.exit_code()
        }
    }
}
