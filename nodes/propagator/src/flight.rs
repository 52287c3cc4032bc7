use std::sync::Arc;

use lgvi_dynamics::{BodyState, Invariants, Load, MethodError, Simulation, StepError, StepReport};
use lgvi_scene::{ActuatorErrors, Energies, Scene, Scheme, SchemeError};
use thiserror::Error;

use crate::{ControlError, Controls, SetStates};

/// A scene on its way under the control sequences accepted so far.
///
/// A sequence acts on its body from its first step on, in place of any accepted before it. What acts in each step is its
/// control, corrected by its feedback law if it has one, with the errors of the scene's disturbance if it has one.
pub struct Flight {
    simulation: Simulation,
    scheme: Scheme,
    /// Substeps above which a step was cut; none where steps are never cut.
    whole: Option<u32>,
    /// Accepted sequences by body, oldest first; those that can no longer act are dropped.
    accepted: Vec<Vec<Arc<Controls>>>,
    /// Which body's controls act other than they are meant, and by how much.
    errors: Option<(usize, ActuatorErrors)>,
    loads: Vec<Load>,
}

/// States that a flight cannot go on from.
#[derive(Debug, Error)]
pub enum SetStatesError {
    /// They are not those of rigid bodies.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// What flies the scene cannot fly them.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// The step from them cannot be made.
    #[error("no step can be made from these states{}: {error}", of(body))]
    Step {
        /// The body that the step fails of.
        body: Option<String>,
        /// Why.
        error: StepError,
    },
    /// A step from them leaves the range of numbers in SI.
    #[error("a step from these states leads to states or an energy that are not finite in SI")]
    Range,
    /// Bodies that are too fast, or at one point.
    #[error("the energy of these states is not finite")]
    Energy,
}

fn of(body: &Option<String>) -> String {
    body.as_ref()
        .map(|name| format!(" of {name}"))
        .unwrap_or_default()
}

impl Flight {
    /// At step 0 of `scene`.
    pub fn new(scene: &Scene) -> Result<Self, SchemeError> {
        let bodies = scene.bodies.len();
        let scheme = scene.scheme()?;
        Ok(Self {
            simulation: scene.simulation(scheme)?,
            scheme,
            whole: scene.subdivides(scheme).then_some(scheme.substeps),
            // So that accepting a sequence on the way allocates nothing.
            accepted: (0..bodies).map(|_| Vec::with_capacity(16)).collect(),
            errors: scene.actuator_errors(),
            loads: vec![Load::default(); bodies],
        })
    }

    /// How often an interaction has been taken up in more or in less detail since the last reset.
    pub fn switches(&self) -> u64 {
        self.simulation.switches()
    }

    /// What flies it.
    pub fn scheme(&self) -> Scheme {
        self.scheme
    }

    /// Takes a sequence into account; refuses one that would have had to start in the past.
    ///
    /// Sequences that can no longer act are let go of. Their memory is given back here unless somebody else holds them.
    pub fn accept(&mut self, controls: impl Into<Arc<Controls>>) -> Result<(), ControlError> {
        let controls = controls.into();
        let (first_step, step) = (controls.first_step, self.simulation.step());
        if first_step < step {
            return Err(ControlError::Late { first_step, step });
        }
        let accepted = &mut self.accepted[controls.body];
        let acting = accepted
            .iter()
            .rposition(|earlier| earlier.first_step <= step)
            .unwrap_or(0);
        accepted.drain(..acting);
        accepted.retain(|earlier| earlier.first_step < first_step);
        accepted.push(controls);
        Ok(())
    }

    /// Begins anew at step 0, without any sequence.
    pub fn reset(&mut self, scene: &Scene) -> Result<(), SchemeError> {
        self.simulation = scene.simulation(self.scheme)?;
        self.accepted.iter_mut().for_each(Vec::clear);
        self.loads.fill(Load::default());
        Ok(())
    }

    /// Whether a step can be made from other states of some bodies at the present step: it is made on the side.
    ///
    /// # Assumptions and limitations
    /// What may come after that step is not looked at.
    pub fn try_states(&self, scene: &Scene, states: &SetStates) -> Result<(), SetStatesError> {
        let mut all = self.simulation.states().to_vec();
        states.write(&mut all);
        let mut trial = scene.simulation_from(all, self.scheme)?;
        let mut loads = self.loads.clone();
        self.command(&mut loads, trial.states());
        trial.advance(&loads).map_err(|error| {
            let body = error.body().map(|body| scene.bodies[body].name.clone());
            SetStatesError::Step { body, error }
        })?;
        let units = &scene.units;
        let energy = trial.invariants().energy * units.energy();
        let mut states = trial.states().iter();
        if energy.is_finite() && states.all(|state| units.state_to_si(state).is_finite()) {
            Ok(())
        } else {
            Err(SetStatesError::Range)
        }
    }

