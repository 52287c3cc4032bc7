//! A user-defined integrator: the symplectic Euler method for point masses, compared with the LGVI.

#![allow(clippy::print_stdout)]

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::{
    BodyState, Inertia, Integrator, Load, Method, RigidBody, Simulation, StepError, StepReport,
    System,
};
use nalgebra::{Matrix3, Vector3};

/// A kick, followed by a drift. Attitudes remain unchanged.
#[derive(Default)]
struct SymplecticEuler {
    loads: Vec<Load>,
}

impl Integrator for SymplecticEuler {
    fn start(&mut self, _system: &mut System, states: &[BodyState]) {
        self.loads = vec![Load::default(); states.len()];
    }

    fn step(
        &mut self,
        system: &mut System,
        states: &mut [BodyState],
        controls: &[Load],
        h: f64,
    ) -> Result<StepReport, StepError> {
        system.loads(states, &mut self.loads);
        let loads = self.loads.iter().zip(controls);
        for ((state, body), (load, control)) in states.iter_mut().zip(system.bodies()).zip(loads) {
            state.linear_momentum += h * (load.force + control.force);
            state.position += h / body.mass() * state.linear_momentum;
        }
        Ok(StepReport::default())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let circle = || -> Result<_, Box<dyn std::error::Error>> {
        let body = RigidBody::new(1.0, Inertia::principal([1.0; 3])?, vec![])?;
        let (x, v) = (Vector3::x(), Vector3::y());
        let (attitude, rate) = (Matrix3::identity(), Vector3::zeros());
        let state = BodyState::from_velocities(&body, x, v, attitude, rate);
        let system = System::new(vec![body], vec![Box::new(Central { gm: 1.0 })]);
        Ok((system, vec![state]))
    };
    let steps = 1000;
    let h = std::f64::consts::TAU / f64::from(steps);
    let (system, states) = circle()?;
    let own = Simulation::with_integrator(system, states, Box::new(SymplecticEuler::default()), h)?;
    let (system, states) = circle()?;
    let lgvi = Simulation::new(system, states, Method::Lgvi(Default::default()), h)?;
    for (name, mut simulation) in [("symplectic Euler", own), ("LGVI", lgvi)] {
        for _ in 0..steps {
            simulation.advance(&[Load::default()])?;
        }
        let miss = (simulation.states()[0].position - Vector3::x()).norm();
        println!("{name}: {miss:.1e} off after one revolution");
    }
    Ok(())
}
