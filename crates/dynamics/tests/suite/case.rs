//! Simulations of the reference trajectories.

use lgvi_dynamics::{BodyState, Load, Method, RigidBody, Simulation, System};
use lgvi_truth::Errors;

pub struct Case(lgvi_truth::Case);

impl Case {
    pub fn load(name: &str) -> Self {
        Self(lgvi_truth::Case::load(name).expect("a case"))
    }

    pub fn system(&self) -> (System, Vec<BodyState>) {
        self.0.system().expect("the bodies of a case")
    }

    pub fn times(&self) -> Vec<f64> {
        self.0.times()
    }

    pub fn simulation(&self, method: Method, h: f64) -> Simulation {
        let (_, states) = self.system();
        self.simulation_from(states, method, h)
    }

    /// Creates a simulation of the case's bodies from other states.
    pub fn simulation_from(&self, states: Vec<BodyState>, method: Method, h: f64) -> Simulation {
        let (system, _) = self.system();
        Simulation::new(system, states, method, h).expect("a method for the case")
    }

    /// Integrates to the reference state at time `t` in `steps` steps and returns the errors.
    pub fn errors_at(&self, t: f64, steps: u32, method: Method) -> Errors {
        let mut simulation = self.simulation(method, t / f64::from(steps));
        let controls = vec![Load::default(); simulation.states().len()];
        for _ in 0..steps {
            simulation.advance(&controls).expect("a step");
        }
        self.compare(t, &simulation)
    }

    pub fn compare(&self, t: f64, simulation: &Simulation) -> Errors {
        self.compare_states(t, simulation.system().bodies(), simulation.states())
    }

    /// Compares `found` with the reference states at time `t`.
    pub fn compare_states(&self, t: f64, bodies: &[RigidBody], found: &[BodyState]) -> Errors {
        self.0.errors(t, bodies, found).expect("a state at t")
    }
}
