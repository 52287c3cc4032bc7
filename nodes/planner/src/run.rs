//! The node as a managed node.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lgvi_common::{FramePrefix, Warning, WarningCode, load_scene, required_path};
use lgvi_middleware::ParameterSpec;
use lgvi_middleware::node::{Managed, Node, NodeError, Stopped};
use lgvi_scene::Scene;

use crate::follower::Follower;
use crate::goals;
use crate::monitor::Monitor;
use crate::outlet::Outlet;
use crate::planner::Planner;
use crate::replanner::Replanner;
use crate::used::Used;
use crate::worker::Worker;

/// Messages about the progress that are kept for late joiners where the scene does not limit the iterations.
const HISTORY: u32 = 500;

const NOT_IN_LOCKSTEP: &str =
    "parameter \"lockstep\" is true, expected false: the scene does not replan";

impl Managed for Planner {
    const NAME: &'static str = "lgvi_planner";

    fn parameters() -> Vec<ParameterSpec> {
        vec![
            ParameterSpec::new(
                "scene",
                String::new(),
                "scene file, with a maneuver (required)",
            ),
            ParameterSpec::new(
                "plan_at_start",
                true,
                "plan the maneuver on activation; false: wait for goals",
            ),
            ParameterSpec::new(
                "lockstep",
                false,
                "the propagator runs in lockstep: the flight waits for the plans made during it",
            ),
            FramePrefix::specification(),
        ]
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        let path = required_path(&node.parameters, "scene")?;
        let prefix = FramePrefix::read(&node.parameters)?.of(node.args.namespace());
        let scene = Arc::new(load_scene(&path)?.with_frame_prefix(&prefix));
        let Some(maneuver) = scene.maneuver.clone() else {
            let path = path.display();
            return Err(NodeError::Input(format!(
                "scene {path}: `maneuver` is missing: nothing to plan"
            )));
        };
        let lockstep: bool = node.parameters.get("lockstep")?;
        if lockstep && maneuver.replan.is_none() {
            return Err(NodeError::Input(NOT_IN_LOCKSTEP.into()));
        }
        let scheme = scene.scheme().map_err(NodeError::input)?;
        if let Some(warning) = scene.flown_otherwise(scheme) {
            Warning::new(WarningCode::FlownOtherwise, warning).tell(&node.events);
        }

        let ros = &node.ros;
        let shm = node.shm()?;
        let states = node.args.resolve("~/state")?;
        // What corrects the flight must hear of it, wherever it is; goals, and plans that are waited for, make do with the one
        // on this host.
        let remote = (maneuver.replan.is_some() && !lockstep).then_some(ros);
        let step_size = lockstep.then(|| scene.seconds(1));
        let active = Arc::new(AtomicBool::new(false));
        let open = Arc::clone(&active);
        let actions = ros
            .action_server("~/plan_maneuver", move |goal, waiting| {
                goals::decide(goal, waiting, open.load(Ordering::Acquire))
            })?
            .shortened_by(goals::without_controls);
        let monitor = Arc::new(Monitor::default());
        Ok(Self {
            events: Arc::clone(&node.events),
            outlet: Outlet::open(ros, &shm, history(&scene), maneuver.planned().count())?,
            follower: Follower::open(Arc::clone(&scene), &states, &shm, remote)?,
            worker: Worker::start(Arc::clone(&scene))?,
            actions,
            active,
            replanner: maneuver
                .replan
                .map(|replan| Replanner::new(replan, step_size)),
            _diagnosed: Monitor::diagnose(&monitor, &node.diagnostics),
            monitor,
            scheme,
            current: None,
            waiting: None,
            sequences: Vec::new(),
            used_before: Used::default(),
            initial: None,
            course: 0,
            maneuver,
            scene,
        })
    }

    fn activate(&mut self, _: &Node) -> Result<(), NodeError> {
        self.follower.begin()?;
        // Who has heard that the node is active has goals accepted.
        self.active.store(true, Ordering::Release);
        Ok(())
    }

    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        let own: bool = node.parameters.get("plan_at_start")?;
        let worked = self.work(node, own);
        self.active.store(false, Ordering::Release);
        self.leave();
        worked.map(|()| Stopped::Interrupted)
    }
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
