//! The wrenches that come in over ROS 2.

use std::pin::pin;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{Qos, RosNode, Subscription};
use lgvi_msgs::geometry_msgs::WrenchStamped;
use lgvi_scene::Scene;
use rtrb::Producer;
use tracing::warn;

use crate::wrench::{Wrench, WrenchError};

/// Messages of a body that may wait.
const DEPTH: usize = 16;

/// How often a warning comes at most.
const PATIENCE: Duration = Duration::from_secs(1);

/// Receives wrenches and hands them to the loop.
pub(super) struct Wrenches {
    bodies: Vec<(usize, Subscription<WrenchStamped>)>,
    loop_end: Producer<Wrench>,
    warned: Option<Instant>,
}

impl Wrenches {
    /// Subscribes to `~/wrench/<body>` of these bodies.
    pub(super) fn new(
        ros: &RosNode,
        scene: &Scene,
        bodies: &[usize],
        loop_end: Producer<Wrench>,
    ) -> Result<Self, NodeError> {
        let bodies = bodies.iter().map(|&body| {
            let topic = format!("~/wrench/{}", scene.bodies[body].name);
            Ok::<_, NodeError>((body, ros.subscription(&topic, &Qos::reliable(DEPTH))?))
        });
        Ok(Self {
            bodies: bodies.collect::<Result<_, _>>()?,
            loop_end,
            warned: None,
        })
    }

    /// Hands over what has come in; returns whether there was any. Has the thread woken for the next.
    pub(super) fn receive(&mut self, scene: &Scene, context: &mut Context<'_>) -> bool {
        let mut any = false;
        for (body, subscription) in &self.bodies {
            while let Poll::Ready(received) = pin!(subscription.recv()).poll(context) {
                any = true;
                let checked = received
                    .map_err(|error| WrenchError::Undecodable(error.to_string()))
                    .and_then(|sample| Wrench::of_message(scene, *body, &sample.message));
                let refused = match checked {
                    Ok(wrench) => self
                        .loop_end
                        .push(wrench)
                        .err()
                        .map(|_| "too many others wait".to_owned()),
                    Err(error) => Some(error.to_string()),
                };
                let quiet = |warned: Instant| warned.elapsed() < PATIENCE;
                if let Some(why) = refused
                    && !self.warned.is_some_and(quiet)
                {
                    self.warned = Some(Instant::now());
                    warn!("wrench on {} refused: {why}", scene.bodies[*body].name);
                }
            }
        }
        any
    }
}
