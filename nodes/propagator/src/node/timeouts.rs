//! Commands that were over before others came: counted, and told of from time to time.

use std::time::Instant;

use lgvi_common::CommandTimeouts;
use lgvi_scene::Scene;

use crate::node::throttle::Throttle;
use crate::target::Target;

/// The timeouts of a flight.
#[derive(Debug, Default)]
pub(crate) struct Timeouts {
    watched: Vec<Watched>,
    throttle: Throttle,
}

/// What has become of the commands for a target.
#[derive(Debug)]
struct Watched {
    target: Target,
    phase: Phase,
    timeouts: u64,
    /// Steps without command after a timeout.
    idle: u64,
    missed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The first command has yet to act.
    Coming,
    Acting,
    Over,
}

impl Timeouts {
    /// A command for a target is to act.
    pub(crate) fn watch(&mut self, target: Target) {
        self.of(target);
    }

    /// A command for a target has not come within its deadline.
    pub(crate) fn miss(&mut self, target: Target) {
        self.of(target).missed += 1;
    }

    fn of(&mut self, target: Target) -> &mut Watched {
        let known = self.watched.iter().position(|one| one.target == target);
        let index = known.unwrap_or_else(|| {
            self.watched.push(Watched {
                target,
                phase: Phase::Coming,
                timeouts: 0,
                idle: 0,
                missed: 0,
            });
            self.watched.len() - 1
        });
        &mut self.watched[index]
    }

    /// Looks in each step for which targets something `acts`; returns one for which nothing does any more, if that is to be told
    /// `now`.
    pub(crate) fn note(
        &mut self,
        acts: impl Fn(Target) -> bool,
        now: impl Fn() -> Instant,
    ) -> Option<Target> {
        let mut over = None;
        for one in &mut self.watched {
            let before = one.phase;
            if acts(one.target) {
                one.phase = Phase::Acting;
            } else if before != Phase::Coming {
                one.phase = Phase::Over;
                one.idle += 1;
                if before == Phase::Acting {
                    one.timeouts += 1;
                    over = over.or(Some(one.target));
                }
            }
        }
        over.filter(|_| self.throttle.lets(now()))
    }

    /// Those that there were.
    pub(crate) fn report(&self, scene: &Scene) -> Vec<CommandTimeouts> {
        let any = self.watched.iter();
        let any = any.filter(|one| one.timeouts > 0 || one.missed > 0);
        let report = any.map(|one| CommandTimeouts {
            command: one.target.describe(scene),
            timeouts: one.timeouts,
            idle: scene.h() * scene.units.time * one.idle as f64,
            missed: one.missed,
        });
        report.collect()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::flight::tests::scene;

    const BODY: Target = Target::Body(0);

    #[test]
    fn timeouts_and_the_steps_without_command_after_them_are_counted() {
        let start = Instant::now();
        let mut timeouts = Timeouts::default();
        let mut told = 0;
        let mut note = |timeouts: &mut Timeouts, acts: &str| {
            for act in acts.chars() {
                told += usize::from(timeouts.note(|_| act == 'a', || start).is_some());
            }
        };
        note(&mut timeouts, "-a");
        assert_eq!(timeouts.report(&scene()), []);
        timeouts.watch(BODY);
        // What is delayed has not timed out.
        note(&mut timeouts, "--aa");
        timeouts.watch(BODY);
        assert_eq!(timeouts.report(&scene()), []);
        note(&mut timeouts, "a---a-");
        timeouts.miss(BODY);
        let [report] = timeouts.report(&scene()).try_into().unwrap();
        assert_eq!(report.command, "wrench on ball");
        assert_eq!((report.timeouts, report.missed), (2, 1));
        assert!((report.idle - 0.4).abs() < 1e-12, "{report:?}");
        assert_eq!(told, 1);
    }

    #[test]
    fn a_warning_comes_once_a_second_at_most() {
        let start = Instant::now();
        let mut timeouts = Timeouts::default();
        timeouts.watch(BODY);
        let told = [0, 999, 1000].map(|milliseconds| {
            timeouts.note(|_| true, || start);
            timeouts.note(|_| false, || start + Duration::from_millis(milliseconds))
        });
        assert_eq!(told, [Some(BODY), None, Some(BODY)]);
    }
}
