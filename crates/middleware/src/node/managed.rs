use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use crate::ParameterSpec;
use crate::report::Reporter;
use crate::ros::{Change, Outcome, State};
use tracing::{error, info};

use super::{Event, Node, NodeError, complain, help};

/// How often an idle node looks for the shutdown.
const LOOK: Duration = Duration::from_millis(20);

/// How long a supervisor has to read what was reported last.
const LAST_WORDS: Duration = Duration::from_secs(5);

/// What is particular to a node: its parameters, and what it does as a managed node. It exists while the node is
/// configured.
pub trait Managed: Sized {
    /// The node's name where it is not remapped.
    const NAME: &'static str;

    /// Its parameters, beside those that every node has.
    fn parameters() -> Vec<ParameterSpec>;

    /// Opens what it needs.
    ///
    /// # Errors
    /// The node stays unconfigured, and ends where nobody manages it. What takes long looks for [`Node::shutdown`]
    /// meanwhile, and fails with [`NodeError::Interrupted`].
    fn configure(node: &Node) -> Result<Self, NodeError>;

    /// Opens what it needs only while it is active; called before each [`run`](Self::run) that follows an activation.
    ///
    /// # Errors
    /// The node stays inactive, and ends where nobody manages it.
    fn activate(&mut self, _: &Node) -> Result<(), NodeError> {
        Ok(())
    }

    /// Works, as long as the node is active; called anew each time that it becomes so, and where it stays so after an
    /// interruption.
    ///
    /// # Errors
    /// The node cannot go on: it is cleaned up, and ends where nobody manages it.
    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError>;

    /// Ends in order, and gives back what it holds.
    ///
    /// # Errors
    /// Something could not be ended in order; it is given back all the same.
    fn clean_up(self, _: &Node) -> Result<(), NodeError> {
        Ok(())
    }
}

/// Why a node has stopped working.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// [`Node::interrupted`] has become true.
    Interrupted,
    /// All is done: the process ends.
    Done,
}

/// The main function of a node: starts it, leads it through its life, and turns the outcome into an exit code (0 done,
/// 1 failed on the way, 2 unusable input).
pub fn main<M: Managed>(args: impl IntoIterator<Item = String>) -> ExitCode {
    lead::<M>(args.into_iter().collect(), None)
}

/// The same for a program that runs the node in its own process: the node's reports go to `reports`, one JSON object a line.
pub fn main_reporting<M: Managed>(
    args: impl IntoIterator<Item = String>,
    reports: impl Write + Send + 'static,
) -> ExitCode {
    match Reporter::to_writer(reports) {
        Ok(events) => lead::<M>(args.into_iter().collect(), Some(Arc::new(events))),
        Err(error) => {
            complain(&format_args!("{}: {error}", M::NAME));
            ExitCode::FAILURE
        }
    }
}

fn lead<M: Managed>(args: Vec<String>, events: Option<Arc<Reporter>>) -> ExitCode {
    if help::is_wanted(&args) {
        return help::print(M::NAME, M::parameters());
    }
    let node = match Node::start(M::NAME, args, M::parameters(), events.clone()) {
        Ok(node) => node,
        Err(error) => {
            // Logging needs the arguments that could not be understood.
            complain(&format_args!("{}: {error}", M::NAME));
            if let Some(events) = events {
                events.report(Event::Failed {
                    message: error.to_string(),
                });
                events.flush(LAST_WORDS);
            }
            return error.exit_code();
        }
    };
    let mut life = Life::<M> {
        node: &node,
        configured: None,
    };
    let lived = life.live();
    let ended = life.end();
    let code = match node.namesakes.refused().and(lived).and(ended) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            error!("{error}");
            node.report(Event::Failed {
                message: error.to_string(),
            });
            error.exit_code()
        }
    };
    node.events.flush(LAST_WORDS);
    code
}

/// A node between its start and its end.
struct Life<'n, M> {
    node: &'n Node,
    configured: Option<M>,
}

impl<M: Managed> Life<'_, M> {
    /// Does what it is told to, until the shutdown or the end of its work.
    fn live(&mut self) -> Result<(), NodeError> {
        let managed = !self.node.autostart;
        if !managed {
            for change in [Change::Configure, Change::Activate] {
                match self.change(change) {
                    Err(NodeError::Interrupted) => return Ok(()),
                    changed => changed?,
                }
            }
        }
        while !self.node.shutdown.requested() {
            if self.node.lifecycle.state() == State::Active
                && let Some(configured) = &mut self.configured
            {
                match configured.run(self.node) {
                    Ok(Stopped::Done) => return Ok(()),
                    Ok(Stopped::Interrupted) | Err(NodeError::Interrupted) => {}
                    Err(error) => {
                        self.fail(managed);
                        if !managed {
                            return Err(error);
                        }
                        error!("{error}");
                    }
                }
            }
            if let Some(asked) = self.node.lifecycle.next(LOOK) {
                let asked_for = asked.change;
                let changed = self.change(asked_for);
                if let Err(error) = &changed {
                    error!("{error}");
                }
                asked.answer(changed.is_ok() || is_way_out(asked_for));
            }
        }
        Ok(())
    }

    /// Makes a change that is possible in the present state.
    fn change(&mut self, change: Change) -> Result<(), NodeError> {
        let lifecycle = &self.node.lifecycle;
        lifecycle.begin(change);
        let changed = match change {
            Change::Configure => {
                // What is set from here on would not be seen.
                self.node.parameters.configured(true);
                M::configure(self.node).map(|configured| self.configured = Some(configured))
            }
            Change::Activate => self
                .configured
                .as_mut()
                .map_or(Ok(()), |configured| configured.activate(self.node)),
            Change::Deactivate => Ok(()),
            Change::CleanUp | Change::Shutdown => self.clean_up(),
        };
        let outcome = if changed.is_ok() || is_way_out(change) {
            Outcome::Success
        } else {
            Outcome::Failure
        };
        self.node.parameters.configured(self.configured.is_some());
        lifecycle.end(outcome);
        let state = lifecycle.state();
        info!("{}", state.label());
        let ready = if self.node.autostart {
            Change::Activate
        } else {
            Change::Configure
        };
        if change == ready && changed.is_ok() {
            self.node.report(Event::Ready);
        }
        changed
    }

    /// Processes an error of the active node: unconfigured for who manages it to try again, else finalized.
    fn fail(&mut self, managed: bool) {
        let lifecycle = &self.node.lifecycle;
        lifecycle.begin(Change::Deactivate);
        lifecycle.end(Outcome::Error);
        if let Err(error) = self.clean_up() {
            error!("{error}");
        }
        self.node.parameters.configured(false);
        lifecycle.end(if managed {
            Outcome::Success
        } else {
            Outcome::Failure
        });
    }

    fn clean_up(&mut self) -> Result<(), NodeError> {
        self.configured
            .take()
            .map_or(Ok(()), |configured| configured.clean_up(self.node))
    }

    /// Shuts down, unless that has been done.
    fn end(&mut self) -> Result<(), NodeError> {
        if self.node.lifecycle.state() == State::Finalized {
            return Ok(());
        }
        self.change(Change::Shutdown)
    }
}

/// Whether a change succeeds even if something of it fails: what is left is given back all the same.
fn is_way_out(change: Change) -> bool {
    matches!(change, Change::CleanUp | Change::Shutdown)
}
