use lgvi_control::{
    FinalTimeError, MinimumTime, Plan, Progress, SearchSettings, Start, TimeRange,
    search_minimum_time, solve_minimum_time,
};
use lgvi_dynamics::BodyState;
use lgvi_scene::{FinalTime, Scene};
use tracing::info;

use super::{Iteration, Observe, Reason, Solved, Unsolved, newton_settings, once, transfer};

/// Relative tolerance of the time that is not a whole number of steps.
const TOLERANCE: f64 = 1e-4;

/// Part of a step by which the time may exceed a whole number of steps, as far as rounding goes.
const ROUNDING: f64 = 1e-6;

/// The plan of the shortest duration: the least whole number of the run's steps in which one is found, but not in a step
/// less.
///
/// The shortest time as such is found first, in as many steps as the longest duration has. A step less or more is tried
/// from there.
pub(super) fn solve(
    scene: &Scene,
    initial: &BodyState,
    range: FinalTime,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    let FinalTime {
        min_steps,
        max_steps,
        ..
    } = range;
    let mut tally = Tally::default();
    let minimum = continuous(scene, initial, range, &mut |now| {
        observe(&tally.count(&now.into()))
    })?;
    let whole = (minimum.final_time / scene.h() - ROUNDING).ceil() as u64;
    let mut steps = whole.clamp(min_steps, max_steps);
    let mut planned = |steps: u64, guess: &Plan| -> Result<Option<Plan>, Unsolved> {
        let transfer = transfer(scene, initial, steps as usize)?;
        let mut count = |now: &Iteration| observe(&tally.count(now));
        match once(scene, &transfer, Some(guess), &mut count) {
            Ok(Solved { plan, .. }) => Ok(Some(plan)),
            Err(unsolved) if is_missing(&unsolved) => Ok(None),
            Err(unsolved) => Err(unsolved),
        }
    };
    let mut plan = loop {
        match planned(steps, &minimum.plan)? {
            Some(plan) => break plan,
            None if steps < max_steps => steps += 1,
            None => {
                let h = scene.h();
                let message = format!(
                    "the target is reached in {}, but no plan was found in a whole number of at most {max_steps} steps of {h}",
                    minimum.final_time
                );
                return Err(Unsolved::new(Reason::Infeasible, message));
            }
        }
    };
    while steps > min_steps {
        match planned(steps - 1, &plan)? {
            Some(shorter) => (steps, plan) = (steps - 1, shorter),
            None => break,
        }
    }
    let remark = described(steps, min_steps, &minimum);
    info!("{remark}");
    Ok(Solved {
        remark,
        ..Solved::alone(plan)
    })
}

