use std::sync::Arc;

use lgvi_common::{DEVIATIONS, Feedback, Limits, actuator_sequence, control_sequence};
use lgvi_control::constraint::{CommandLimit, ComponentLimit, NormLimit, Place};
use lgvi_control::{Allocation, Command, Constraint, MAX_COMMANDS, Plan, miss};
use lgvi_dynamics::thrusters::Thrusters;
use lgvi_dynamics::{BodyState, Load};
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::stamp::StampError;
use lgvi_scene::{Commands, Maneuver, Scene};
use nalgebra::{SMatrix, Vector3};

use crate::solver::{Guess, Phased, Solved};

/// A plan as it is flown: from a step on, with or without its feedback law.
#[derive(Clone, Debug)]
pub(crate) struct Sequence {
    /// The step that it begins at.
    pub(crate) first_step: u64,
    /// The plan.
    pub(crate) plan: Arc<Plan>,
    /// Of the corrected control; `None` in open loop.
    pub(crate) limits: Option<Limits>,
    /// What it commands.
    pub(crate) commands: Commands,
    /// The number of thrusters or wheels that it commands; 0 if it commands force and moment.
    actuators: usize,
    /// What holds corrected commands of these within their limits; `None` in open loop.
    allocation: Option<Allocation>,
    /// When its phases begin.
    pub(crate) phased: Phased,
    /// Index of the body.
    pub(crate) body: usize,
    /// Those of the companions, which have none of their own.
    pub(crate) companions: Vec<Self>,
    /// The maneuver that was planned, if it was seen in flight.
    pub(crate) seen: Option<Arc<Maneuver>>,
}

impl Sequence {
    pub(crate) fn new(maneuver: &Maneuver, first_step: u64, plan: Plan) -> Self {
        let gains = match maneuver.commands() {
            Commands::Loads => plan.feedback.len(),
            Commands::Thrusters | Commands::Wheels => plan.actuator_feedback.len(),
        };
        let has_feedback = maneuver.feedback && gains == plan.controls.len();
        Self {
            first_step,
            limits: has_feedback.then(|| limits(maneuver)),
            commands: maneuver.commands(),
            actuators: maneuver.actuators(),
            allocation: maneuver.allocation().filter(|_| has_feedback),
            plan: Arc::new(plan),
            phased: Phased::default(),
            body: maneuver.body,
            companions: Vec::new(),
            seen: None,
        }
    }

    /// The sequence of what was solved, with those of the maneuver's companions.
    pub(crate) fn of(maneuver: &Maneuver, first_step: u64, solved: Solved) -> Self {
        let others = maneuver.companions.iter().zip(solved.companions);
        let others = others.map(|(other, plan)| Self::new(other, first_step, plan));
        Self {
            companions: others.collect(),
            phased: solved.phased,
            seen: solved.seen,
            ..Self::new(maneuver, first_step, solved.plan)
        }
    }

    /// What a plan from a later step on starts from.
    pub(crate) fn guess(&self, first_step: u64) -> Guess {
        Guess {
            plan: Arc::clone(&self.plan),
            companions: (self.companions.iter())
                .map(|one| Arc::clone(&one.plan))
                .collect(),
            flown: first_step.saturating_sub(self.first_step) as usize,
        }
    }