    /// Goes on from other states of some bodies at the present step; where they cannot be, from those that it has.
    pub fn set_states(&mut self, states: &SetStates) -> Result<(), SetStatesError> {
        let before = self.simulation.states().to_vec();
        let mut all = before.clone();
        states.write(&mut all);
        self.simulation.set_states(&all)?;
        if self.invariants().energy.is_finite() {
            return Ok(());
        }
        self.simulation.set_states(&before)?;
        Err(SetStatesError::Energy)
    }

    /// Whether a sequence has been accepted for `body`.
    pub fn commanded(&self, body: usize) -> bool {
        !self.accepted[body].is_empty()
    }

    /// Whether a sequence of `body` that begins at `step` has been accepted and will act, or acts.
    pub fn has_sequence_from(&self, body: usize, step: u64) -> bool {
        let mut accepted = self.accepted[body].iter();
        accepted.any(|controls| controls.first_step == step)
    }

    /// The step at which the sequence of `body` that acts last ends.
    pub fn sequence_end(&self, body: usize) -> Option<u64> {
        let last = self.accepted[body].last()?;
        Some(last.first_step + last.loads.len() as u64)
    }

    /// Makes one step. Allocates nothing.
    pub fn advance(&mut self) -> Result<StepReport, StepError> {
        let mut loads = std::mem::take(&mut self.loads);
        self.command(&mut loads, self.simulation.states());
        self.loads = loads;
        self.simulation.advance(&self.loads)
    }

    /// What the accepted sequences have act in the present step, from these states.
    fn command(&self, loads: &mut [Load], states: &[BodyState]) {
        let step = self.simulation.step();
        for ((load, accepted), state) in loads.iter_mut().zip(&self.accepted).zip(states) {
            *load = accepted
                .iter()
                .rev()
                .find_map(|controls| controls.at(step, state))
                .unwrap_or_default();
        }
        if let Some((body, errors)) = &self.errors {
            loads[*body] = errors.apply(&loads[*body]);
        }
    }

    /// Into how many steps one with this report was cut because it could not be made as one; `None` where it could.
    pub fn cut(&self, report: StepReport) -> Option<u32> {
        self.whole
            .is_some_and(|whole| report.cuts > whole)
            .then_some(report.cuts)
    }

    /// What acted on the bodies in the last step, beside gravity.
    pub fn loads(&self) -> &[Load] {
        &self.loads
    }

    /// The bodies' states.
    pub fn states(&self) -> &[BodyState] {
        self.simulation.states()
    }

    /// Steps made.
    pub fn step(&self) -> u64 {
        self.simulation.step()
    }

    /// The energies of the present states, in the scene's units.
    pub fn energies(&self) -> Energies {
        Energies::of(self.simulation.system(), self.simulation.states())
    }

    /// The invariants of the present states, in the scene's units.
    pub fn invariants(&self) -> Invariants {
        self.simulation.invariants()
    }
}

#[cfg(test)]
mod tests {
    use lgvi_msgs::shm::{ControlHeader, ControlInterval, Name};
    use nalgebra::Vector3;

    use super::*;

    fn scene() -> Scene {
        let text = r#"
            title = "A ball"
            [units]
            length = "2 m"
            [run]
            duration = 1.0
            steps = 10
            integrator = "lie_euler"
            [[bodies]]
            name = "ball"
            mass = 1.0
            inertia = [1, 1, 1]
            position = [0, 0, 0]
            velocity = [0, 0, 0]
            attitude = { w = 1, x = 0, y = 0, z = 0 }
            angular_velocity = [0, 0, 0]
        "#;
        Scene::parse("test", text).unwrap()
    }

    fn header(body: &str, first_step: u64, step_size: f64) -> ControlHeader {
        let body = Name::try_from(body).unwrap();
        ControlHeader {
            body,
            first_step,
            step_size,
            stamp_nanoseconds: 0,
        }
    }

    fn push(force: f64, times: usize) -> Vec<ControlInterval> {
        vec![
            ControlInterval {
                force: [force, 0.0, 0.0],
                moment: [0.0; 3]
            };
            times
        ]
    }

