use std::collections::BTreeMap;

use lgvi_control::Plan;
use lgvi_scene::FinalTime;
use tracing::info;

use super::{Iteration, Observe, Problem, Reason, Solved, Unsolved};

/// The plan of the best duration: a whole number of the run's steps, so that it is flown as it is planned, at which
/// `J + weight · T` is less than with a step more or a step less, or which is a bound of the range.
///
/// A pattern search over the number of steps, from the middle of the range: steps of an eighth of it, halved where
/// neither side is better, each plan from the best before it. Durations that cannot be planned count as infinitely dear.
pub(super) fn solve(
    problem: Problem<'_>,
    range: FinalTime,
    observe: Observe<'_>,
) -> Result<Solved, Unsolved> {
    let mut durations = Durations {
        problem,
        range,
        observe,
        made: Iteration::NONE,
        known: BTreeMap::new(),
        best: None,
        failure: None,
    };
    let FinalTime {
        min_steps,
        max_steps,
        ..
    } = range;
    let mut stride = ((max_steps - min_steps) / 8).max(1);
    let mut at = min_steps + (max_steps - min_steps) / 2;
    let mut cost = durations.cost(at)?;
    loop {
        let sides = [
            at.saturating_add(stride).min(max_steps),
            at.saturating_sub(stride).max(min_steps),
        ];
        let mut moved = false;
        for side in sides {
            let other = durations.cost(side)?;
            if other < cost {
                (at, cost, moved) = (side, other, true);
                break;
            }
        }
        if !moved {
            if stride == 1 {
                break;
            }
            stride = stride.div_ceil(2);
        }
    }
    let bound = if at == min_steps || at == max_steps {
        ", a bound of the range"
    } else {
        ""
    };
    match (durations.best, durations.failure) {
        (Some((_, plan)), _) => {
            let planned = durations.known.len();
            let remark =
                format!("the best duration is {at} steps{bound}: {planned} durations planned");
            info!("{remark}");
            Ok(Solved::new(plan, remark))
        }
        (None, Some(unsolved)) => Err(unsolved),
        (None, None) => Err(Unsolved::new(Reason::NotConverged, "no duration was tried")),
    }
}

struct Durations<'s, 'o> {
    problem: Problem<'s>,
    range: FinalTime,
    observe: Observe<'o>,
    /// Iterations of all durations so far.
    made: Iteration,
    /// `J + weight · T` by number of steps.
    known: BTreeMap<u64, f64>,
    /// The least of them, and its plan.
    best: Option<(f64, Plan)>,
    /// Why the last that failed did.
    failure: Option<Unsolved>,
}

impl Durations<'_, '_> {
    /// `J + weight · T` of the best plan in so many steps; infinite where there is none.
    fn cost(&mut self, steps: u64) -> Result<f64, Unsolved> {
        if let Some(cost) = self.known.get(&steps) {
            return Ok(*cost);
        }
        let transfer = self.problem.transfer(steps as usize, &[])?;
        let guess = self.best.as_ref().map(|(_, plan)| plan);
        let (made, observe) = (&mut self.made, &mut *self.observe);
        let stated = (&transfer, &[][..]);
        let (planned, _) = self.problem.solve_from(stated, guess, true, made, observe);
        let cost = match planned {
            Ok(Solved { plan, .. }) => {
                let time = steps as f64 * self.problem.scene.h();
                let cost = plan.total_cost() + self.range.weight * time;
                if self.best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    self.best = Some((cost, plan));
                }
                cost
            }
            Err(unsolved) if !unsolved.is_missing() => {
                let best = self.best.take().map(|(_, plan)| Box::new(plan));
                return Err(Unsolved { best, ..unsolved });
            }
            Err(unsolved) => {
                self.failure = Some(unsolved);
                f64::INFINITY
            }
        };
        self.known.insert(steps, cost);
        Ok(cost)
    }
}

#[cfg(test)]
mod tests {
    use lgvi_scene::Scene;

    use super::super::{End, Initial, Task, solve};
    use super::*;

    /// A body of mass 2 at rest, to be at rest 3 further on: `J = 6 m² d² / T³` in continuous time.
    const SCENE: &str = r#"
        title = "A push"
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
        final_time = { min = 1.0, weight = 10.0 }
        [maneuver.target]
        position = [3, 0, 0]
        velocity = [0, 0, 0]
    "#;

    fn scene(from: &str, to: &str) -> Scene {
        assert!(SCENE.contains(from));
        Scene::parse("test", &SCENE.replace(from, to)).unwrap()
    }