    /// The sequences of all bodies.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.companions)
    }

    /// The step at which it arrives.
    pub(crate) fn arrival(&self) -> u64 {
        self.first_step + self.plan.controls.len() as u64
    }

    /// Its message for `body`, from `first_step` on if that is later than its first.
    pub(crate) fn message(
        &self,
        scene: &Scene,
        body: usize,
        first_step: u64,
    ) -> Result<ControlSequence, StampError> {
        let Plan {
            controls,
            states,
            feedback,
            ..
        } = &*self.plan;
        let past = first_step.saturating_sub(self.first_step);
        let first_step = self.first_step + past;
        let past = usize::try_from(past)
            .unwrap_or(usize::MAX)
            .min(controls.len());
        if self.commands != Commands::Loads {
            let intervals = self.plan.commands[past..].iter();
            let efforts = intervals.flat_map(|command| self.efforts_of(command));
            let efforts: Vec<_> = efforts.collect();
            let gains = self.plan.actuator_feedback.get(past..).unwrap_or_default();
            let rows = gains.iter().flat_map(|gain| {
                let rows = (0..self.actuators).map(|actuator| gain.row(actuator).into_owned());
                rows.flat_map(<[f64; DEVIATIONS]>::from)
            });
            let rows: Vec<_> = rows.collect();
            let references = &states[past..controls.len()];
            let law = self.limits.as_ref().map(|_| (references, &*rows));
            return actuator_sequence(scene, body, first_step, self.commands, &efforts, law);
        }
        let law = self.limits.as_ref().map(|limits| Feedback {
            reference: &states[past..],
            gains: &feedback[past..],
            limits,
        });
        control_sequence(scene, body, first_step, &controls[past..], law)
    }

    /// What a command asks thrusters or wheels for. The optimal force of a thruster may be below 0 by the tolerance of the
    /// solver.
    fn efforts_of<'c>(&self, command: &'c Command) -> impl Iterator<Item = f64> + use<'c> {
        let least = match self.commands {
            Commands::Wheels => f64::NEG_INFINITY,
            _ => 0.0,
        };
        let efforts = command.iter().take(self.actuators);
        efforts.map(move |effort| effort.max(least))
    }

    fn interval(&self, step: u64) -> Option<usize> {
        usize::try_from(step.checked_sub(self.first_step)?).ok()
    }

    /// What it asks the thrusters or wheels of a body in `state` for during `step`; empty if it commands none, `None` before its first
    /// step.
    pub(crate) fn efforts(&self, step: u64, state: &BodyState) -> Option<Vec<f64>> {
        let interval = self.interval(step)?;
        let plan = &self.plan;
        let Some(command) = plan.commands.get(interval) else {
            return Some(vec![0.0; self.actuators]);
        };
        let mut efforts: Vec<_> = self.efforts_of(command).collect();
        if let (Some(allocation), Some(gain)) =
            (&self.allocation, plan.actuator_feedback.get(interval))
        {
            let corrected = command - gain * miss(&plan.states[interval], state);
            let is_off = |actuator| command[actuator] == 0.0 && gain.row(actuator).amax() == 0.0;
            let held = allocation.within_limits(&corrected, is_off);
            efforts = held.iter().take(self.actuators).copied().collect();
        }
        Some(efforts)
    }

    /// The propellant that it lets flow out of a body's thrusters, or its engine, before the step `end`.
    pub(crate) fn propellant_used(&self, scene: &Scene, thrusters: &Thrusters, end: u64) -> f64 {
        let steps = usize::try_from(end.saturating_sub(self.first_step)).unwrap_or(usize::MAX);
        if let Some(engine) = thrusters.engine() {
            let controls = self.plan.controls.iter().take(steps);
            let forces = controls.map(|control| control.force.norm().min(engine.thrust));
            return scene.h() * forces.sum::<f64>() / engine.exhaust_velocity;
        }
        if self.commands != Commands::Thrusters {
            return 0.0;
        }
        let flow = |command: &Command| -> f64 {
            let each = self.efforts_of(command).zip(thrusters.thrusters());
            each.map(|(force, one)| force.min(one.thrust) / one.exhaust_velocity)
                .sum()
        };
        let commands = self.plan.commands.iter().take(steps);
        scene.h() * commands.map(flow).sum::<f64>()
    }

    /// The impulses of the motors of a body's wheels before the step `end`; empty if it does not command wheels.
    pub(crate) fn wheel_impulses(&self, scene: &Scene, end: u64) -> Vec<f64> {
        if self.commands != Commands::Wheels {
            return Vec::new();
        }
        let steps = usize::try_from(end.saturating_sub(self.first_step)).unwrap_or(usize::MAX);
        let torques: Command = self.plan.commands.iter().take(steps).sum();
        self.efforts_of(&torques)
            .map(|sum| scene.h() * sum)
            .collect()
    }

    /// The force and moment that it lets act during `step` on a body in `state`; `None` before its first step.
    pub(crate) fn at(&self, step: u64, state: &BodyState) -> Option<Load> {
        let interval = self.interval(step)?;
        if self.commands != Commands::Loads {
            return Some(Load::default());
        }
        let plan = &self.plan;
        let Some(control) = plan.controls.get(interval) else {
            return Some(Load::default());
        };
        let Some(limits) = &self.limits else {
            return Some(*control);
        };
        let correction = plan.feedback[interval] * miss(&plan.states[interval], state);
        Some(limits.hold(&Load {
            force: control.force - correction.fixed_rows::<3>(0),
            moment: control.moment - correction.fixed_rows::<3>(3),
        }))
    }
}

