use std::fmt::Display;

use lgvi_dynamics::{ActuatorStates, Load, RigidBody};
use lgvi_scene::{Commands, Maneuver, Scene, SceneError, Scheme, Seen};

use crate::follower::Observed;
use crate::sequence::Sequence;
use crate::solver::Predicted;
use crate::used::Used;

/// What the flight was heard of last, and what will act on it.
#[derive(Clone, Debug)]
pub(crate) struct Forecast {
    /// What flies the scene.
    pub(crate) scheme: Scheme,
    /// The last state heard.
    pub(crate) from: Observed,
    /// What has been published, in the order of the first steps.
    pub(crate) sequences: Vec<Sequence>,
    /// What the sequences before these have used.
    pub(crate) used_before: Used,
}

impl Forecast {
    /// What is known at `step` of the flight of the bodies that `maneuver` plans: flown on by the scene's own scheme from where they were
    /// heard of last, under the sequences that have been published, without disturbance. Each acts from its first step on, the last
    /// first. Propellant has flowed out under them from the start, and motors have exerted their torques on wheels.
    ///
    /// # Errors
    /// Why nobody can say it: the flight is past it, or the steps until then cannot be made.
    pub(crate) fn of(
        &self,
        scene: &Scene,
        maneuver: &Maneuver,
        step: u64,
    ) -> Result<Vec<Predicted>, String> {
        let Self { scheme, from, .. } = self;
        let planned = || maneuver.planned().map(|planned| planned.body);
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
        let mut actuators = ActuatorStates::of(simulation.system());
        self.set_used(scene, maneuver.body, &mut actuators);
        simulation.set_actuator_states(&actuators);
        let mut loads = vec![Load::default(); scene.bodies.len()];
        for step in reached..step {
            for body in planned() {
                let state = simulation.states()[body];
                let load = self.newest(body).find_map(|one| one.at(step, &state));
                loads[body] = simulation.command(body, load.unwrap_or_default());
                let mut newest = self.newest(body);
                match newest.find_map(|one| Some((one.commands, one.efforts(step, &state)?))) {
                    Some((Commands::Thrusters, thrust)) => {
                        simulation.set_thruster_commands(body, &thrust);
                    }
                    Some((Commands::Wheels, torques)) => {
                        simulation.set_wheel_commands(body, &torques);
                    }
                    Some((Commands::Loads, _)) | None => (),
                }
            }
            simulation.advance(&loads).map_err(|error| fail(&error))?;
        }
        let flown = |body| {
            Predicted::of(
                &simulation.system().bodies()[body],
                simulation.states()[body],
            )
        };
        Ok(planned().map(flown).collect())
    }

    /// The scene's maneuver as it is seen from the states that were heard of, if other bodies have a part in it.
    pub(crate) fn seen(&self, scene: &Scene) -> Result<Option<Maneuver>, SceneError> {
        scene.maneuver_seen(&[Seen {
            step: self.from.step,
            states: self.from.states.clone(),
        }])
    }

    /// The sequences of a body, the newest first.
    fn newest(&self, body: usize) -> impl Iterator<Item = &Sequence> {
        let newest = self.sequences.iter().rev();
        newest.filter_map(move |sequence| sequence.all().find(|one| one.body == body))
    }