    fn planned(scene: &Scene, end: End) -> Result<Plan, Unsolved> {
        let task = Task {
            first_step: 0,
            initial: Initial::State(scene.bodies[0].state),
            end,
            guess: None,
            switches: None,
        };
        solve(scene, &task, &mut |_| true).map(|solved| solved.plan)
    }

    fn free(scene: &Scene) -> Result<Plan, Unsolved> {
        planned(
            scene,
            End::Free(scene.maneuver.as_ref().unwrap().final_time.unwrap()),
        )
    }

    #[test]
    fn the_duration_is_the_best_whole_number_of_steps() {
        let scene = scene("", "");
        let plan = free(&scene).unwrap();
        let total = |plan: &Plan| plan.cost + 10.0 * plan.controls.len() as f64 * scene.h();
        let each = (10..=80).map(|steps| total(&planned(&scene, End::After(steps)).unwrap()));
        let least = each.fold(f64::INFINITY, f64::min);
        assert!(
            (total(&plan) - least).abs() < 1e-9 * least,
            "{} for {least}",
            total(&plan)
        );
        // dJ/dT + weight = 0 at T⁴ = 18 m² d² / weight, to half a step and what the steps differ from a continuum in.
        let expected = (18.0 * 4.0 * 9.0 / 10.0_f64).sqrt().sqrt();
        let found = plan.controls.len() as f64 * scene.h();
        assert!((found - expected).abs() < 0.1, "{found} for {expected}");
    }

    #[test]
    fn without_a_weight_the_longest_is_best_and_the_shortest_where_time_is_all() {
        assert_eq!(
            free(&scene("weight = 10.0", "weight = 0.0"))
                .unwrap()
                .controls
                .len(),
            80
        );
        assert_eq!(
            free(&scene("weight = 10.0", "weight = 1e6"))
                .unwrap()
                .controls
                .len(),
            10
        );
    }

    /// Without gravity and in open loop the sphere grows with time by two standard deviations of the position.
    #[test]
    fn a_duration_is_the_best_for_a_constraint_that_holds_with_a_probability() {
        const SURE: &str = "final_time = { min = 1.0, weight = 10.0 }\nconfidence = 0.9772498680518208\n\
            constraints = [{ kind = \"keep_out_sphere\", center = [1.5, 0.1, 0], radius = 0.3 }]";
        let deviations = "[disturbance]\nseed = 1\nposition = 0.02\nvelocity = 0.05\n[maneuver]";
        let text = SCENE.replace("final_time = { min = 1.0, weight = 10.0 }", SURE);
        let text = text.replace("[maneuver]", deviations);
        let scene = Scene::parse("test", &text).unwrap();
        let plan = free(&scene).unwrap();
        let total = |plan: &Plan| plan.cost + 10.0 * plan.controls.len() as f64 * scene.h();
        let steps = plan.controls.len();
        for other in [steps - 1, steps + 1] {
            let other = planned(&scene, End::After(other)).unwrap();
            assert!(total(&plan) < total(&other), "{steps}");
        }
        let spare = plan.states.iter().enumerate().skip(1).map(|(end, state)| {
            let deviation = libm::hypot(0.02, 0.05 * scene.h() * end as f64);
            let distance = (state.position - nalgebra::Vector3::new(1.5, 0.1, 0.0)).norm();
            distance - (0.3 + 2.0 * deviation)
        });
        let spare = spare.fold(f64::INFINITY, f64::min);
        // Steps cut the corner a little less than their ends say.
        assert!((-1e-6..1e-2).contains(&spare), "{spare:e}");
    }

    #[test]
    fn what_no_duration_reaches_says_why_and_what_is_stopped_stops() {
        let weak = "final_time = { min = 1.0, weight = 10.0 }\nconstraints = [{ kind = \"force_norm\", limit = 0.01 }]";
        let unsolved = free(&scene("final_time = { min = 1.0, weight = 10.0 }", weak)).unwrap_err();
        assert_eq!(unsolved.reason, Reason::Infeasible, "{}", unsolved.message);
        let scene = scene("", "");
        let task = Task {
            first_step: 0,
            initial: Initial::State(scene.bodies[0].state),
            end: End::Free(scene.maneuver.as_ref().unwrap().final_time.unwrap()),
            guess: None,
            switches: None,
        };
        let mut seen = 0;
        let unsolved = solve(&scene, &task, &mut |_| {
            seen += 1;
            seen < 3
        });
        assert_eq!((unsolved.unwrap_err().reason, seen), (Reason::Cancelled, 3));
    }
}
