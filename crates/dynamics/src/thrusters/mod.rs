//! Thrusters: nozzles fixed in a body, whose valves are opened for a time, and the propellant that they use.
//!
//! While its valve is open, a thruster at `r` exerts the force `F d` and the moment `r × F d`, both fixed in the body, and
//! ejects the mass `ṁ = F/c` in a unit of time, where `c` is its effective exhaust velocity. The gas flows straight from the
//! center of mass to the nozzle. With the inertia `J` of what is left, the motion is
//!
//! `m v̇ = R (F d − 2 ṁ Ω × r)`, `Π̇ = Π × Ω + r × F d − ṁ r × (Ω × r)`, `Π = J Ω`,
//!
//! where `−2 ṁ Ω × r` is the Coriolis force of the flow, and the last term with `J̇` the jet damping (L. Meirovitch,
//! *General motion of a variable-mass flexible rocket with internal flow*, J. Spacecraft 7, 1970).
//!
//! Over a step, a thruster acts by the share of it in which its valve is open. As in the discrete mechanics of a load that
//! is held, its impulse acts in halves at both ends of the step, each in the body's attitude there. The mass flows in
//! halves, too, at the outside of both impulses, so that the step is symmetric, of second order.
//!
//! An engine exerts a force of any direction in the inertial frame at the center of mass. Its gas flows out there, so it
//! exerts neither the Coriolis force nor the jet damping: the motion is `m v̇ = F`, with the inertia in proportion to the mass.
//!
//! # Assumptions and limitations
//! A pivoted body turns about its pivot, which then takes the place of the center of mass. The propellant surrounds the center of mass, which therefore does not move in the body. Its inertia is in proportion to
//! its mass, and so is the body's mass distribution for gravity. The force rises and falls at once.

mod engine;
mod flow;
mod valve;

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

pub use engine::Engine;
pub(crate) use flow::Loaded;
use valve::Valve;

/// Relative rounding error of an impulse.
const ROUNDING: f64 = 1e-12;

/// A thruster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thruster {
    /// Position `r` of the nozzle from the center of mass, body frame.
    pub position: Vector3<f64>,
    /// Direction `d` of the force on the body, body frame; normalized by [`Thrusters::new`].
    pub direction: Vector3<f64>,
    /// Force `F` while the valve is open, > 0.
    pub thrust: f64,
    /// Effective exhaust velocity `c`, > 0. Infinity: the thruster uses no propellant.
    pub exhaust_velocity: f64,
    /// Time from one opening of the valve to the next, ≥ 0, rounded to steps, at least one. Steps backwards in time do not
    /// retrace pulses.
    pub pulse_period: f64,
    /// Least impulse of a pulse, ≥ 0. The valve does not open for less.
    pub minimum_impulse: f64,
    /// Time from a command until the valve moves, ≥ 0.
    pub delay: f64,
}

/// The propellant of a body, which is part of its mass and inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Propellant {
    /// Mass, ≥ 0.
    pub mass: f64,
    /// The inertia about the body's center of mass, body frame; that of the body times the propellant's share of its mass if
    /// `None`.
    pub inertia: Option<Matrix3<f64>>,
}

/// Reasons why numbers do not describe thrusters. Thrusters are counted from 0.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ThrusterError {
    /// A thruster without a direction, or with a position that is not finite.
    #[error(
        "the {quantity} of thruster {thruster} is {value:?}, expected three finite numbers{}",
        if *quantity == "direction" { " that are not all 0" } else { "" }
    )]
    Vector {
        /// Index of the thruster.
        thruster: usize,
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value.
        value: [f64; 3],
    },
    /// A number is out of its range.
    #[error("the {quantity} of thruster {thruster} is {value}, expected {expected}")]
    Quantity {
        /// Index of the thruster.
        thruster: usize,
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Description of valid values.
        expected: &'static str,
    },
    /// A number of the engine is out of its range.
    #[error("the {quantity} of the engine is {value}, expected {expected}")]
    Engine {
        /// Name of the quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Description of valid values.
        expected: &'static str,
    },
    /// The propellant's mass is negative or not finite.
    #[error("the mass of the propellant is {0}, expected a finite number ≥ 0")]
    Propellant(f64),
}

/// The thrusters of a body, with their valves and propellant.
#[derive(Clone, Debug, PartialEq)]
pub struct Thrusters {
    thrusters: Vec<Thruster>,
    engine: Option<Engine>,
    propellant: Propellant,
    condition: Condition,
    /// Factors between the forces that open valves exert and those of the thrusters.
    factors: Vec<f64>,
    /// The body with all its propellant.
    loaded: Option<Loaded>,
}

