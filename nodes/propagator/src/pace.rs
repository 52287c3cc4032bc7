use std::time::{Duration, Instant};

/// Keeps simulated time in step with the clock on the wall.
pub(crate) struct Pace {
    start: Instant,
    /// Seconds a simulated second takes; none as fast as possible.
    seconds: Option<f64>,
    overruns: u64,
}

impl Pace {
    /// From now on, at `factor` simulated seconds a second; 0 means as fast as possible.
    pub(crate) fn start(factor: f64) -> Self {
        let seconds = (factor > 0.0).then(|| factor.recip());
        Self {
            start: Instant::now(),
            seconds,
            overruns: 0,
        }
    }

    /// How long it is until what happens `simulated` seconds after the start; zero when it is time, or late.
    pub(crate) fn left(&self, simulated: f64) -> Duration {
        let Some(seconds) = self.seconds else {
            return Duration::ZERO;
        };
        let due = Duration::try_from_secs_f64(simulated * seconds).unwrap_or(Duration::MAX);
        due.saturating_sub(self.start.elapsed())
    }

    /// Counts a step that comes later than its time.
    pub(crate) fn overrun(&mut self) {
        self.overruns += u64::from(self.seconds.is_some());
    }

    /// Steps that came later than their time.
    pub(crate) fn overruns(&self) -> u64 {
        self.overruns
    }

    /// Since the start (s).
    pub(crate) fn elapsed(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
}
