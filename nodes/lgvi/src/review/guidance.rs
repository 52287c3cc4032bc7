use lgvi_dynamics::BodyState;
use lgvi_ensemble::{Command, Commands, Guidance};
use lgvi_planner::NominalPlan;

/// A plan whose commands each sample is asked for.
struct Law(NominalPlan);

impl Commands for Law {
    fn steps(&self) -> u64 {
        self.0.arrival()
    }

    fn have_feedback(&self) -> bool {
        self.0.has_feedback()
    }

    fn at(&self, step: u64, state: &BodyState) -> Command {
        match self.0.efforts(step, state) {
            Some(efforts) => Command::Efforts(efforts),
            None => Command::Load(self.0.at(step, state)),
        }
    }
}

/// The guidance of an ensemble whose samples all fly `plan`, which begins at step 0.
pub fn guidance(plan: NominalPlan) -> Guidance {
    match plan.open_loop() {
        Some(loads) => Guidance::OpenLoop(loads.to_vec()),
        None => Guidance::StepByStep(Box::new(Law(plan))),
    }
}
