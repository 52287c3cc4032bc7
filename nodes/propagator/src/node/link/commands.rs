//! The commands that come in over ROS 2: wrenches, and efforts of wheels and thrusters.

use std::fmt::Display;
use std::pin::pin;
use std::task::{Context, Poll};
use std::time::Instant;

use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{Qos, RosNode, Subscription};
use lgvi_msgs::geometry_msgs::WrenchStamped;
use lgvi_msgs::sensor_msgs::JointState;
use lgvi_scene::Scene;
use rtrb::Producer;
use tracing::warn;

use crate::node::command::Command;
use crate::node::effort::{EffortError, Efforts};
use crate::node::throttle::Throttle;
use crate::node::wrench::{Wrench, WrenchError};
use crate::target::Actuators;
use crate::target::Target;

/// Messages of a body that may wait.
const DEPTH: usize = 16;

/// Receives commands and hands them to the loop.
pub(super) struct Commands {
    wrenches: Vec<(usize, Subscription<WrenchStamped>)>,
    efforts: Vec<((Actuators, usize), Subscription<JointState>)>,
    inlet: Inlet,
}

/// The way to the loop.
struct Inlet {
    loop_end: Producer<Command>,
    throttle: Throttle,
}

impl Commands {
    /// Subscribes to the wrenches on these bodies, and to the efforts of their actuators.
    pub(super) fn new(
        ros: &RosNode,
        scene: &Scene,
        bodies: &[usize],
        loop_end: Producer<Command>,
    ) -> Result<Self, NodeError> {
        let qos = Qos::reliable(DEPTH);
        let wrenches = bodies.iter().map(|&body| {
            let topic = format!("~/wrench/{}", scene.bodies[body].name);
            Ok::<_, NodeError>((body, ros.subscription(&topic, &qos)?))
        });
        let mut efforts = Vec::new();
        for &body in bodies {
            for actuators in [Actuators::Wheels, Actuators::Thrusters] {
                if !actuators.of(scene, body).is_empty() {
                    let topic = actuators.topic(scene, body);
                    efforts.push(((actuators, body), ros.subscription(&topic, &qos)?));
                }
            }
        }
        Ok(Self {
            wrenches: wrenches.collect::<Result<_, _>>()?,
            efforts,
            inlet: Inlet {
                loop_end,
                throttle: Throttle::default(),
            },
        })
    }

    /// Hands over what has come in; returns whether there was any. Has the thread woken for the next.
    pub(super) fn receive(&mut self, scene: &Scene, context: &mut Context<'_>) -> bool {
        let mut any = false;
        for (body, subscription) in &self.wrenches {
            while let Poll::Ready(received) = pin!(subscription.recv()).poll(context) {
                any = true;
                let checked = received
                    .map_err(|error| WrenchError::Undecodable(error.to_string()))
                    .and_then(|sample| Wrench::of_message(scene, *body, &sample.message));
                let checked = checked.map(Command::Wrench);
                self.inlet.pass(scene, Target::Body(*body), checked);
            }
        }
        for ((actuators, body), subscription) in &self.efforts {
            while let Poll::Ready(received) = pin!(subscription.recv()).poll(context) {
                any = true;
                let checked = received
                    .map_err(|error| EffortError::Undecodable(error.to_string()))
                    .and_then(|sample| {
                        Efforts::of_message(scene, (*actuators, *body), &sample.message)
                    });
                let checked = checked.map(Command::Efforts);
                let target = Target::Actuators(*actuators, *body);
                self.inlet.pass(scene, target, checked);
            }
        }
        any
    }
}

impl Inlet {
    /// Hands a command to the loop, or says why it is refused.
    fn pass(&mut self, scene: &Scene, target: Target, checked: Result<Command, impl Display>) {
        let refused = match checked {
            Ok(command) => {
                let pushed = self.loop_end.push(command);
                pushed.err().map(|_| "too many others wait".to_owned())
            }
            Err(error) => Some(error.to_string()),
        };
        if let Some(why) = refused
            && self.throttle.lets(Instant::now())
        {
            warn!("{} refused: {why}", target.describe(scene));
        }
    }
}
