//! Where the solver is.

use lgvi_control::{Certificate, Phase, Plan, Progress};

/// Where the solver is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Newton iterations so far.
    pub iteration: u32,
    /// Trial points or trajectories so far.
    pub trials: u32,
    /// Accepted part of the last step.
    pub step_length: f64,
    /// Norm of what the conditions are missed by, relative to the size of each quantity.
    pub violation: f64,
    /// How far it is from optimal; 0 where the method does not say.
    pub stationarity: f64,
    /// The objective.
    pub cost: f64,
    /// Condition number of the plan that it has led to; 0 where there is none, or the method does not say.
    pub condition: f64,
    /// Whether that plan is known to be a strict local minimum.
    pub sufficient: bool,
    /// Largest violation of a constraint that has a price, of that plan.
    pub priced: f64,
    /// What its violations cost.
    pub paid: f64,
    /// What it is at.
    pub phase: &'static str,
}

impl Iteration {
    /// Before the first.
    pub(crate) const NONE: Self = Self {
        iteration: 0,
        trials: 0,
        step_length: 1.0,
        violation: f64::INFINITY,
        stationarity: 0.0,
        cost: f64::INFINITY,
        condition: 0.0,
        sufficient: false,
        priced: 0.0,
        paid: 0.0,
        phase: "",
    };
}

impl Iteration {
    /// Observes another solution, whose iterations are counted on from these.
    pub(super) fn continued<'i>(
        &'i mut self,
        observe: &'i mut dyn FnMut(&Self) -> bool,
    ) -> impl FnMut(&Self) -> bool {
        let before = *self;
        move |now: &Self| {
            *self = Self {
                iteration: before.iteration + now.iteration,
                trials: before.trials + now.trials,
                ..*now
            };
            observe(self)
        }
    }

    /// Says of the plan that the iteration has led to what the plan says of itself: its last step is seen by nobody.
    pub(crate) fn settle(&mut self, plan: &Plan) {
        self.cost = plan.cost;
        self.violation = violation(&plan.certificate);
        self.stationarity = plan.certificate.stationarity;
        self.condition = plan.certificate.condition;
        self.sufficient = plan.certificate.sufficient;
        self.priced = plan.certificate.priced;
        self.paid = plan.paid;
    }

    /// Adds what the plan of a companion says of itself: the sum of the costs, the worst of everything else.
    pub(crate) fn join(&mut self, plan: &Plan) {
        let mut other = *self;
        other.settle(plan);
        self.cost += other.cost;
        self.violation = self.violation.max(other.violation);
        self.stationarity = self.stationarity.max(other.stationarity);
        self.condition = self.condition.max(other.condition);
        self.sufficient &= other.sufficient;
        self.priced = self.priced.max(other.priced);
        self.paid += other.paid;
    }
}

/// What a plan misses its conditions by.
pub(crate) fn violation(certificate: &Certificate) -> f64 {
    let Certificate {
        defect,
        terminal,
        inequality,
        ..
    } = certificate;
    terminal.max(*defect).max(*inequality)
}

impl From<&Progress> for Iteration {
    fn from(now: &Progress) -> Self {
        Self {
            iteration: now.iteration,
            trials: now.trials,
            step_length: now.step_length,
            violation: now.violation,
            stationarity: now.stationarity,
            cost: now.cost,
            condition: 0.0,
            sufficient: false,
            priced: 0.0,
            paid: 0.0,
            phase: match now.phase {
                Phase::Coarse => "coarse",
                Phase::Fine => "fine",
                Phase::Constrained => "constrained",
            },
        }
    }
}
