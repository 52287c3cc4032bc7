use std::fmt::Display;

use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::{Commands, Scene, Scheme};

use crate::follower::Observed;
use crate::sequence::Sequence;

/// What the flight was heard of last, and what will act on it.
#[derive(Clone, Debug)]
pub(crate) struct Forecast {
    /// What flies the scene.
    pub(crate) scheme: Scheme,
    /// The last state heard.
    pub(crate) from: Observed,
    /// What has been published, in the order of the first steps.
    pub(crate) sequences: Vec<Sequence>,
}

impl Forecast {
    /// The state of `body` at `step` of the flight: flown on by the scene's own scheme from where it was heard of last, under
    /// the sequences that have been published, without disturbance. Each acts from its first step on, the last first.
    ///
    /// # Errors
    /// Why nobody can say it: the flight is past it, or the steps until then cannot be made.
    pub(crate) fn state(&self, scene: &Scene, body: usize, step: u64) -> Result<BodyState, String> {
        let Self {
            scheme,
            from,
            sequences,
        } = self;
        let reached = from.step;
        if reached > step {
            return Err(format!(
                "the flight has reached step {reached}, expected at most {step}"
            ));
        }
        let fail = |reason: &dyn Display| {
            format!("the flight cannot be predicted from step {reached} to {step}: {reason}")
        };
        let states = from.states.clone();
        let mut simulation = scene
            .simulation_from(states, *scheme)
            .map_err(|error| fail(&error))?;
        let mut loads = vec![Load::default(); scene.bodies.len()];
        for step in reached..step {
            let state = &simulation.states()[body];
            let mut newest = sequences.iter().rev();
            loads[body] = newest
                .find_map(|sequence| sequence.at(step, state))
                .unwrap_or_default();
            let newest = sequences
                .iter()
                .rev()
                .find_map(|sequence| Some((sequence.commands, sequence.efforts(step)?)));
            match newest {
                Some((Commands::Thrusters, thrust)) => {
                    simulation.set_thruster_commands(body, &thrust);
                }
                // A plan for wheels begins with the flight, of which nothing is forecast then.
                Some((Commands::Loads | Commands::Wheels, _)) | None => (),
            }
            simulation.advance(&loads).map_err(|error| fail(&error))?;
        }
        Ok(simulation.states()[body])
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use lgvi_control::miss;
    use lgvi_propagator::{Controls, Flight};

    use super::*;
    use crate::solver::{End, Guess, Initial, Task, solve};

    const SCENE: &str = include_str!("../../../scenes/inclination_replan.toml");

    fn plan(scene: &Scene, first_step: u64, initial: BodyState) -> Sequence {
        let task = Task {
            first_step,
            initial: Initial::State(initial),
            end: End::After((scene.steps - first_step) as usize),
            guess: None,
        };
        let solved = solve(scene, &task, &mut |_| true).unwrap();
        Sequence::new(scene.maneuver.as_ref().unwrap(), first_step, solved.plan)
    }

    fn controls(scene: &Scene, sequence: &Sequence) -> Controls {
        let body = scene.maneuver.as_ref().unwrap().body;
        let message = sequence.message(scene, body, 0).unwrap();
        Controls::of_message(scene, &message).unwrap()
    }

    /// The same as what the propagator makes of the same sequences where actuators do not err, but for rounding, of which the
    /// propagator's integrator remembers what is past.
    #[test]
    fn what_is_predicted_is_flown() {
        let nominal = SCENE
            .replace("time = \"10 s\"", "time = \"1 s\"")
            .replace("steps = 500", "steps = 100")
            .replace("every = 50", "every = 10")
            .replace("force_error = 0.01\nmoment_error = 0.01\n", "");
        let scene = Scene::parse("test", &nominal).unwrap();
        let sequences = [
            plan(&scene, 0, scene.bodies[0].state),
            plan(
                &scene,
                60,
                *plan(&scene, 0, scene.bodies[0].state)
                    .plan
                    .states
                    .get(60)
                    .unwrap(),
            ),
        ];
        assert!(sequences.iter().all(|sequence| sequence.limits.is_some()));
        let mut flight = Flight::new(&scene).unwrap();
        for sequence in &sequences {
            flight.accept(controls(&scene, sequence)).unwrap();
        }
        let mut heard = None;
        while flight.step() < 90 {
            if flight.step() == 40 {
                heard = Some(Observed {
                    step: 40,
                    states: flight.states().to_vec(),
                    at: Instant::now(),
                });
            }
            flight.advance().unwrap();
        }
        let forecast = Forecast {
            scheme: scene.scheme().unwrap(),
            from: heard.unwrap(),
            sequences: sequences.into(),
        };
        let predicted = forecast.state(&scene, 0, 90).unwrap();
        let error = miss(&flight.states()[0], &predicted).norm();
        assert!(error < 1e-14, "{error:e}");
        let planned = miss(&forecast.sequences[1].plan.states[30], &predicted).norm();
        assert!(planned > 1e-6, "the start was disturbed: {planned:e}");
        let error = forecast.state(&scene, 0, 39).unwrap_err();
        assert_eq!(error, "the flight has reached step 40, expected at most 39");
    }

    /// The miss of a flight, with a plan from each multiple of `every` steps on if that is given.
    fn flown(scene: &Scene, every: Option<u64>) -> f64 {
        let body = scene.maneuver.as_ref().unwrap().body;
        let mut flight = Flight::new(scene).unwrap();
        let mut sequences = vec![plan(scene, 0, scene.bodies[body].state)];
        flight.accept(controls(scene, &sequences[0])).unwrap();
        while flight.step() < scene.steps {
            let step = flight.step();
            if every.is_some_and(|every| {
                step > 0 && step.is_multiple_of(every) && step + 20 < scene.steps
            }) {
                let first_step = step + 4;
                let forecast = Forecast {
                    scheme: scene.scheme().unwrap(),
                    from: Observed {
                        step,
                        states: flight.states().to_vec(),
                        at: Instant::now(),
                    },
                    sequences: sequences.clone(),
                };
                let last = sequences.last().unwrap();
                let task = Task {
                    first_step,
                    initial: Initial::Forecast(Box::new(forecast)),
                    end: End::After((scene.steps - first_step) as usize),
                    guess: Some(Guess {
                        plan: last.plan.clone(),
                        flown: (first_step - last.first_step) as usize,
                    }),
                };
                let solved = solve(scene, &task, &mut |_| true)
                    .unwrap_or_else(|unsolved| panic!("{first_step}: {}", unsolved.message));
                let maneuver = scene.maneuver.as_ref().unwrap();
                sequences.push(Sequence::new(maneuver, first_step, solved.plan));
                let last = sequences.last().unwrap();
                flight.accept(controls(scene, last)).unwrap();
            }
            flight.advance().unwrap();
        }
        let states = flight.states();
        let miss = scene.miss_among(states, &scene.bodies[body].body, &states[body]);
        miss.unwrap().norm()
    }

    /// The satellite is turned and tumbles otherwise than the first plan expects. Plans made in flight see it.
    #[test]
    fn a_target_that_tumbles_otherwise_than_expected_is_met() {
        let text = include_str!("../../../scenes/tumbling_replan.toml");
        for seed in 11..17 {
            let text = text.replace("seed = 5", &format!("seed = {seed}"));
            let scene = Scene::parse("test", &text).unwrap();
            let [seen, unseen] = [Some(18), None].map(|every| flown(&scene, every));
            assert!(seen < 1e-9, "seed {seed}: {seen:e}");
            assert!(unseen > 0.3, "seed {seed}: {unseen:e}");
        }
    }

    /// The scene turns too far for a step of its own, and cuts it.
    #[test]
    fn steps_that_the_flight_cuts_are_cut() {
        let fast = SCENE
            .replace("integrator = ", "subdivide = 4\nintegrator = ")
            .replace(
                "angular_velocity = [0.0, 0.0, 0.983]",
                "angular_velocity = [0.0, 0.0, 700.0]",
            );
        let forecast = |scene: &Scene| {
            let from = Observed {
                step: 0,
                states: scene.initial_states(),
                at: Instant::now(),
            };
            let forecast = Forecast {
                scheme: scene.scheme().unwrap(),
                from,
                sequences: Vec::new(),
            };
            forecast.state(scene, 0, 5)
        };
        let scene = Scene::parse("test", &fast).unwrap();
        let mut flight = scene.simulation(scene.scheme().unwrap()).unwrap();
        for _ in 0..5 {
            flight.advance(&[Load::default()]).unwrap();
        }
        assert_eq!(forecast(&scene), Ok(flight.states()[0]));

        let whole = fast.replace("subdivide = 4", "subdivide = 0");
        let error = forecast(&Scene::parse("test", &whole).unwrap()).unwrap_err();
        assert!(
            error.contains("cannot be predicted from step 0 to 5"),
            "{error}"
        );
    }
}