/// The limits that constraints without a price put on force and moment, the tightest of each kind. Those on commands are such limits only
/// where commands are force and moment themselves.
fn limits(maneuver: &Maneuver) -> Limits {
    let direct = *maneuver.actuation.matrix() == SMatrix::<f64, 6, MAX_COMMANDS>::identity();
    let tighter = |limit: &mut Vector3<f64>, other: &Vector3<f64>| *limit = limit.inf(other);
    let mut limits = Limits::NONE;
    let forbidden = |constraint: &&Constraint| constraint.price().is_none();
    for constraint in maneuver.constraints.iter().filter(forbidden) {
        let on_force = constraint.place() == Some(Place::Position);
        if let Some(components) = constraint.downcast_ref::<ComponentLimit>() {
            let Limits { force, moment, .. } = &mut limits;
            tighter(if on_force { force } else { moment }, &components.limit());
        } else if let Some(norm) = constraint.downcast_ref::<NormLimit>() {
            let Limits {
                force_norm,
                moment_norm,
                ..
            } = &mut limits;
            let limit = if on_force { force_norm } else { moment_norm };
            *limit = limit.min(norm.limit());
        } else if let Some(commands) = constraint.downcast_ref::<CommandLimit>()
            && direct
        {
            let [force, moment] =
                [0, 3].map(|from| Vector3::from_column_slice(&commands.limit()[from..from + 3]));
            tighter(&mut limits.force, &force);
            tighter(&mut limits.moment, &moment);
        }
    }
    limits
}

#[cfg(test)]
mod tests {
    use lgvi_propagator::{Controls, Flight};

    use std::time::Instant;

    use super::*;
    use crate::follower::Observed;
    use crate::prediction::Forecast;
    use crate::solver::{End, Initial, Task, solve};
    use crate::used::Used;

    const SCENE: &str = include_str!("../../../scenes/inclination_replan.toml");

    fn of(keys: &str) -> Limits {
        let keys = format!("feedback = true\n{keys}\n");
        let text = SCENE.replace("feedback = true\n", &keys);
        let scene = Scene::parse("test", &text).unwrap();
        limits(scene.maneuver.as_ref().unwrap())
    }

    #[test]
    fn what_feedback_adds_is_held_within_the_tightest_constraints() {
        assert_eq!(of(""), Limits::NONE);
        let several = of("constraints = [{ kind = \"commands\", limit = 3.0 }, \
             { kind = \"force_components\", limit = [1.0, 2.0, 4.0] }, { kind = \"moment_norm\", limit = 5.0 }]");
        let expected = Limits {
            force: Vector3::new(1.0, 2.0, 3.0),
            moment: Vector3::new(3.0, 3.0, 3.0),
            moment_norm: 5.0,
            ..Limits::NONE
        };
        assert_eq!(several, expected);
        let thruster = "actuators = [{ force = [2.0, 0.0, 0.0] }, { force = [0.0, 2.0, 0.0] }, \
             { force = [0.0, 0.0, 2.0] }, { moment = [1.0, 0.0, 0.0] }, { moment = [0.0, 1.0, 0.0] }, \
             { moment = [0.0, 0.0, 1.0] }]\nconstraints = [{ kind = \"commands\", limit = 3.0 }]";
        assert_eq!(
            of(thruster),
            Limits::NONE,
            "three units of a command are six of force"
        );
    }

    #[test]
    fn thrusters_fly_a_plan_and_its_rest_to_the_target() {
        let text = include_str!("../../../scenes/thruster_rendezvous.toml");
        fly_and_plan_anew(&text.replace("steps = 240", "steps = 60"));
    }

    /// A tenth of the mass flows out.
    #[test]
    fn thrusters_that_use_propellant_fly_a_plan_and_its_rest_to_the_target() {
        let text = include_str!("../../../scenes/thruster_rendezvous.toml");
        let text = text.replace("steps = 240", "steps = 60");
        let used = text.replace("thrust = ", "exhaust_velocity = 12.0\nthrust = ");
        let tank = "name = \"chaser\"\npropellant = { mass = 60.0 }";
        let used = used.replace("name = \"chaser\"", tank);
        assert!(used != text);
        let flight = fly_and_plan_anew(&used);
        let body = &flight.system().bodies()[1];
        let used = 60.0 - body.thrusters().unwrap().propellant_left();
        assert!(used > 1.0, "{used}");
    }

    #[test]
    fn an_engine_flies_a_plan_and_its_rest_to_the_target() {
        let text = include_str!("../../../scenes/earth_mars.toml");
        let flight = fly_and_plan_anew(&text.replace("steps = 400", "steps = 60"));
        let left = flight.system().bodies()[0].mass();
        // 100 steps end 0.746 kg below the limit 603.94, 60 steps by the square of the step's ratio.
        let expected = 603.94 - 0.746 * (100.0_f64 / 60.0).powi(2);
        assert!((left - expected).abs() < 0.02, "{left}");
    }

