//! Several bodies planned together.

use lgvi_control::{FormationError, PlanError, solve_together};
use lgvi_scene::{Maneuver, Scene};
use tracing::info;

use super::{
    Initial, NO_MANEUVER, NOT_MINIMUM, Observe, Reason, Solved, Task, Unsolved, newton_settings,
};

const FROM_START: &str = "bodies that are planned together are planned from the start of the scene, and not anew in flight";

/// Plans all bodies of the maneuver from the start of the scene.
pub(super) fn solve(
    scene: &Scene,
    maneuver: &Maneuver,
    task: &Task,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    let start = scene.bodies[maneuver.body].state;
    let from_start = match &task.initial {
        Initial::State(state) => task.first_step == 0 && *state == start,
        #[cfg(feature = "node")]
        Initial::Forecast(_) => false,
    };
    if !from_start {
        return Err(Unsolved::new(Reason::Refused, FROM_START));
    }
    let (Some(transfers), Some(separation)) = (scene.transfers(), maneuver.separation) else {
        return Err(Unsolved::new(Reason::Refused, NO_MANEUVER));
    };
    let transfers = transfers.map_err(|error| Unsolved::new(Reason::Refused, error))?;
    let settings = newton_settings(&maneuver.solver);
    let found = solve_together(&transfers, separation, &settings, |now| {
        observe(&now.into())
    })
    .map_err(|error| unsolved(scene, maneuver, error))?;
    let agreement = found.agreement;
    let [one, other] = agreement.nearest.map(|body| scene.planned_name(body));
    let mut remark = format!(
        "planned together in {} rounds, prices agree to {:.1e}; {one} and {other} come nearest, to {:.6} m",
        agreement.rounds,
        agreement.price,
        agreement.distance * scene.units.length
    );
    info!("{remark}");
    if !found.plans.iter().all(|plan| plan.certificate.sufficient) {
        remark = format!("{remark}; {NOT_MINIMUM}");
    }
    let mut plans = found.plans.into_iter();
    let Some(plan) = plans.next() else {
        return Err(Unsolved::new(Reason::Refused, NO_MANEUVER));
    };
    Ok(Solved {
        plan,
        companions: plans.collect(),
        remark,
    })
}

/// The error in the names of the scene.
fn unsolved(scene: &Scene, maneuver: &Maneuver, error: FormationError) -> Unsolved {
    let name = |body: usize| scene.planned_name(body);
    match error {
        FormationError::Stopped => Unsolved::new(Reason::Cancelled, "stopped"),
        FormationError::Body { body, source } => {
            let mut unsolved = Unsolved::from(*source);
            unsolved.best = None;
            let part = maneuver.planned().nth(body);
            let told = unsolved.violated.as_ref().zip(part);
            let told = told.map(|(violated, part)| violated.told(scene, part));
            let mut message = told.unwrap_or(unsolved.message);
            if let Some(index) = body.checked_sub(1) {
                let key = format!("maneuver.companions[{index}].constraints");
                message = message.replace("maneuver.constraints", &key);
            }
            Unsolved {
                message: format!("{}: {message}", name(body)),
                ..unsolved
            }
        }
        FormationError::Apart { bodies, source } => {
            let [one, other] = bodies.map(name);
            let reason = Unsolved::from((*source).clone()).reason;
            let how = match *source {
                PlanError::Infeasible {
                    step, violation, ..
                } => format!(
                    "the start or the target fixes the state at step {step}, which is too near by {violation:.3e}"
                ),
                PlanError::NotFound {
                    step, violation, ..
                } => format!("the closest plan is too near at step {step} by {violation:.3e}"),
                PlanError::Between {
                    step, violation, ..
                } => format!(
                    "within step {step} the closest plan is too near by {violation:.3e}; shorter steps may help"
                ),
                ref error => error.to_string(),
            };
            let message = format!(
                "no plan keeps {other} away from {one} by `maneuver.separation`: {how} (in parts of it)"
            );
            Unsolved::new(reason, message)
        }
        FormationError::Unsettled { .. } => Unsolved::new(Reason::NotConverged, error),
        error => Unsolved::new(Reason::Refused, error),
    }
}
