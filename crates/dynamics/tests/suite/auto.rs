//! The choice of method and step: it reaches what is asked, against `tests/truth`, at nearly the least cost.

mod timing;

use lgvi_dynamics::auto::{Accuracy, Choice, ChoiceError, Outlook, Run, choose};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use lgvi_dynamics::gravity::{Central, Gravity};
use lgvi_dynamics::{BodyState, Load, Method, RigidBody, Simulation, System};

use crate::case::Case;

/// Cases of `tests/truth`, durations and steps of the runs.
const RUNS: [(&str, f64, u64); 12] = [
    ("a1_two_dumbbells_regular", 10.0, 100),
    ("a1_two_dumbbells_regular", 30.0, 300),
    ("a1_two_dumbbells_regular", 30.0, 15_000),
    ("d_dumbbell_central", 10.0, 50),
    ("d_dumbbell_central", 30.0, 3_000),
    ("d_dumbbell_central", 100.0, 100),
    ("b1_free_asymmetric", 10.0, 10),
    ("b1_free_asymmetric", 100.0, 10_000),
    ("c1_3d_pendulum", 2.0, 200),
    ("c3_3d_pendulum_regular_small", 20.0, 100),
    ("c3_3d_pendulum_regular_small", 100.0, 1_000),
    ("e_kw4_like", 432_000.0, 120),
];

const TOLERANCES: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];

struct Flown {
    case: Case,
    run: Run,
}

impl Flown {
    fn new(name: &str, duration: f64, steps: u64) -> Self {
        Self {
            case: Case::load(name),
            run: Run { duration, steps },
        }
    }

    fn choose(&self, tolerance: f64) -> Result<Choice, ChoiceError> {
        let (mut system, states) = self.case.system();
        choose(&mut system, &states, self.run, tolerance)
    }

    fn simulation(&self, method: Method, substeps: u32) -> Simulation {
        let h = self.run.duration / self.run.steps as f64;
        self.case.simulation(method, h).with_substeps(substeps)
    }

    /// The error at the end of the run, infinite where a step cannot be made.
    fn error(&self, method: Method, substeps: u32) -> f64 {
        let mut simulation = self.simulation(method, substeps);
        let accuracy = Accuracy::new(simulation.system().bodies(), simulation.states());
        let controls = vec![Load::default(); simulation.states().len()];
        for _ in 0..self.run.steps {
            if simulation.advance(&controls).is_err() {
                return f64::INFINITY;
            }
        }
        let errors = self.case.compare(self.run.duration, &simulation);
        let attitude = errors.attitude * std::f64::consts::FRAC_1_SQRT_2;
        attitude.max(errors.position / accuracy.length)
    }
}

#[test]
fn the_choice_reaches_the_tolerance() {
    for (name, duration, steps) in RUNS {
        let flown = Flown::new(name, duration, steps);
        for tolerance in TOLERANCES {
            let choice = flown.choose(tolerance).expect("a choice");
            let allowed = match choice.outlook {
                Outlook::Met => 3.0 * tolerance,
                Outlook::Limited { floor } => 9.0 * floor,
                Outlook::Chaotic { .. } => panic!("{name} is regular: {choice}"),
            };
            let error = flown.error(choice.method, choice.substeps);
            assert!(
                error <= allowed,
                "{name} to {duration} for {tolerance:e}: error {error:e}\n{choice}"
            );
        }
    }
}

/// Counts evaluations.
struct Counted<G> {
    gravity: G,
    evaluations: Arc<AtomicU64>,
}

impl<G: Gravity> Gravity for Counted<G> {
    fn cost(&self, bodies: &[RigidBody]) -> f64 {
        self.gravity.cost(bodies)
    }

    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        self.gravity.add_loads(bodies, states, loads);
    }

    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64 {
        self.gravity.potential(bodies, states)
    }
}

#[test]
fn pilot_flights_take_at_most_what_is_stated() {
    let (_, states) = Case::load("d_dumbbell_central").system();
    for (duration, steps) in [(10.0, 1), (1e3, 1_000), (1e5, 1_000)] {
        let (system, _) = Case::load("d_dumbbell_central").system();
        let evaluations = Arc::new(AtomicU64::new(0));
        let gravity = Counted {
            gravity: Central { gm: 1.0 },
            evaluations: evaluations.clone(),
        };
        let mut counted = System::new(system.bodies().to_vec(), vec![Box::new(gravity)]);
        let begun = std::time::Instant::now();
        let choice = choose(&mut counted, &states, Run { duration, steps }, 1e-6);
        println!("{:?} {duration}", begun.elapsed());
        println!("{:?} {choice:?}", evaluations.load(Ordering::Relaxed));
        if let Ok(choice) = choice {
            println!("{choice}");
        }
    }
}