/// The state of a thruster.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ThrusterState {
    /// Mean force over the last step.
    pub thrust: f64,
    /// Sum of the impulses since the start.
    pub impulse: f64,
}

/// What changes from step to step.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Condition {
    valves: Vec<Valve>,
    /// Forces that are asked for.
    commands: Vec<f64>,
    /// Steps since the start.
    step: u64,
    states: Vec<ThrusterState>,
    /// Mass of the propellant that is left.
    propellant: f64,
    /// Change of the velocity by the thrusters in the last step, inertial frame.
    velocity_change: Vector3<f64>,
    /// The force that the engine is asked for, and that of the last step, inertial frame.
    engine_command: Vector3<f64>,
    engine_force: Vector3<f64>,
}

impl Clone for Condition {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    fn clone_from(&mut self, from: &Self) {
        self.valves.clone_from(&from.valves);
        self.commands.clone_from(&from.commands);
        self.states.clone_from(&from.states);
        self.step = from.step;
        self.propellant = from.propellant;
        self.velocity_change = from.velocity_change;
        self.engine_command = from.engine_command;
        self.engine_force = from.engine_force;
    }
}

/// What the thrusters do in a step, on the average, body frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Firing {
    force: Vector3<f64>,
    moment: Vector3<f64>,
    /// The force of the engine, inertial frame.
    engine: Vector3<f64>,
    /// `Σ ṁ`.
    mass_flow: f64,
    /// `Σ ṁ r`.
    lever: Vector3<f64>,
    /// `Σ ṁ (|r|² I − r rᵀ)`, which makes the rate the angular momentum of the gas about the center of mass.
    damping: Matrix3<f64>,
}

impl Thruster {
    /// A thruster without propellant, delay, and limits.
    pub fn new(position: Vector3<f64>, direction: Vector3<f64>, thrust: f64) -> Self {
        Self {
            position,
            direction,
            thrust,
            exhaust_velocity: f64::INFINITY,
            pulse_period: 0.0,
            minimum_impulse: 0.0,
            delay: 0.0,
        }
    }

    fn check(&self, thruster: usize) -> Result<(), ThrusterError> {
        for (quantity, value, turned) in [
            ("position", self.position, true),
            ("direction", self.direction, self.direction.amax() > 0.0),
        ] {
            if !(turned && value.iter().all(|c| c.is_finite())) {
                return Err(ThrusterError::Vector {
                    thruster,
                    quantity,
                    value: value.into(),
                });
            }
        }
        let least = "a finite number ≥ 0";
        let is_least = |value: f64| value.is_finite() && value >= 0.0;
        for (quantity, value, valid, expected) in [
            (
                "thrust",
                self.thrust,
                self.thrust.is_finite() && self.thrust > 0.0,
                "a finite number > 0",
            ),
            (
                "exhaust velocity",
                self.exhaust_velocity,
                self.exhaust_velocity > 0.0,
                "a number > 0",
            ),
            (
                "pulse period",
                self.pulse_period,
                is_least(self.pulse_period),
                least,
            ),
            (
                "minimum impulse",
                self.minimum_impulse,
                is_least(self.minimum_impulse),
                least,
            ),
            ("delay", self.delay, is_least(self.delay), least),
        ] {
            if !valid {
                return Err(ThrusterError::Quantity {
                    thruster,
                    quantity,
                    value,
                    expected,
                });
            }
        }
        Ok(())
    }

    /// How long the valve opens in a pulse of this period to exert a mean force.
    fn opening(&self, command: f64, period: f64) -> f64 {
        let time = (command / self.thrust).clamp(0.0, 1.0) * period;
        if self.thrust * time < self.minimum_impulse * (1.0 - ROUNDING) {
            0.0
        } else {
            time
        }
    }
}

impl Thrusters {
    /// Creates the thrusters of a body with their propellant. They are shut.
    ///
    /// # Errors
    /// Returns an error if a number is out of the range that [`Thruster`] and [`Propellant`] state.
    pub fn new(
        mut thrusters: Vec<Thruster>,
        propellant: Propellant,
    ) -> Result<Self, ThrusterError> {
        for (index, thruster) in thrusters.iter_mut().enumerate() {
            thruster.check(index)?;
            thruster.direction = (thruster.direction / thruster.direction.amax()).normalize();
        }
        let mass = propellant.mass;
        if !(mass.is_finite() && mass >= 0.0) {
            return Err(ThrusterError::Propellant(mass));
        }
        let count = thrusters.len();
        Ok(Self {
            condition: Condition {
                valves: vec![Valve::default(); count],
                commands: vec![0.0; count],
                states: vec![ThrusterState::default(); count],
                propellant: mass,
                ..Condition::default()
            },
            factors: vec![1.0; count],
            thrusters,
            engine: None,
            propellant,
            loaded: None,
        })
    }

