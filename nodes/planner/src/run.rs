use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use lgvi_control::extremal::Extremal;
use lgvi_control::{Iteration, ShootingError, Solution, shooting};
use lgvi_middleware::ros::{Publisher, Qos};
use lgvi_middleware::shm::ControlPublisher;
use lgvi_msgs::RosMessage;
use lgvi_msgs::msg::{ControlSequence, PlanProgress};
use lgvi_msgs::nav_msgs::Path;
use lgvi_node::{Event, Node, NodeError, PlanReport, load_scene};
use lgvi_scene::{Maneuver, Scene};
use nalgebra::SVector;
use tracing::{info, warn};

use crate::messages;

/// How long what is published waits for subscribers that do not keep up.
const PATIENCE: Duration = Duration::from_secs(5);

/// How often the shutdown is looked for.
const IDLE: Duration = Duration::from_millis(100);

/// The node's work, from parameters to shutdown.
pub(crate) fn run(node: &mut Node) -> Result<(), NodeError> {
    let mut parameters = std::mem::take(&mut node.parameters);
    let path: Option<PathBuf> = parameters.take("scene").map_err(NodeError::input)?;
    parameters.finish().map_err(NodeError::input)?;
    let path = path
        .ok_or_else(|| NodeError::Input("parameter \"scene\" is missing, expected a path".into()))?;
    let scene = load_scene(&path)?;
    let maneuver = scene.maneuver.clone().ok_or_else(|| {
        NodeError::Input(format!("scene {}: `maneuver` is missing: nothing to plan", path.display()))
    })?;

    let mut outlet = Outlet::open(node, &scene, &maneuver)?;
    node.report(&Event::Ready);

    let start = Instant::now();
    let solution = solve(node, &scene, &maneuver, &mut outlet);
    match solution {
        Ok(solution) => {
            let seconds = start.elapsed().as_secs_f64();
            info!(
                "planned in {} iterations: cost {}, terminal error {:.1e}",
                solution.last.iteration, solution.last.cost, solution.last.violation
            );
            outlet.publish_plan(&scene, &maneuver, &solution.extremal)?;
            let published = outlet.settle();
            node.report(&Event::Planned { plan: report(&solution.last), seconds, published });
        }
        Err(ShootingError::Stopped(_)) => return Ok(()),
        Err(error) => return Err(NodeError::Runtime(format!("no plan: {error}"))),
    }
    while !node.shutdown.wait_timeout(IDLE) {}
    Ok(())
}

fn report(now: &Iteration) -> PlanReport {
    PlanReport {
        iterations: now.iteration,
        trials: now.trials,
        violation: now.violation,
        cost: now.cost,
    }
}

/// Solves the manoeuvre from a cold start; every iteration is published, and so is how it ended.
fn solve(
    node: &Node,
    scene: &Scene,
    maneuver: &Maneuver,
    outlet: &mut Outlet,
) -> Result<Solution, ShootingError> {
    let Some(Ok(transfer)) = scene.transfer() else {
        unreachable!("a compiled scene's manoeuvre states a problem")
    };
    let mut last = None;
    let outcome = shooting::solve(&transfer, SVector::zeros(), &maneuver.settings, |now| {
        last = Some(*now);
        node.report(&Event::Planning(report(now)));
        outlet.publish_progress(scene, maneuver, now, None);
        !node.shutdown.requested()
    });
    if let Some(last) = last {
        let ended = outcome.as_ref().map(|_| ());
        outlet.publish_progress(scene, maneuver, &last, Some(ended));
    }
    outcome
}

/// Where the node publishes, with the number of messages sent by topic.
struct Outlet {
    shm: ControlPublisher,
    controls: Publisher<ControlSequence>,
    progress: Publisher<PlanProgress>,
    path: Publisher<Path>,
    sent: BTreeMap<String, u64>,
}

impl Outlet {
    fn open(node: &Node, scene: &Scene, maneuver: &Maneuver) -> Result<Self, NodeError> {
        let topic = node.args.resolve("~/control_sequence").map_err(NodeError::input)?;
        let (ros, _) = node.ros()?;
        // A late joiner gets every iteration and how they ended.
        let depth = maneuver.settings.max_iterations as usize + 2;
        let _ = scene;
        Ok(Self {
            shm: node.shm()?.control_publisher(&topic).map_err(NodeError::runtime)?,
            controls: ros.publisher(&topic, &Qos::latched(1)).map_err(NodeError::runtime)?,
            progress: ros.publisher("~/progress", &Qos::latched(depth)).map_err(NodeError::runtime)?,
            path: ros.publisher("~/planned_path", &Qos::latched(1)).map_err(NodeError::runtime)?,
            sent: BTreeMap::new(),
        })
    }
}
