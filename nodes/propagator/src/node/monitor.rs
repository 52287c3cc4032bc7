//! How the flight is, as `/diagnostics` has it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use lgvi_dynamics::Invariants;
use lgvi_middleware::ros::{Diagnosed, Diagnostics, Level, Status};
use lgvi_middleware::sync::lock;
use lgvi_scene::Scene;

use crate::Flight;
use crate::node::messages::Snapshot;

/// Every so many steps one is timed where they follow each other as fast as possible: reading the clock takes as long as a step of a small scene.
const TIMED: u64 = 64;

/// What the loop notes in passing; others read it.
pub(crate) struct Monitor {
    scene: Scene,
    pub(crate) step: AtomicU64,
    pub(crate) overruns: AtomicU64,
    /// Samples that subscribers on this host had no room for.
    pub(crate) refused: AtomicU64,
    /// States and measurements that were not handed to the ROS side, which was busy.
    pub(crate) skipped: AtomicU64,
    /// Steps timed since the last report, the time that they took, and the longest (ns).
    timed: AtomicU64,
    total: AtomicU64,
    longest: AtomicU64,
    /// Somebody has asked since a state was seen.
    asked: AtomicBool,
    seen: Mutex<Seen>,
    reported: Mutex<Reported>,
}

struct Seen {
    start: Invariants,
    state: Snapshot,
}

/// What the counts were when the last report was made.
struct Reported {
    at: Instant,
    step: u64,
    overruns: u64,
    refused: u64,
    skipped: u64,
}

impl Monitor {
    pub(crate) fn new(scene: &Scene) -> Self {
        let state = Snapshot::new(scene);
        Self {
            step: AtomicU64::new(0),
            overruns: AtomicU64::new(0),
            refused: AtomicU64::new(0),
            skipped: AtomicU64::new(0),
            timed: AtomicU64::new(0),
            total: AtomicU64::new(0),
            longest: AtomicU64::new(0),
            asked: AtomicBool::new(false),
            seen: Mutex::new(Seen {
                start: Invariants::of(&scene.system(), &state.states),
                state,
            }),
            reported: Mutex::new(Reported {
                at: Instant::now(),
                step: 0,
                overruns: 0,
                refused: 0,
                skipped: 0,
            }),
            scene: scene.clone(),
        }
    }

    /// When the step from `step` began, if it is one that is timed: every one of a flight that has to be on time.
    pub(crate) fn times(&self, step: u64, on_time: bool) -> Option<Instant> {
        (on_time || step.is_multiple_of(TIMED)).then(Instant::now)
    }

    /// A step has taken so long.
    pub(crate) fn timed(&self, took: Duration) {
        let took = u64::try_from(took.as_nanos()).unwrap_or(u64::MAX);
        self.timed.fetch_add(1, Ordering::Relaxed);
        self.total.fetch_add(took, Ordering::Relaxed);
        self.longest.fetch_max(took, Ordering::Relaxed);
    }

    /// Invariants are measured from here.
    pub(crate) fn begin(&self, flight: &Flight, start: &Invariants) {
        self.step.store(flight.step(), Ordering::Relaxed);
        let mut seen = lock(&self.seen);
        seen.start = *start;
        seen.state.take(flight);
    }

    /// Whether a state is to be observed: one for each report, so that nothing is done where nobody listens.
    pub(crate) fn wanted(&self) -> bool {
        self.asked.load(Ordering::Acquire)
    }

    /// Takes note of a state, if one is wanted.
    pub(crate) fn observe(&self, state: &Snapshot) {
        if self.asked.swap(false, Ordering::AcqRel) {
            lock(&self.seen).state.clone_from(state);
        }
    }

    /// Has the flight on `/diagnostics`.
    pub(crate) fn diagnose(this: &Arc<Self>, diagnostics: &Diagnostics) -> Diagnosed {
        let this = Arc::clone(this);
        diagnostics.add("flight", move || this.status())
    }

    fn status(&self) -> Status {
        let [step, overruns, refused, skipped] =
            [&self.step, &self.overruns, &self.refused, &self.skipped]
                .map(|count| count.load(Ordering::Relaxed));
        let [timed, total, longest] =
            [&self.timed, &self.total, &self.longest].map(|count| count.swap(0, Ordering::Relaxed));
        let since = std::mem::replace(
            &mut *lock(&self.reported),
            Reported {
                at: Instant::now(),
                step,
                overruns,
                refused,
                skipped,
            },
        );
        let factor = self.scene.seconds(step.saturating_sub(since.step))
            / since.at.elapsed().as_secs_f64().max(f64::MIN_POSITIVE);
        let seen = lock(&self.seen);
        self.asked.store(true, Ordering::Release);
        let mut system = self.scene.system();
        system.set_actuator_states(&seen.state.actuators);
        let now = Invariants::of(&system, &seen.state.states);
        let start = &seen.start;
        let units = &self.scene.units;
        let mean = total as f64 / timed.max(1) as f64 * 1e-3;
        Status::ok(format!("step {step} of {}", self.scene.steps))
            .when(overruns > since.overruns, Level::Warn, "steps came late")
            .when(
                refused > since.refused,
                Level::Warn,
                "subscribers on this host did not keep up",
            )
            .when(
                skipped > since.skipped,
                Level::Warn,
                "the ROS side did not keep up",
            )
            .value("step", step)
            .value("steps", self.scene.steps)
            .value("real-time factor", format!("{factor:.3}"))
            .value("step time, mean (us)", format!("{mean:.3}"))
            .value(
                "step time, longest (us)",
                format!("{:.3}", longest as f64 * 1e-3),
            )
            .value("overruns", overruns)
            .value("samples refused over shared memory", refused)
            .value("invariants of step", seen.state.step)
            .value("states and measurements not converted for DDS", skipped)
            .value(
                "energy, change (J)",
                format!("{:e}", (now.energy - start.energy) * units.energy()),
            )
            .value(
                "linear momentum, change (kg m/s)",
                format!(
                    "{:e}",
                    (now.linear_momentum - start.linear_momentum).norm() * units.momentum()
                ),
            )
            .value(
                "angular momentum, change (kg m^2/s)",
                format!(
                    "{:e}",
                    (now.angular_momentum - start.angular_momentum).norm()
                        * units.angular_momentum()
                ),
            )
            .value(
                "orthogonality error",
                format!("{:e}", now.orthogonality_error),
            )
    }
}
