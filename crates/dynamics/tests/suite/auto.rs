//! The choice of method and step: it reaches what is asked, against `tests/truth`, at nearly the least cost.

use lgvi_dynamics::auto::{ALLOWANCE, Accuracy, Choice, ChoiceError, Outlook, PART, Run, choose};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use lgvi_dynamics::gravity::{Central, Gravity, Mutual};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, StepError, System};
use lgvi_truth::RUNS;
use nalgebra::{Matrix3, Vector3};

use crate::case::Case;

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

impl<G: Gravity + 'static> Counted<G> {
    /// Of a case's bodies.
    fn system(name: &str, gravity: G) -> (System, Vec<BodyState>, Arc<AtomicU64>) {
        let (system, states) = Case::load(name).system();
        let evaluations = Arc::new(AtomicU64::new(0));
        let counted = Self {
            gravity,
            evaluations: evaluations.clone(),
        };
        let system = System::new(system.bodies().to_vec(), vec![Box::new(counted)]);
        (system, states, evaluations)
    }
}

/// The flight's own evaluations are those of its first hundredth, a hundred times. The flight that the first
/// pilot lets expect, a part of which the second may take, can be dearer than the one that is chosen then: thrice is allowed.
#[test]
fn pilot_flights_take_at_most_what_is_stated() {
    for duration in [1e2, 1e4, 3e5] {
        let (mut system, states, evaluations) =
            Counted::system("d_dumbbell_central", Central { gm: 1.0 });
        let steps = 1_000;
        let choice = choose(&mut system, &states, Run { duration, steps }, 1e-4).expect("a choice");
        let pilot = evaluations.swap(0, Ordering::Relaxed);
        assert!(
            pilot <= choice.evaluations + choice.evaluations / 10,
            "{pilot} {choice}"
        );
        let h = duration / steps as f64;
        let mut simulation = Simulation::new(system, states, choice.method, h)
            .expect("a simulation")
            .with_substeps(choice.substeps);
        for _ in 0..steps / 100 {
            simulation.advance(&[Load::default()]).expect("a step");
        }
        let flight = 100 * evaluations.load(Ordering::Relaxed);
        assert!(
            pilot <= ALLOWANCE.max((3.0 * PART * flight as f64) as u64),
            "{pilot} {flight} {choice}"
        );
    }
}

#[test]
fn the_same_input_gives_the_same_choice() {
    let flown = Flown::new("a1_two_dumbbells_regular", 10.0, 100);
    for tolerance in TOLERANCES {
        assert_eq!(flown.choose(tolerance), flown.choose(tolerance));
    }
}

#[test]
fn free_bodies_whose_closed_form_is_cheap_need_no_pilot() {
    let choice = Flown::new("b1_free_asymmetric", 1000.0, 100)
        .choose(1e-10)
        .expect("a choice");
    assert_eq!((choice.method, choice.substeps), (Method::ClosedForm, 1));
    assert_eq!(choice.evaluations, 0);
}

#[test]
fn what_is_out_of_range_is_refused() {
    let (mut system, states) = Case::load("d_dumbbell_central").system();
    let run = Run {
        duration: 1.0,
        steps: 10,
    };
    let mut refused = |states: &[BodyState], run, tolerance| {
        choose(&mut system, states, run, tolerance).expect_err("an error")
    };
    for duration in [0.0, -1.0, f64::INFINITY] {
        assert_eq!(
            refused(&states, Run { duration, ..run }, 1e-6),
            ChoiceError::Duration(duration)
        );
    }
    assert_eq!(
        refused(&states, Run { steps: 0, ..run }, 1e-6),
        ChoiceError::Steps
    );
    for tolerance in [0.0, -1e-6, 1e-17, 1.0, f64::INFINITY] {
        assert_eq!(
            refused(&states, run, tolerance),
            ChoiceError::Tolerance(tolerance)
        );
    }
    assert_eq!(
        refused(&[], run, 1e-6),
        ChoiceError::States {
            states: 0,
            bodies: 1
        }
    );
    let mut lost = states.clone();
    lost[0].position.x = f64::NAN;
    assert_eq!(refused(&lost, run, 1e-6), ChoiceError::NotFinite(0));
}

fn sphere(radius: f64, x: f64, speed: f64) -> (RigidBody, BodyState) {
    let inertia = Inertia::principal([0.4; 3]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, vec![]).and_then(|body| body.with_radius(radius));
    let body = body.expect("body");
    let (x, v) = (Vector3::new(x, 0.0, 0.0), Vector3::new(speed, 0.0, 0.0));
    let state = BodyState::from_velocities(&body, x, v, Matrix3::identity(), Vector3::zeros());
    (body, state)
}

#[test]
fn a_collision_is_an_error() {
    let (bodies, states): (Vec<_>, Vec<_>) = [sphere(0.5, -2.0, 1.0), sphere(0.5, 2.0, -1.0)]
        .into_iter()
        .unzip();
    let mut system = System::new(bodies, vec![Box::new(Mutual::new(1.0))]);
    let run = Run {
        duration: 10.0,
        steps: 10,
    };
    let error = choose(&mut system, &states, run, 1e-6).expect_err("a collision");
    assert!(
        matches!(error, ChoiceError::Flight(StepError::CloseApproach(_))),
        "{error:?}"
    );
}

/// A body that turns a thousand times in a step of the run, which no method makes as one.
#[test]
fn a_fast_spin_gets_the_substeps_that_it_needs() {
    let (mut system, mut states) = Case::load("c1_3d_pendulum").system();
    states[0].angular_momentum *= 1e3;
    let run = Run {
        duration: 2.0,
        steps: 2,
    };
    let choice = choose(&mut system, &states, run, 1e-6).expect("a choice");
    let fly = |method, substeps| {
        let case = Case::load("c1_3d_pendulum");
        let mut simulation = case
            .simulation_from(states.clone(), method, 1.0)
            .with_substeps(substeps);
        for _ in 0..2 {
            simulation.advance(&[Load::default()]).expect("a step");
        }
        simulation.states().to_vec()
    };
    let rotor = Rotor::Exact;
    let truth = fly(Method::Nystrom { order: 8, rotor }, 10_000);
    let accuracy = Accuracy::new(system.bodies(), &states);
    let error = accuracy.error(&fly(choice.method, choice.substeps), &truth);
    assert!(error < 3e-6, "{error:e} {choice}");
}

/// The pendulum's nearby motions part by about e in a second or two: after some ten seconds nothing is known.
#[test]
fn a_chaotic_scene_is_told_and_flown_accurately_as_long_as_it_can_be_known() {
    let choice = Flown::new("c1_3d_pendulum", 200.0, 100)
        .choose(1e-4)
        .expect("a choice");
    let Outlook::Chaotic { known } = choice.outlook else {
        panic!("{choice}");
    };
    assert!(known > 5.0 && known < 50.0, "{choice}");
    let error = Flown::new("c1_3d_pendulum", 5.0, 10).error(choice.method, choice.substeps);
    assert!(error < 1e-4, "{error:e} {choice}");
}
