use lgvi_control::{
    FinalTimeError, MinimumTime, Plan, Progress, SearchSettings, Start, TimeRange,
    search_minimum_time, solve_minimum_time,
};
use lgvi_scene::{FinalTime, Scene};
use tracing::info;

use super::{Iteration, Observe, Problem, Reason, Solved, Unsolved, newton_settings};

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
    problem: Problem<'_>,
    range: FinalTime,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    let FinalTime {
        min_steps,
        max_steps,
        ..
    } = range;
    let mut tally = Tally::default();
    let minimum = continuous(problem, range, &mut |now| {
        observe(&tally.count(&now.into()))
    })?;
    let whole = (minimum.final_time / problem.scene.h() - ROUNDING).ceil() as u64;
    let mut steps = whole.clamp(min_steps, max_steps);
    let mut planned = |steps: u64, guess: &Plan| -> Result<Option<Plan>, Unsolved> {
        let transfer = problem.transfer(steps as usize, &[])?;
        let mut count = |now: &Iteration| observe(&tally.count(now));
        match problem.solve(&transfer, &[], Some(guess), &mut count) {
            Ok(Solved { plan, .. }) => Ok(Some(plan)),
            Err(unsolved) if unsolved.is_missing() => Ok(None),
            Err(unsolved) => Err(unsolved),
        }
    };
    let mut plan = loop {
        match planned(steps, &minimum.plan)? {
            Some(plan) => break plan,
            None if steps < max_steps => steps += 1,
            None => {
                let h = problem.scene.h();
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
    let mut remark = described(steps, min_steps, &minimum);
    let fitting_duration = fitting(problem.scene, steps, min_steps, &minimum);
    if let Some(duration) = fitting_duration {
        remark +=
            &format!("; with `run.duration` = {duration} the steps nearly fit the shortest time");
    }
    info!("{remark}");
    Ok(Solved {
        fitting_duration,
        ..Solved::new(plan, remark)
    })
}

/// The plan of the shortest time, whatever number of steps of the run it is.
fn continuous(
    problem: Problem<'_>,
    range: FinalTime,
    observe: &mut dyn FnMut(&Progress) -> bool,
) -> Result<MinimumTime, Unsolved> {
    let Problem {
        scene, maneuver, ..
    } = problem;
    let transfer = problem.transfer(range.max_steps as usize, &[])?;
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
                    Some(violated) => violated.told(scene, maneuver, range.max_steps as usize, &[]),
                    None => message,
                };
                unsolved
            }
            FinalTimeError::NotConverged { .. } => Unsolved::new(Reason::NotConverged, message),
            _ => Unsolved::new(Reason::Refused, message),
        }
    })
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

/// The duration of the run with which so many steps take the shortest time, if they take longer by more than its tolerance and by what
/// commands lose that switch within steps, some `1/N²`.
fn fitting(scene: &Scene, steps: u64, min_steps: u64, minimum: &MinimumTime) -> Option<f64> {
    let count = steps as f64;
    let margin = TOLERANCE + 1.0 / (count * count);
    let shortest = minimum.final_time * (1.0 + margin);
    if steps == min_steps || scene.h() * count <= shortest * (1.0 + margin) {
        return None;
    }
    let duration = shortest / count * scene.steps as f64;
    let digits = 10.0_f64.powi(6 - duration.log10().floor() as i32);
    Some((duration * digits).ceil() / digits)
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
    use lgvi_scene::Scene;

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

    /// Runs of the told duration take the shortest time in as many steps.
    #[test]
    fn the_steps_are_told_that_fit_the_shortest_time() {
        for case in 1..=6 {
            let distance = 2.0 + 3.0 * (0.618 * f64::from(case)).fract();
            let exact = 2.0 * (distance * 2.0 / 1.5).sqrt();
            let target = format!("position = [{distance}, 0, 0]");
            let target = ("position = [3, 0, 0]", &*target);
            let (coarse, remark) = steps(&[target]);
            let told = remark.split("`run.duration` = ").nth(1);
            let Some(told) = told.and_then(|rest| rest.split(' ').next()) else {
                assert!(0.1 * coarse as f64 <= exact * 1.003, "{remark}");
                continue;
            };
            let duration = format!("duration = {told}");
            let (fitted, remark) = steps(&[target, ("duration = 8.0", &duration)]);
            assert_eq!(fitted, coarse, "{remark}");
            assert!(!remark.contains("run.duration"), "{remark}");
            let taken = told.parse::<f64>().unwrap() / 80.0 * fitted as f64;
            assert!(taken / exact - 1.0 < 2e-3, "{taken} for {exact}");
        }
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

    /// Without gravity, IPOPT finds 55.2886 s in 40 steps of any length (`shipped` of `tests/truth/wheels.json`).
    #[test]
    fn wheels_take_the_shortest_time_within_their_limits_of_speed() {
        let text = include_str!("../../../../scenes/wheel_slew_plan.toml")
            .replace("steps = 600", "steps = 40")
            .replace(
                "commands = \"wheels\"",
                "commands = \"wheels\"\nfinal_time = { min = 10.0, minimize = \"time\" }",
            );
        let scene = Scene::parse("wheel_slew_plan", &text).unwrap();
        let task = Task::whole(&scene, scene.maneuver.as_ref().unwrap());
        let solved = solve(&scene, &task, &mut |_| true).unwrap();
        let remark = &solved.remark;
        assert!(remark.contains("of any length, 55.2"), "{remark}");
        let steps = solved.plan.commands.len() as f64;
        let taken = solved.fitting_duration.unwrap() / 40.0 * steps;
        assert!((taken / 55.2886 - 1.0).abs() < 3e-3, "{taken}: {remark}");
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
