//! What a person at a terminal sees while a flight is under way.

use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use lgvi_common::PlanReport;
use lgvi_scene::Scene;

/// Bars on standard error; nothing where that is no terminal.
pub(crate) struct Progress {
    bars: MultiProgress,
    plan: Option<ProgressBar>,
    flight: ProgressBar,
    recording: ProgressBar,
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

impl Progress {
    pub(crate) fn new(scene: &Scene) -> Self {
        let bars = MultiProgress::new();
        let spinner = |prefix: &'static str| {
            let bar = bars.add(ProgressBar::new_spinner());
            bar.set_style(style("{prefix:>10} {spinner} {msg}"));
            bar.set_prefix(prefix);
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        };
        let plan = scene.maneuver.as_ref().map(|_| spinner("planning"));
        let flight = bars.add(ProgressBar::new(scene.steps));
        flight.set_style(style("{prefix:>10} [{bar:40}] {pos}/{len} steps"));
        flight.set_prefix("flying");
        let recording = spinner("recording");
        Self {
            bars: bars.clone(),
            plan,
            flight,
            recording,
        }
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