    /// The thrusters.
    pub fn thrusters(&self) -> &[Thruster] {
        &self.thrusters
    }

    /// The propellant at the start.
    pub fn propellant(&self) -> &Propellant {
        &self.propellant
    }

    /// The mass of the propellant that is left.
    pub fn propellant_left(&self) -> f64 {
        self.condition.propellant
    }

    /// The states of the thrusters, one per thruster.
    pub fn states(&self) -> &[ThrusterState] {
        &self.condition.states
    }

    /// Sets the states of the thrusters, one per thruster.
    pub fn set_states(&mut self, states: &[ThrusterState]) {
        self.condition.states.copy_from_slice(states);
    }

    /// The change of the body's velocity by the thrusters in the last step, inertial frame.
    pub fn velocity_change(&self) -> Vector3<f64> {
        self.condition.velocity_change
    }

    /// Sets the mean forces that are asked for from the next step on, one per thruster, limited to 0 … F. A thruster takes the
    /// force at the beginning of each of its pulse periods, which follow each other from the start.
    pub fn set_commands(&mut self, thrust: &[f64]) {
        self.condition.commands.copy_from_slice(thrust);
    }

    /// Sets the factors, ≥ 0, by which the thrusters exert other forces than they are told to, one per thruster. Their propellant
    /// flows out with these forces.
    pub fn set_factors(&mut self, factors: &[f64]) {
        self.factors.copy_from_slice(factors);
    }

    /// What changes from step to step.
    pub(crate) fn condition(&self) -> &Condition {
        &self.condition
    }

    /// Moves the valves over a step of length `h`.
    pub(crate) fn begin_step(&mut self, h: f64) -> Firing {
        let step = h.abs();
        let state = &mut self.condition;
        state.velocity_change = Vector3::zeros();
        for (index, thruster) in self.thrusters.iter().enumerate() {
            let period = (thruster.pulse_period / step).round().max(1.0);
            let valve = &mut state.valves[index];
            if state.step.is_multiple_of(period as u64) {
                let open = thruster.opening(state.commands[index], period * step);
                valve.pulse(thruster.delay / step, open / step);
            }
            state.states[index].thrust = valve.pass() * thruster.thrust * self.factors[index];
        }
        state.step = state.step.saturating_add(1);
        let command = state.engine_command;
        let engine = self.engine.as_ref();
        state.engine_force =
            engine.map_or_else(Vector3::zeros, |engine| engine.within_limit(command));
        let asked = self.mass_flow() * step;
        if asked > self.condition.propellant {
            let share = self.condition.propellant / asked;
            for (state, thruster) in self.condition.states.iter_mut().zip(&self.thrusters) {
                if thruster.exhaust_velocity.is_finite() {
                    state.thrust *= share;
                }
            }
            self.condition.engine_force *= share;
        }
        for state in &mut self.condition.states {
            state.impulse += step * state.thrust;
        }
        self.firing()
    }

    /// The mass that flowed out in the last step, in a unit of time.
    pub fn mass_flow(&self) -> f64 {
        let each = self.thrusters.iter().zip(&self.condition.states);
        let flows = each.map(|(thruster, state)| state.thrust / thruster.exhaust_velocity);
        let engine = self.engine.as_ref();
        let force = self.condition.engine_force.norm();
        flows.sum::<f64>() + engine.map_or(0.0, |engine| force / engine.exhaust_velocity)
    }

    fn firing(&self) -> Firing {
        let mut sum = Firing {
            engine: self.condition.engine_force,
            ..Firing::default()
        };
        if let Some(engine) = &self.engine {
            sum.mass_flow = sum.engine.norm() / engine.exhaust_velocity;
        }
        for (thruster, state) in self.thrusters.iter().zip(&self.condition.states) {
            let thrust = state.thrust;
            if thrust == 0.0 {
                continue;
            }
            let (r, force) = (&thruster.position, thrust * thruster.direction);
            let flow = thrust / thruster.exhaust_velocity;
            sum.force += force;
            sum.moment += r.cross(&force);
            sum.mass_flow += flow;
            sum.lever += flow * r;
            sum.damping +=
                flow * (Matrix3::from_diagonal_element(r.norm_squared()) - r * r.transpose());
        }
        sum
    }
}

impl Firing {
    /// Returns true if propellant flows out.
    pub(crate) fn flows(&self) -> bool {
        self.mass_flow != 0.0
    }

    /// Returns true if a thruster exerts a force.
    pub(crate) fn acts(&self) -> bool {
        *self != Self::default()
    }
}