    fn controls(first_step: u64, force: f64, times: usize) -> Controls {
        Controls::check(
            &scene(),
            &header("ball", first_step, 0.1),
            &push(force, times),
        )
        .unwrap()
    }

    /// Momentum gained in each of ten steps, in units of h × scene force.
    fn momentum_gains(flight: &mut Flight) -> Vec<f64> {
        let momentum = |flight: &Flight| flight.states()[0].linear_momentum.x;
        (flight.step()..10)
            .map(|_| {
                let before = momentum(flight);
                flight.advance().unwrap();
                ((momentum(flight) - before) / 0.1).round()
            })
            .collect()
    }

    #[test]
    fn a_sequence_acts_from_its_first_step_for_its_length_in_si() {
        let mut flight = Flight::new(&scene()).unwrap();
        flight.accept(controls(2, 6.0, 3)).unwrap();
        assert!(flight.commanded(0));
        let expected = [0.0, 0.0, 3.0, 3.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(momentum_gains(&mut flight), expected);
        assert_eq!(flight.loads()[0].force, Vector3::zeros());
    }

    #[test]
    fn a_later_sequence_takes_over_at_its_first_step() {
        let mut flight = Flight::new(&scene()).unwrap();
        flight.accept(controls(0, 2.0, 10)).unwrap();
        flight.accept(controls(8, 8.0, 10)).unwrap();
        assert!(flight.has_sequence_from(0, 8));
        flight.accept(controls(4, 4.0, 3)).unwrap();
        let begins = [0, 4, 5, 8].map(|step| flight.has_sequence_from(0, step));
        assert_eq!(begins, [true, true, false, false]);
        let expected = [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0];
        assert_eq!(momentum_gains(&mut flight), expected);
    }

    /// Of a body that is set, spinning about z by so much in SI.
    fn spinning(scene: &Scene, angular_momentum: f64) -> SetStates {
        let mut message = lgvi_msgs::msg::BodyState {
            name: "ball".into(),
            attitude: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            ..Default::default()
        };
        message.angular_momentum[2] = angular_momentum;
        SetStates::of_message(scene, &[message]).unwrap()
    }

    /// A turn of more than 1 rad a step cannot be made, nor can one that leaves the range of numbers.
    #[test]
    fn states_from_which_no_step_can_be_made_are_told_apart() {
        let scene = scene();
        let mut flight = Flight::new(&scene).unwrap();
        flight.accept(controls(0, 6.0, 3)).unwrap();
        let before = flight.states().to_vec();
        for (angular_momentum, part) in [
            (1e3, "no step can be made from these states of ball: "),
            (1e200, "no step can be made from these states of ball: "),
        ] {
            let error = flight
                .try_states(&scene, &spinning(&scene, angular_momentum))
                .unwrap_err()
                .to_string();
            assert!(error.starts_with(part), "{error}");
        }
        let flown = spinning(&scene, 4.0);
        flight.try_states(&scene, &flown).unwrap();
        assert_eq!((flight.states(), flight.step()), (&*before, 0));
        flight.set_states(&flown).unwrap();
        flight.advance().unwrap();
    }

    #[test]
    fn a_sequence_in_the_past_is_refused() {
        let mut flight = Flight::new(&scene()).unwrap();
        flight.advance().unwrap();
        let refused = flight.accept(controls(0, 1.0, 10));
        assert_eq!(
            refused,
            Err(ControlError::Late {
                first_step: 0,
                step: 1
            })
        );
        flight.accept(controls(1, 1.0, 1)).unwrap();
    }

    #[test]
    fn wrong_sequences_are_refused_with_field_and_value() {
        let check = |header, intervals: &[ControlInterval]| {
            Controls::check(&scene(), &header, intervals)
                .unwrap_err()
                .to_string()
        };
        let text = check(header("moon", 0, 0.1), &push(1.0, 1));
        assert_eq!(text, "`body` is \"moon\", expected one of ball");
        let text = check(header("ball", 0, 0.2), &push(1.0, 1));
        assert_eq!(
            text,
            "`step_size` is 0.2 s, expected the scene's step 0.1 s"
        );
        assert!(check(header("ball", 0, f64::NAN), &push(1.0, 1)).contains("NaN"));
        assert!(check(header("ball", 0, 0.1), &[]).contains("empty"));
        let mut intervals = push(1.0, 3);
        intervals[2].moment[1] = f64::INFINITY;
        let text = check(header("ball", 0, 0.1), &intervals);
        assert_eq!(
            text,
            "`moment[2]` is [0.0, inf, 0.0], expected three finite numbers"
        );
    }
}
