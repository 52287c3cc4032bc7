//! A ROS 2 node of one's own: publishes where one body is as another one sees it.
//!
//! ```text
//! cargo run --release -p lgvi_middleware --example own_node -- --ros-args -r '~/state:=/lgvi_propagator/state'
//! cargo run --release -- run scenes/two_dumbbells.toml --real-time-factor 1            # in another terminal
//! ```
//!
//! Takes the parameters `observer` and `target`, the bodies' names. Publishes `~/position`, in the observer's frame (m).

use std::{env, error::Error, time::Duration};

use lgvi_middleware::ros::{Executor, Qos, RosNode};
use lgvi_middleware::{Environment, NodeArgs, ParameterSpec, Parameters, Shutdown};
use lgvi_msgs::geometry_msgs::{Point, PointStamped};
use lgvi_msgs::msg::{BodyState, SystemState};

fn main() -> Result<(), Box<dyn Error>> {
    let (args, rest) = NodeArgs::parse("own_node", env::args().skip(1))?;
    if let Some(unknown) = rest.first() {
        return Err(format!("unknown argument {unknown:?}, expected --ros-args").into());
    }
    let body =
        |name, default: &str| ParameterSpec::new(name, default.to_owned(), "a body of the scene");
    let specs = vec![body("observer", "dumbbell1"), body("target", "dumbbell2")];
    let parameters = Parameters::declare(args.parameters(), specs)?;
    let (observer, target): (String, String) =
        (parameters.get("observer")?, parameters.get("target")?);

    let shutdown = Shutdown::on_signals()?;
    let node = RosNode::new(&args, &Environment::from_env()?)?;
    let mut executor = Executor::new();
    parameters.serve(&node, &mut executor)?;
    let _running = executor.start()?;
    let states = node.subscription::<SystemState>("~/state", &Qos::latched(1000))?;
    let positions = node.publisher::<PointStamped>("~/position", &Qos::reliable(1000))?;
    while !shutdown.requested() {
        let Some(sample) = states.recv_timeout(Duration::from_millis(100))? else {
            continue;
        };
        let SystemState {
            mut header, bodies, ..
        } = sample.message;
        let find = |name: &str| {
            let body = bodies.iter().find(|body| body.name == name);
            body.ok_or_else(|| format!("the scene has no body {name:?}"))
        };
        let point = seen_from(find(&observer)?, find(&target)?);
        header.frame_id.clone_from(&observer);
        positions.publish(&PointStamped { header, point })?;
    }
    Ok(())
}

/// Rᵀ(y − x): the position y in the body frame of an observer at x with the attitude R.
fn seen_from(observer: &BodyState, target: &BodyState) -> Point {
    let [x, y, z] = [0, 1, 2].map(|axis| {
        (0..3)
            .map(|row| {
                observer.attitude[3 * row + axis] * (target.position[row] - observer.position[row])
            })
            .sum()
    });
    Point { x, y, z }
}