    /// Plans made anew on the way begin where the commands will have brought the body.
    fn fly_and_plan_anew(text: &str) -> Flight {
        let scene = Scene::parse("test", text).unwrap();
        let maneuver = scene.maneuver.as_ref().unwrap();
        let task = Task::whole(&scene, maneuver);
        let plan = solve(&scene, &task, &mut |_| true).unwrap().plan;
        let first = Sequence::new(maneuver, 0, plan);
        let body = maneuver.body;
        let message = first.message(&scene, body, 0).unwrap();
        assert_eq!(message.force.is_empty(), maneuver.by_thrusters());
        assert!(message.thrust.len() == if maneuver.by_thrusters() { 60 * 12 } else { 0 });
        assert!(message.thrust.iter().all(|thrust| *thrust >= 0.0));

        let mut flight = Flight::new(&scene).unwrap();
        assert!(!flight.commanded(body));
        let accept = |flight: &mut Flight, sequence: &Sequence, from: u64| {
            let message = sequence.message(&scene, body, from).unwrap();
            flight
                .accept(Controls::of_message(&scene, &message).unwrap())
                .unwrap();
            assert!(flight.commanded(body) && flight.has_sequence_from(body, from));
        };
        accept(&mut flight, &first, 0);
        let forecast = Forecast {
            scheme: scene.scheme().unwrap(),
            from: Observed {
                step: 0,
                states: flight.states().to_vec(),
                at: Instant::now(),
            },
            sequences: vec![first.clone()],
            used_before: Used::default(),
        };
        let task = Task {
            first_step: 20,
            initial: Initial::Forecast(Box::new(forecast)),
            end: End::After(40),
            switches: None,
            guess: Some(first.guess(20)),
        };
        let rest = solve(&scene, &task, &mut |_| true).unwrap().plan;
        let off = miss(&rest.states[0], &first.plan.states[20]).amax();
        assert!(off < 1e-6, "{off:e}");
        accept(&mut flight, &Sequence::new(maneuver, 20, rest), 20);
        while flight.step() < 60 {
            flight.advance().unwrap();
        }
        let miss = scene
            .miss_among(
                flight.system().bodies(),
                flight.states(),
                &flight.states()[body],
            )
            .unwrap()
            .norm();
        assert!(miss < 1e-4, "{miss:e}");
        flight
    }

    /// The miss of the attitude and the position of a flight whose start and actuators deviate.
    fn misses(text: &str, keys: &str, disturbance: &str) -> [f64; 2] {
        let text = text.replace("[maneuver]\n", &format!("[maneuver]\n{keys}\n"));
        let scene = Scene::parse("test", &format!("{text}\n{disturbance}")).unwrap();
        let plan = crate::plan(&scene, &mut |_| true).unwrap();
        let message = plan.message(&scene).unwrap();
        let mut flight = Flight::new(&scene).unwrap();
        let controls = Controls::of_message(&scene, &message).unwrap();
        assert_eq!(controls.has_law(), plan.has_feedback());
        flight.accept(controls).unwrap();
        let body = scene.maneuver.as_ref().unwrap().body;
        for step in 0..scene.steps {
            if plan.has_feedback() {
                // What the planner foretells is what the propagator does, but for the rounding of the message.
                let foretold = plan.efforts(step, &flight.states()[body]).unwrap();
                let mut commanded = vec![0.0; foretold.len()];
                let controls = Controls::of_message(&scene, &message).unwrap();
                assert!(controls.command(step, &flight.states()[body], &mut commanded));
                for (one, other) in foretold.iter().zip(&commanded) {
                    assert!((one - other).abs() < 1e-9, "{one} {other}");
                }
            }
            flight.advance().unwrap();
        }
        let (bodies, states) = (flight.system().bodies(), flight.states());
        let miss = scene.miss_among(bodies, states, &states[body]).unwrap();
        [miss.rows(6, 3).norm(), miss.rows(0, 3).norm()]
    }

