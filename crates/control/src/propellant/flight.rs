//! The flight of a plan that uses propellant.

use std::sync::Arc;

use lgvi_dynamics::gravity::{Field, Gravity};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::thrusters::{Engine, Thruster, Thrusters};
use lgvi_dynamics::{BodyState, Load, Method, RigidBody, Simulation, System};

use crate::discrete::DecouplingError;
use crate::solver::PlanError;
use crate::{Command, Transfer};

/// The states at `0 … N` under `commands`: thrusters and the engine let pass what is asked for.
pub(super) fn fly(transfer: &Transfer, commands: &[Command]) -> Result<Vec<BodyState>, PlanError> {
    let Some(thrusters) = transfer.body.thrusters() else {
        return Ok(Vec::new());
    };
    let unflown = |step| PlanError::from(DecouplingError::NotFinite { step });
    let left = thrusters.propellant_left();
    let count = thrusters.thrusters().len();
    let greatest = |index: usize| {
        commands
            .iter()
            .map(|force| force[index])
            .fold(0.0, f64::max)
    };
    let prompt = |(index, thruster): (usize, &Thruster)| Thruster {
        thrust: thruster.thrust.max(greatest(index)),
        pulse_period: 0.0,
        minimum_impulse: 0.0,
        delay: 0.0,
        ..*thruster
    };
    let prompt = thrusters
        .thrusters()
        .iter()
        .enumerate()
        .map(prompt)
        .collect();
    let mut body = transfer.body.clone();
    body.set_propellant(thrusters.propellant().mass);
    let mut prompt = Thrusters::new(prompt, *thrusters.propellant()).map_err(|_| unflown(0))?;
    if let Some(engine) = thrusters.engine() {
        let unlimited = Engine {
            thrust: f64::INFINITY,
            ..*engine
        };
        prompt = prompt.with_engine(unlimited).map_err(|_| unflown(0))?;
    }
    let mut body = body.with_thrusters(prompt).map_err(|_| unflown(0))?;
    body.set_propellant(left);
    let gravity = Pull(Arc::clone(&transfer.field));
    let system = System::new(vec![body], vec![Box::new(gravity)]);
    let method = Method::Lgvi(Rotor::Discrete);
    let mut simulation = Simulation::new(system, vec![transfer.initial], method, transfer.h)
        .map_err(|_| unflown(0))?;
    let mut states = vec![transfer.initial];
    for (step, command) in commands.iter().enumerate() {
        let mut load = Load::default();
        if thrusters.engine().is_some() {
            load = simulation.command(0, transfer.actuation.load(command));
        } else {
            simulation.set_thruster_commands(0, &command.as_slice()[..count]);
        }
        let made = simulation.advance(&[load]);
        let state = simulation.states()[0];
        if made.is_err() || !state.is_finite() {
            return Err(unflown(step));
        }
        states.push(state);
    }
    Ok(states)
}

/// The gravity of a field that is shared.
struct Pull(Arc<dyn Field>);

impl Gravity for Pull {
    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        for ((body, state), load) in bodies.iter().zip(states).zip(loads) {
            *load += self.0.load(body, &state.position, &state.attitude);
        }
    }

    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64 {
        let each = bodies.iter().zip(states);
        each.map(|(body, state)| self.0.potential(body, &state.position, &state.attitude))
            .sum()
    }
}
