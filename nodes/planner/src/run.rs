use std::path::PathBuf;
use std::sync::Arc;

use lgvi_node::{Event, Node, NodeError, load_scene};
use lgvi_scene::Scene;
use tracing::warn;

use crate::follower::Follower;
use crate::goals;
use crate::outlet::Outlet;
use crate::planner::Planner;
use crate::replanner::Replanner;
use crate::worker::Worker;

/// Messages about the progress that are kept for late joiners where the scene does not limit the iterations.
const HISTORY: u32 = 500;

/// The node's work, from parameters to shutdown.
pub(crate) fn run(node: &mut Node) -> Result<(), NodeError> {
    let mut parameters = std::mem::take(&mut node.parameters);
    let path: Option<PathBuf> = parameters.take("scene").map_err(NodeError::input)?;
    let own: Option<bool> = parameters.take("plan_at_start").map_err(NodeError::input)?;
    parameters.finish().map_err(NodeError::input)?;
    let path = path.ok_or_else(|| {
        NodeError::Input("parameter \"scene\" is missing, expected a path".into())
    })?;
    let scene = Arc::new(load_scene(&path)?);
    let Some(maneuver) = scene.maneuver.clone() else {
        let path = path.display();
        return Err(NodeError::Input(format!(
            "scene {path}: `maneuver` is missing: nothing to plan"
        )));
    };
    let scheme = scene.scheme().map_err(NodeError::input)?;
    if let Some(warning) = scene.flown_otherwise(scheme) {
        warn!("{warning}");
    }

    let (ros, _rosout) = node.ros()?;
    let shm = node.shm()?;
    let states = node.args.resolve("~/state").map_err(NodeError::input)?;
    // What corrects the flight must hear of it, wherever it is; goals make do with the one on this host.
    let remote = maneuver.replan.is_some().then_some(&ros);
    let mut planner = Planner {
        node,
        outlet: Outlet::open(&ros, &shm, history(&scene))?,
        follower: Follower::open(Arc::clone(&scene), &states, &shm, remote)?,
        worker: Worker::start(Arc::clone(&scene))?,
        actions: ros
            .action_server("~/plan_maneuver", goals::decide)
            .map_err(NodeError::runtime)?,
        replanner: maneuver.replan.map(Replanner::new),
        scheme,
        current: None,
        waiting: None,
        sequences: Vec::new(),
        maneuver,
        scene,
    };
    node.report(&Event::Ready);
    planner.run(own.unwrap_or(true))
}

/// Messages about the progress: all iterations of the first plan, and the outcomes of those in flight.
fn history(scene: &Scene) -> usize {
    let Some(maneuver) = &scene.maneuver else {
        return 1;
    };
    let iterations = maneuver.solver.max_iterations.unwrap_or(HISTORY) as usize;
    let turns = maneuver
        .replan
        .map_or(0, |replan| scene.steps / replan.every);
    iterations.min(10_000) + 2 + turns.min(10_000) as usize
}