    #[test]
    fn thrusters_and_wheels_answer_to_what_the_plan_did_not_expect() {
        let thrusters = include_str!("../../../scenes/thruster_rendezvous.toml");
        let thrusters = thrusters.replace("steps = 240", "steps = 60");
        let state = "position = 0.05\nvelocity = 0.002\nattitude = 0.01\nangular_velocity = 2e-4";
        let disturbance = format!("[disturbance]\nseed = 4\nactuator_error = 0.03\n{state}");
        let open = misses(&thrusters, "", &disturbance);
        let closed = misses(&thrusters, "feedback = true", &disturbance);
        println!("{open:?} {closed:?}");
        for (closed, open) in closed.iter().zip(open) {
            assert!(*closed < 0.1 * open, "{closed:e} {open:e}");
        }
        let wheels = include_str!("../../../scenes/wheel_slew_plan.toml");
        let wheels = wheels.replace("steps = 600", "steps = 60");
        let state = "attitude = 0.01\nangular_velocity = 2e-4";
        let disturbance = format!("[disturbance]\nseed = 4\nactuator_error = 0.03\n{state}");
        let [open, _] = misses(&wheels, "", &disturbance);
        let [closed, _] = misses(&wheels, "feedback = true", &disturbance);
        println!("{open:?} {closed:?}");
        assert!(closed < 0.1 * open, "{closed:e} {open:e}");
    }

    #[test]
    fn wheels_fly_a_plan_to_the_target_or_are_told_of() {
        let text = include_str!("../../../scenes/wheel_slew_plan.toml");
        let text = text.replace("steps = 600", "steps = 60");
        let scene = Scene::parse("test", &text).unwrap();
        let whole = crate::plan(&scene, &mut |_| true).unwrap();
        let message = whole.message(&scene).unwrap();
        assert!(message.force.is_empty() && message.thrust.is_empty());
        assert_eq!(message.wheel_torque.len(), 60 * 4);
        let mut flight = Flight::new(&scene).unwrap();
        flight
            .accept(Controls::of_message(&scene, &message).unwrap())
            .unwrap();
        assert!(flight.commanded(0) && flight.has_sequence_from(0, 0));
        for state in &whole.solution().states {
            let apart = miss(state, &flight.states()[0]).rows(6, 6).amax();
            assert!(apart < 1e-13, "{apart:e}");
            if flight.step() < 60 {
                flight.advance().unwrap();
            }
        }
        let miss = scene.miss(&flight.states()[0]).unwrap().norm();
        assert!(miss < 1e-9, "{miss:e}");

        let state = whole.solution().states[20];
        let later = |warm| crate::plan_rest(&scene, (20, state), warm, &mut |_| true);
        let error = later(None).unwrap_err().to_string();
        assert!(
            error.contains("the plan that is flown until then"),
            "{error}"
        );
        let rest = later(Some(&whole)).unwrap();
        let torques = &whole.solution().commands[20..];
        for (one, other) in torques.iter().zip(&rest.solution().commands) {
            assert!((one - other).amax() < 1e-9, "{one} {other}");
        }
        // What the wheels store has no place in them at the new attitude.
        let fast = text.replace("\nspeed = 150.0", "\nspeed = 219.0");
        let fast = Scene::parse("test", &fast).unwrap();
        let error = crate::plan(&fast, &mut |_| true).unwrap_err();
        assert_eq!(error.reason, crate::Reason::Infeasible);
        let expected = "expected at most 220.000 rad/s";
        assert!(
            error.message.contains("takes wheel_1 to") && error.message.contains(expected),
            "{error}"
        );
        let weak = text.replace("max_torque = 9e-4", "max_torque = 3e-4");
        let weak = Scene::parse("test", &weak).unwrap();
        let error = crate::plan(&weak, &mut |_| true).unwrap_err();
        assert!(error.message.contains("the limit of a wheel by"), "{error}");
    }

    #[test]
    fn the_rest_of_a_sequence_is_flown_as_the_whole() {
        for feedback in ["feedback = true", "feedback = false"] {
            let text = SCENE.replace("steps = 500", "steps = 60");
            let scene = Scene::parse("test", &text.replace("feedback = true", feedback)).unwrap();
            let task = Task {
                first_step: 0,
                initial: Initial::State(scene.bodies[0].state),
                end: End::After(60),
                guess: None,
                switches: None,
            };
            let plan = solve(&scene, &task, &mut |_| true).unwrap().plan;
            let sequence = Sequence::new(scene.maneuver.as_ref().unwrap(), 0, plan);
            let fly = |rests: &[u64]| {
                let mut flight = Flight::new(&scene).unwrap();
                for &step in [0].iter().chain(rests) {
                    let message = sequence.message(&scene, 0, step).unwrap();
                    assert_eq!(message.force.len() as u64, 60 - step);
                    let controls = Controls::of_message(&scene, &message).unwrap();
                    flight.accept(controls).unwrap();
                    assert!(flight.has_sequence_from(0, step));
                }
                for _ in 0..60 {
                    flight.advance().unwrap();
                }
                flight.states().to_vec()
            };
            assert_eq!(fly(&[23, 41]), fly(&[]));
        }
    }
}
