use std::path::PathBuf;
use std::time::{Duration, Instant};

use lgvi_control::{Iteration, ShootingError, shooting};
use lgvi_node::{Event, Node, NodeError, PlanReport, load_scene};
use nalgebra::SVector;
use tracing::info;

use crate::messages;
use crate::outlet::Outlet;

/// How often the shutdown is looked for.
const IDLE: Duration = Duration::from_millis(100);

/// The node's work, from parameters to shutdown.
pub(crate) fn run(node: &mut Node) -> Result<(), NodeError> {
    let mut parameters = std::mem::take(&mut node.parameters);
    let path: Option<PathBuf> = parameters.take("scene").map_err(NodeError::input)?;
    parameters.finish().map_err(NodeError::input)?;
    let path = path.ok_or_else(|| {
        NodeError::Input("parameter \"scene\" is missing, expected a path".into())
    })?;
    let scene = load_scene(&path)?;
    let (Some(maneuver), Some(transfer)) = (&scene.maneuver, scene.transfer()) else {
        let path = path.display();
        return Err(NodeError::Input(format!(
            "scene {path}: `maneuver` is missing: nothing to plan"
        )));
    };
    let transfer = transfer.map_err(NodeError::input)?;

    let mut outlet = Outlet::open(node, maneuver.settings.max_iterations)?;
    node.report(&Event::Ready);

    let start = Instant::now();
    let mut last = None;
    let outcome = shooting::solve(&transfer, SVector::zeros(), &maneuver.settings, |now| {
        last = Some(*now);
        node.report(&Event::Planning(report(now)));
        outlet.progress(messages::progress(&scene, maneuver, now, None));
        !node.shutdown.requested()
    });
    if let Some(last) = &last {
        let ended = outcome.as_ref().map(|_| ());
        outlet.progress(messages::progress(&scene, maneuver, last, Some(ended)));
    }
    let solution = match outcome {
        Ok(solution) => solution,
        Err(error) => {
            outlet.await_listener(&node.shutdown);
            let messages = outlet.settle();
            node.report(&Event::Published { messages });
            return match error {
                ShootingError::Stopped(_) => Ok(()),
                error => Err(NodeError::Runtime(format!("no plan: {error}"))),
            };
        }
    };
    let seconds = start.elapsed().as_secs_f64();
    let Iteration {
        iteration,
        cost,
        violation,
        ..
    } = solution.last;
    info!("planned in {iteration} iterations: cost {cost}, terminal error {violation:.1e}");

    let plan = outlet.plan(&scene, maneuver, &solution.extremal);
    let messages = outlet.settle();
    node.report(&Event::Published { messages });
    plan?;
    node.report(&Event::Planned {
        plan: report(&solution.last),
        seconds,
    });
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
