//! What a person at a terminal sees while a flight is under way.

use indicatif::{MultiProgress, ProgressBar};
use lgvi_common::PlanReport;
use lgvi_middleware::node::complain;
use lgvi_scene::Scene;

use crate::bars;

/// Bars on standard error; nothing where that is no terminal.
pub(crate) struct Progress {
    bars: MultiProgress,
    plan: Option<ProgressBar>,
    flight: ProgressBar,
    recording: ProgressBar,
}

impl Progress {
    pub(crate) fn new(scene: &Scene) -> Self {
        let all = MultiProgress::new();
        let spinner = |prefix| {
            let bar = all.add(bars::spinner(prefix));
            bar.enable_steady_tick(bars::TICK);
            bar
        };
        let plan = scene.maneuver.as_ref().map(|_| spinner("planning"));
        let flight = all.add(bars::bar("flying", scene.steps, "steps"));
        let recording = spinner("recording");
        Self {
            bars: all.clone(),
            plan,
            flight,
            recording,
        }
    }

    /// Says something in a line of its own.
    pub(crate) fn say(&self, text: &str) {
        self.bars
            .suspend(|| complain(&format_args!("lgvi: {text}")));
    }

    pub(crate) fn planning(&self, plan: &PlanReport) {
        if let Some(bar) = &self.plan {
            bar.set_message(format!(
                "iteration {}, terminal error {:.1e}, cost {:.6}",
                plan.iterations, plan.violation, plan.cost
            ));
        }
    }

    pub(crate) fn planned(&self, plan: &PlanReport) {
        self.planning(plan);
        if let Some(bar) = &self.plan {
            bar.finish();
        }
    }

    pub(crate) fn flying(&self, step: u64) {
        self.flight.set_position(step);
    }

    pub(crate) fn flown(&self, steps: u64) {
        self.flight.set_position(steps);
        self.flight.abandon();
    }

    pub(crate) fn recording(&self, messages: u64) {
        self.recording.set_message(format!("{messages} messages"));
    }

    pub(crate) fn clear(&self) {
        let _ = self.bars.clear();
    }
}