/// The plan of the shortest time, whatever number of steps of the run it is.
fn continuous(
    scene: &Scene,
    initial: &BodyState,
    range: FinalTime,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<MinimumTime, Unsolved> {
    let Some(maneuver) = &scene.maneuver else {
        return Err(Unsolved::new(Reason::Refused, super::NO_MANEUVER));
    };
    let transfer = transfer(scene, initial, range.max_steps as usize)?;
    let times = TimeRange {
        shortest: range.min_steps as f64 * scene.h(),
        longest: range.max_steps as f64 * scene.h(),
        tolerance: TOLERANCE,
    };
    let newton = newton_settings(&maneuver.solver);
    let found = match maneuver.search {
        None => solve_minimum_time(&transfer, &times, Start::Cold, &newton, observe),
        Some(search) => {
            let settings = SearchSettings {
                starts: search.starts,
                seed: search.seed,
                newton,
            };
            search_minimum_time(&transfer, &times, &settings, observe)
        }
    };
    found.map_err(|error| {
        let message = error.to_string();
        match error {
            FinalTimeError::Plan { source, .. } | FinalTimeError::Unreached { source, .. } => {
                let mut unsolved = Unsolved::from(*source);
                unsolved.message = match &unsolved.violated {
                    Some(violated) => violated.told(scene, maneuver),
                    None => message,
                };
                unsolved
            }
            FinalTimeError::NotConverged { .. } => Unsolved::new(Reason::NotConverged, message),
            _ => Unsolved::new(Reason::Refused, message),
        }
    })
}

fn is_missing(unsolved: &Unsolved) -> bool {
    matches!(unsolved.reason, Reason::Infeasible | Reason::NotConverged)
}

fn described(steps: u64, min_steps: u64, minimum: &MinimumTime) -> String {
    let below = if steps == min_steps {
        "a bound of the range".to_string()
    } else {
        format!("no plan was found in {}", steps - 1)
    };
    let MinimumTime {
        final_time,
        lower_bound,
        ..
    } = minimum;
    format!(
        "the shortest duration is {steps} steps, {below}; of any length, {final_time:.6}, and at least {lower_bound:.6} \
         for plans of this family"
    )
}

/// The iterations of several solutions, which each count from 0.
#[derive(Default)]
struct Tally {
    before: [u32; 2],
    now: [u32; 2],
}

impl Tally {
    fn count(&mut self, now: &Iteration) -> Iteration {
        if now.iteration < self.now[0] {
            self.before = [0, 1].map(|which| self.before[which] + self.now[which]);
        }
        self.now = [now.iteration, now.trials];
        Iteration {
            iteration: self.before[0] + now.iteration,
            trials: self.before[1] + now.trials,
            ..*now
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{End, Initial, Task, solve};
    use super::*;

    /// A mass of 2 moves by 3 with a force of at most 1.5, in 4 units of time.
    const SCENE: &str = r#"
        title = "A dash"
        [run]
        duration = 8.0
        steps = 80
        integrator = "lgvi"
        [[bodies]]
        name = "craft"
        mass = 2.0
        inertia = [1, 1, 1]
        position = [0, 0, 0]
        velocity = [0, 0, 0]
        attitude = { w = 1, x = 0, y = 0, z = 0 }
        angular_velocity = [0, 0, 0]
        [maneuver]
        body = "craft"
        motion = "translation"
        final_time = { min = 1.0, minimize = "time" }
        constraints = [{ kind = "force_norm", limit = 1.5 }]
        [maneuver.target]
        position = [3, 0, 0]
        velocity = [0, 0, 0]
    "#;

    fn planned(edits: &[(&str, &str)]) -> Result<Solved, Unsolved> {
        let mut text = SCENE.to_string();
        for (from, to) in edits {
            assert!(text.contains(from));
            text = text.replace(from, to);
        }
        let scene = Scene::parse("test", &text).unwrap();
        let task = Task::whole(&scene, scene.maneuver.as_ref().unwrap());
        assert!(matches!(task.end, End::Free(_)) && matches!(task.initial, Initial::State(_)));
        let mut last = 0;
        solve(&scene, &task, &mut |now| {
            assert!(now.iteration >= last);
            last = now.iteration;
            true
        })
    }

    fn steps(edits: &[(&str, &str)]) -> (usize, String) {
        let Solved { plan, remark, .. } = planned(edits).unwrap();
        (plan.controls.len(), remark)
    }

    #[test]
    fn the_duration_is_the_least_number_of_steps() {
        let (found, remark) = steps(&[]);
        assert_eq!(found, 40);
        for part in ["40 steps", "found in 39", "of any length, 4.00"] {
            assert!(remark.contains(part), "{remark}");
        }
        // 4.57 without the rounding to steps of 0.1.
        assert_eq!(
            steps(&[("position = [3, 0, 0]", "position = [3.915, 0, 0]")]).0,
            46
        );
        assert_eq!(
            steps(&[("motion =", "search = { starts = 3 }\nmotion =")]).0,
            40
        );
    }

    /// Betts (2010), §6.8: 28.63 s; the shipped scene has steps of 0.2864 s.
    #[test]
    fn the_shipped_slew_takes_the_published_time() {
        let text = include_str!("../../../../scenes/minimum_time_slew.toml");
        let scene = Scene::parse("minimum_time_slew", text).unwrap();
        let task = Task::whole(&scene, scene.maneuver.as_ref().unwrap());
        let Solved { plan, remark, .. } = solve(&scene, &task, &mut |_| true).unwrap();
        assert_eq!(plan.controls.len(), 100, "{remark}");
        let inner = plan
            .controls
            .iter()
            .flat_map(|u| u.moment.iter().copied().collect::<Vec<_>>());
        let inner = inner.filter(|moment| moment.abs() < 49.9).count();
        println!("{remark}; {inner} moments within their limits");
        assert!(inner <= 20, "{inner}");
        assert!(remark.contains("28.6"), "{remark}");
    }

    #[test]
    fn bounds_of_the_range_hold_and_what_is_too_far_is_said() {
        let (found, remark) = steps(&[("min = 1.0", "min = 5.0")]);
        assert!(
            found == 50 && remark.contains("a bound of the range"),
            "{remark}"
        );
        let unsolved = planned(&[("min = 1.0", "min = 1.0, max = 3.9")]).unwrap_err();
        assert_eq!(unsolved.reason, Reason::Infeasible);
        assert!(unsolved.message.contains("force"), "{}", unsolved.message);
    }
}
