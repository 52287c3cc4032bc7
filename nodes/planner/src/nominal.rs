use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::Scene;

use crate::sequence::Sequence;
use crate::solver::{Solved, Task, solve};

/// The plan of a scene's maneuver from its nominal state, as it is flown.
#[derive(Clone, Debug)]
pub struct NominalPlan {
    sequence: Sequence,
}

/// Plans the maneuver of `scene` as the node does; `go_on` is asked before each iteration.
///
/// # Errors
/// Why there is no plan, in words.
pub fn plan(scene: &Scene, go_on: &dyn Fn() -> bool) -> Result<NominalPlan, String> {
    let maneuver = scene.maneuver.as_ref().ok_or("the scene has no maneuver")?;
    let task = Task::whole(scene, maneuver);
    let Solved { plan, .. } =
        solve(scene, &task, &mut |_| go_on()).map_err(|unsolved| unsolved.message)?;
    Ok(NominalPlan {
        sequence: Sequence::new(maneuver, 0, plan),
    })
}

impl NominalPlan {
    /// Steps until it arrives.
    pub fn steps(&self) -> u64 {
        self.sequence.arrival()
    }

    /// Its objective.
    pub fn cost(&self) -> f64 {
        self.sequence.plan.cost
    }

    /// One load a step, where no feedback law corrects them.
    pub fn open_loop(&self) -> Option<&[Load]> {
        let plan = &self.sequence.plan;
        let open = self.sequence.limits.is_none();
        open.then_some(plan.controls.as_slice())
    }

    /// What it lets act during `step` on the body in `state`.
    pub fn at(&self, step: u64, state: &BodyState) -> Load {
        self.sequence.at(step, state).unwrap_or_default()
    }
}
