//! How a flight ends: what was published is accounted for once it has been acknowledged, while the loop goes on.

use std::sync::mpsc::TryRecvError;
use std::time::Duration;

use lgvi_common::{Event, FlightReport, Warning, WarningCode};
use lgvi_middleware::node::{Node, NodeError};
use tracing::info;

use crate::node::config::PATIENCE;
use crate::node::link::{LinkError, Published};
use crate::node::run::{Ending, Phase, Propagator};

impl Propagator {
    /// Begins to end a flight that has made all its steps.
    pub(crate) fn conclude(&mut self, node: &Node) -> Result<(), NodeError> {
        self.phase = Phase::Flown;
        if let Some(earlier) = self.ending.take() {
            tell(node, earlier.report);
        }
        self.ending = Some(Ending {
            report: self.report(),
            published: self.link.settle(PATIENCE)?,
        });
        self.accounted = true;
        let controlled = self.accepted > 0;
        let warnings = self
            .resolution
            .warnings(&self.scene, &self.flight, controlled);
        let exhausted = self.flight.exhausted();
        let exhausted = exhausted.map(|body| {
            let name = &self.scene.bodies[body].name;
            let message = format!("{name} has used all its propellant");
            Warning::new(WarningCode::NoPropellant, message)
        });
        for warning in warnings.into_iter().chain(exhausted) {
            warning.tell(&node.events);
        }
        Ok(())
    }

    /// Says that the flight is over, once all is published.
    pub(crate) fn look_for_the_end(&mut self, node: &Node) -> Result<(), NodeError> {
        let Some(ending) = &self.ending else {
            return Ok(());
        };
        let published = match ending.published.try_recv() {
            Err(TryRecvError::Empty) => return Ok(()),
            published => published.map_err(|_| LinkError::Ended)?,
        };
        let ending = self.ending.take();
        self.account(node, published)?;
        if let Some(ending) = ending {
            tell(node, ending.report);
        }
        Ok(())
    }

    /// Ends the flight at the end of the node: what is not acknowledged after `patience` is given up.
    pub(crate) fn take_leave(&mut self, node: &Node, patience: Duration) -> Result<(), NodeError> {
        let ending = self.ending.take();
        if self.accounted && ending.is_none() {
            return Ok(());
        }
        let published = self.link.settle(patience)?;
        let published = published.recv().map_err(|_| LinkError::Ended)?;
        self.account(node, published)?;
        if let Some(ending) = ending {
            tell(node, ending.report);
        }
        Ok(())
    }

    /// Says what has been published.
    fn account(&self, node: &Node, mut messages: Published) -> Result<(), NodeError> {
        // Of states, those that went over shared memory count: the ROS side sends fewer.
        messages.insert(self.state_topic.clone(), self.samples);
        node.report(Event::Published { messages });
        Ok(self.link.check_published()?)
    }
}

fn tell(node: &Node, report: FlightReport) {
    info!("flown {} steps in {:.3} s", report.steps, report.seconds);
    node.report(Event::Flown(report));
}
