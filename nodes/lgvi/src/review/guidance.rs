use lgvi_dynamics::{BodyState, Load};
use lgvi_ensemble::{Commands, Guidance};
use lgvi_planner::NominalPlan;

/// Feedback along a plan.
struct Law(NominalPlan);

impl Commands for Law {
    fn steps(&self) -> u64 {
        self.0.arrival()
    }

    fn at(&self, step: u64, state: &BodyState) -> Load {
        self.0.at(step, state)
    }
}

/// The guidance of an ensemble whose samples all fly `plan`, which begins at step 0 and commands force and moment.
pub fn guidance(plan: NominalPlan) -> Guidance {
    match plan.open_loop() {
        Some(loads) => Guidance::OpenLoop(loads.to_vec()),
        None => Guidance::Feedback(Box::new(Law(plan))),
    }
}