    /// Takes from the actuators of `body` what the sequences have used until the last state that was heard.
    fn set_used(&self, scene: &Scene, body: usize, actuators: &mut ActuatorStates) {
        let reached = self.from.step;
        let later = self.sequences.iter().skip(1).map(|next| next.first_step);
        let ends = later.chain([reached]).map(|end| end.min(reached));
        let rigid = &scene.bodies[body].body;
        let mut used = self.used_before.clone();
        for (sequence, end) in self.sequences.iter().zip(ends) {
            used.add(scene, rigid, sequence, end);
        }
        let now = used.leaves(rigid, self.from.states[body]);
        let before = || scene.bodies[..body].iter().map(|named| &named.body);
        let thrusted = before().filter_map(RigidBody::thrusters).count();
        let propellants = actuators.propellants.iter_mut().skip(thrusted);
        for (propellant, left) in propellants.zip(now.propellant) {
            *propellant = left;
        }
        let wheels = before().filter_map(RigidBody::wheels);
        let wheels = wheels.map(|wheels| wheels.wheels().len()).sum();
        let wheels = actuators.wheels.iter_mut().skip(wheels);
        for (wheel, momentum) in wheels.zip(now.wheel_momenta) {
            wheel.momentum = momentum;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use lgvi_control::miss;
    use lgvi_dynamics::BodyState;
    use lgvi_propagator::{Controls, Flight};
    use nalgebra::SVector;

    use super::*;
    use crate::solver::{End, Initial, Task, solve};

    const SCENE: &str = include_str!("../../../scenes/inclination_replan.toml");

    fn plan(scene: &Scene, first_step: u64, initial: BodyState) -> Sequence {
        let task = Task {
            first_step,
            initial: Initial::State(initial),
            end: End::After((scene.steps - first_step) as usize),
            guess: None,
            switches: None,
        };
        let solved = solve(scene, &task, &mut |_| true).unwrap();
        Sequence::of(scene.maneuver.as_ref().unwrap(), first_step, solved)
    }

    fn controls(scene: &Scene, sequence: &Sequence) -> Controls {
        let message = sequence.message(scene, sequence.body, 0).unwrap();
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
            used_before: Used::default(),
        };
        let maneuver = scene.maneuver.as_ref().unwrap();
        let predicted = forecast.of(&scene, maneuver, 90).unwrap()[0].state;
        let error = miss(&flight.states()[0], &predicted).norm();
        assert!(error < 1e-14, "{error:e}");
        let planned = miss(&forecast.sequences[1].plan.states[30], &predicted).norm();
        assert!(planned > 1e-6, "the start was disturbed: {planned:e}");
        let error = forecast.of(&scene, maneuver, 39).unwrap_err();
        assert_eq!(error, "the flight has reached step 40, expected at most 39");
    }

    /// By how much the planned bodies miss their targets, and how near they come to each other from the step `LATER` on, in a
    /// flight with a plan from each multiple of `every` steps on if that is given.
    fn flown(scene: &Scene, every: Option<u64>) -> (Vec<SVector<f64, 12>>, f64) {
        let maneuver = scene.maneuver.as_ref().unwrap();
        let mut flight = Flight::new(scene).unwrap();
        let mut sequences = vec![plan(scene, 0, scene.bodies[maneuver.body].state)];
        let accept = |flight: &mut Flight, sequence: &Sequence| {
            for one in sequence.all() {
                flight.accept(controls(scene, one)).unwrap();
            }
        };
        accept(&mut flight, &sequences[0]);
        let mut nearest = f64::INFINITY;
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
                    used_before: Used::default(),
                };
                let last = sequences.last().unwrap();
                let task = Task {
                    first_step,
                    initial: Initial::Forecast(Box::new(forecast)),
                    end: End::After((scene.steps - first_step) as usize),
                    guess: Some(last.guess(first_step)),
                    switches: None,
                };
                let solved = solve(scene, &task, &mut |_| true)
                    .unwrap_or_else(|unsolved| panic!("{first_step}: {}", unsolved.message));
                sequences.push(Sequence::of(maneuver, first_step, solved));
                accept(&mut flight, sequences.last().unwrap());
            }
            flight.advance().unwrap();
            let states = flight.states();
            for (count, one) in maneuver.planned().enumerate() {
                for other in maneuver.planned().take(count) {
                    let apart = states[one.body].position - states[other.body].position;
                    if flight.step() >= LATER {
                        nearest = nearest.min(apart.norm());
                    }
                }
            }
        }
        let misses = scene.misses(flight.system().bodies(), flight.states());
        let misses = misses.into_iter().map(|miss| miss.unwrap());
        (misses.collect(), nearest)
    }

    const LATER: u64 = 19;

    fn missed(scene: &Scene, every: Option<u64>) -> f64 {
        flown(scene, every).0[0].norm()
    }

    /// Satellites that exchange places begin elsewhere than expected. Plans made in flight bring all of them to their targets.
    #[test]
    fn a_formation_that_begins_otherwise_arrives() {
        let text = include_str!("../../../scenes/formation_change.toml");
        let text = text.replace("steps = 150", "steps = 60").replace(
            "separation = 40.0",
            "separation = 40.0\nreplan = { every = 15, deadline = 1.0 }",
        );
        for seed in 1..4 {
            let deviations = "position = 0.3\nvelocity = 0.003\n";
            let disturbed = format!(
                "{text}\n[disturbance]\nseed = {seed}\n{deviations}\n[[disturbance.bodies]]\nbody = \"light\"\n{deviations}"
            );
            let scene = Scene::parse("test", &disturbed).unwrap();
            let [seen, unseen] = [Some(15), None].map(|every| {
                let (misses, nearest) = flown(&scene, every);
                let misses = misses.iter().map(|miss| miss.fixed_rows::<3>(0).norm());
                (misses.fold(0.0, f64::max), nearest)
            });
            assert!(seen.0 < 1e-6, "seed {seed}: {seen:?}");
            // A plan begins with the first of these steps.
            assert!(seen.1 > 40.0 * (1.0 - 1e-6), "seed {seed}: {seen:?}");
            assert!(unseen.0 > 0.3, "seed {seed}: {unseen:?}");
        }
    }

    /// The satellite is turned and tumbles otherwise than the first plan expects. Plans made in flight see it.
    #[test]
    fn a_target_that_tumbles_otherwise_than_expected_is_met() {
        let text = include_str!("../../../scenes/tumbling_replan.toml");
        for seed in 11..17 {
            let text = text.replace("seed = 5", &format!("seed = {seed}"));
            let scene = Scene::parse("test", &text).unwrap();
            let [seen, unseen] = [Some(18), None].map(|every| missed(&scene, every));
            assert!(seen < 1e-9, "seed {seed}: {seen:e}");
            assert!(unseen > 0.3, "seed {seed}: {unseen:e}");
        }
    }

    /// A satellite whose wheels spin begins with another attitude and rate than the first plan expects. Plans made in flight
    /// count on what their wheels store by then.
    #[test]
    fn a_satellite_that_begins_otherwise_is_turned_by_its_wheels() {
        let text = include_str!("../../../scenes/wheel_slew_plan.toml");
        let text = text.replace("steps = 600", "steps = 60").replace(
            "commands = \"wheels\"",
            "commands = \"wheels\"\nreplan = { every = 9, deadline = 1.0 }",
        );
        for seed in 1..7 {
            let disturbed = format!(
                "{text}\n[disturbance]\nseed = {seed}\nattitude = 0.02\nangular_velocity = 5e-4\n"
            );
            let scene = Scene::parse("test", &disturbed).unwrap();
            let [seen, unseen] = [Some(9), None].map(|every| missed(&scene, every));
            assert!(seen < 1e-9, "seed {seed}: {seen:e}");
            assert!(unseen > 1e-2, "seed {seed}: {unseen:e}");
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
                used_before: Used::default(),
            };
            let maneuver = scene.maneuver.as_ref().unwrap();
            let predicted = forecast.of(scene, maneuver, 5);
            predicted.map(|predicted| predicted[0].state)
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
