//! Control sequences that answer a state in lockstep, over shared memory alone.

use std::time::Instant;

use lgvi_middleware::node::NodeError;
use lgvi_middleware::shm::{ControlSubscriber, ShmNode};
use lgvi_msgs::cdr;
use lgvi_msgs::msg::ControlSequence;
use lgvi_scene::Scene;
use tracing::warn;

use crate::node::throttle::Throttle;
use crate::target::Target;
use crate::{ControlError, Controls};

/// Receives the answers of controllers on this host.
pub(crate) struct Answers {
    subscriber: ControlSubscriber,
    throttle: Throttle,
}

/// An answer, as it is flown and as it is published.
pub(crate) struct Answer {
    pub(crate) target: Target,
    pub(crate) controls: Controls,
    pub(crate) message: ControlSequence,
}

impl Answers {
    pub(crate) fn new(shm: &ShmNode, topic: &str) -> Result<Self, NodeError> {
        Ok(Self {
            subscriber: shm.control_subscriber(topic)?,
            throttle: Throttle::default(),
        })
    }

    /// Takes the next sequence that begins at `step`, and lets go of others.
    pub(crate) fn next(&mut self, scene: &Scene, step: u64) -> Result<Option<Answer>, NodeError> {
        while let Some(sample) = self.subscriber.receive()? {
            let checked = match cdr::decode::<ControlSequence>(sample.elements()) {
                Ok(message) if message.first_step != step => continue,
                Ok(message) => {
                    Controls::of_message(scene, &message).map(|controls| (controls, message))
                }
                Err(error) => Err(ControlError::Undecodable(error.to_string())),
            };
            match checked {
                Ok((controls, _)) if controls.has_law() => {
                    self.refuse("it has a feedback law, expected an open loop");
                }
                Ok((controls, message)) => {
                    return Ok(Some(Answer {
                        target: controls.target(),
                        controls,
                        message,
                    }));
                }
                Err(error) => self.refuse(&error.to_string()),
            }
        }
        Ok(None)
    }

    /// Forgets what has come in.
    pub(crate) fn forget(&mut self) -> Result<(), NodeError> {
        while self.subscriber.receive()?.is_some() {}
        Ok(())
    }

    pub(crate) fn refuse(&mut self, why: &str) {
        if self.throttle.lets(Instant::now()) {
            warn!("answer over shared memory refused: {why}");
        }
    }
}
