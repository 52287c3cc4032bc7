//! A ROS 2 node of your own: publishes where one body is in the frame of another.
//!
//! ```text
//! cargo run --release -p lgvi_middleware --example own_node -- --ros-args -r '~/state:=/lgvi_propagator/state'
//! cargo run --release -- run scenes/two_dumbbells.toml --real-time-factor 1            # in another terminal
//! ```
//!
//! It publishes `~/position` in the observer's body frame (m). Its lifecycle, parameters, `/rosout` and `/diagnostics`
//! are those of any managed node: try `ros2 lifecycle set /own_node deactivate`.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use lgvi_middleware::ParameterSpec;
use lgvi_middleware::node::{Managed, Node, NodeError, Stopped, with_arguments};
use lgvi_middleware::ros::{Diagnosed, Publisher, Qos, Status, Subscription};
use lgvi_msgs::geometry_msgs::{Point, PointStamped};
use lgvi_msgs::msg::{BodyState, SystemState};

struct OwnNode {
    observer: String,
    target: String,
    states: Subscription<SystemState>,
    positions: Publisher<PointStamped>,
    published: Arc<AtomicU64>,
    _diagnosed: Diagnosed,
}

impl Managed for OwnNode {
    const NAME: &'static str = "own_node";

    fn parameters() -> Vec<ParameterSpec> {
        vec![
            ParameterSpec::new("observer", "dumbbell1".to_owned(), "body that observes"),
            ParameterSpec::new("target", "dumbbell2".to_owned(), "body that is observed"),
        ]
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        let published = Arc::<AtomicU64>::default();
        let count = Arc::clone(&published);
        Ok(Self {
            observer: node.parameters.get("observer")?,
            target: node.parameters.get("target")?,
            states: node.ros.subscription("~/state", &Qos::latched(1000))?,
            positions: node.ros.publisher("~/position", &Qos::reliable(1000))?,
            published,
            _diagnosed: node.diagnostics.add("positions", move || {
                Status::ok("observing").value("published", count.load(Ordering::Relaxed))
            }),
        })
    }

    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        while !node.interrupted() {
            let Some(sample) = self.states.recv_timeout(Duration::from_millis(20))? else {
                continue;
            };
            let SystemState {
                mut header, bodies, ..
            } = sample.message;
            let find = |name: &str| {
                let body = bodies.iter().find(|body| body.name == name);
                body.ok_or_else(|| NodeError::Input(format!("the scene has no body {name:?}")))
            };
            let point = position_in_frame(find(&self.observer)?, find(&self.target)?);
            header.frame_id.clone_from(&self.observer);
            self.positions.publish(&PointStamped { header, point })?;
            self.published.fetch_add(1, Ordering::Relaxed);
        }
        Ok(Stopped::Interrupted)
    }
}

fn main() -> ExitCode {
    with_arguments(lgvi_middleware::node::main::<OwnNode>)
}

/// Rᵀ(y − x): the position y in the body frame of an observer at x with the attitude R.
fn position_in_frame(observer: &BodyState, target: &BodyState) -> Point {
    let [x, y, z] = [0, 1, 2].map(|axis| {
        (0..3)
            .map(|row| {
                observer.attitude[3 * row + axis] * (target.position[row] - observer.position[row])
            })
            .sum()
    });
    Point { x, y, z }
}
