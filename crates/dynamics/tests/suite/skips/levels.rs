//! Interactions that are simplified while the bodies are far from each other.

use std::sync::{Arc, Mutex};

use lgvi_dynamics::Accuracy;
use lgvi_dynamics::gravity::{Central, Gravity, Interaction, Kept, Level, Mutual, Separable};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::skip::Allowance;
use lgvi_dynamics::{BodyState, Load, Method, RigidBody, Skip, System};
use lgvi_truth::random::Random;
use nalgebra::Vector3;

use super::{ball, dumbbell, fly, inertia, mutual, state};

/// Mutual gravity that records the kept interactions in each evaluation.
struct Noting {
    gravity: Mutual,
    kept: Arc<Mutex<Vec<Vec<Kept>>>>,
}

impl Gravity for Noting {
    fn add_loads(&mut self, bodies: &[RigidBody], states: &[BodyState], loads: &mut [Load]) {
        let all = bodies.len() * (bodies.len() - 1) / 2;
        let full = Kept {
            body: 0,
            other: 1,
            level: Level::Full,
            masses: 0.0,
        };
        self.kept.lock().expect("the notes").push(vec![full; all]);
        self.gravity.add_loads(bodies, states, loads);
    }

    fn potential(&self, bodies: &[RigidBody], states: &[BodyState]) -> f64 {
        self.gravity.potential(bodies, states)
    }

    fn separable(&mut self) -> Option<&mut dyn Separable> {
        Some(self)
    }
}

impl Separable for Noting {
    fn interactions(&self, bodies: &[RigidBody]) -> Vec<Interaction> {
        self.gravity.interactions(bodies)
    }

    fn add_kept_loads(
        &mut self,
        bodies: &[RigidBody],
        states: &[BodyState],
        loads: &mut [Load],
        kept: &[Kept],
    ) {
        self.kept.lock().expect("the notes").push(kept.to_vec());
        self.gravity.add_kept_loads(bodies, states, loads, kept);
    }
}

const METHODS: [Method; 3] = [
    Method::Lgvi(Rotor::Exact),
    Method::Nystrom { order: 6 },
    Method::DormandPrince853 { tolerance: 1e-11 },
];

/// A dumbbell with a large inertia, which gravity hardly rotates.
fn inert(mass: f64, length: f64) -> RigidBody {
    let points = dumbbell(mass, length).points().to_vec();
    RigidBody::new(mass, inertia([3e3, 4e3, 5e3]), points).expect("a body")
}

/// Two dumbbells that pass each other.
pub(super) fn flyby() -> ([RigidBody; 2], [BodyState; 2]) {
    let bodies = [inert(1.0, 0.4), inert(2.0, 0.3)];
    let mut random = Random::new(8, 0);
    let states = [
        state(&bodies[0], [-60.0, 1.5, 0.0], [2.0, 0.0, 0.0], &mut random),
        state(&bodies[1], [0.0, 0.0, 0.0], [0.0, 0.1, 0.0], &mut random),
    ];
    (bodies, states)
}

/// The interaction is restored when the bodies meet and simplified again afterwards, and the end state agrees with that
/// of the full computation within the tolerance.
#[test]
fn a_pair_that_comes_near_is_computed_in_full() {
    let (bodies, states) = flyby();
    let (duration, tolerance) = (60.0, 1e-5);
    for method in METHODS {
        let mut system = System::new(bodies.to_vec(), mutual(0.2));
        let skip = Skip::within(&mut system, &states, duration, tolerance);
        let Skip::Within(allowance) = skip else {
            panic!("{skip:?}");
        };
        let kept = Arc::new(Mutex::new(Vec::new()));
        let noting = || -> Vec<Box<dyn Gravity>> {
            let kept = kept.clone();
            let gravity = Mutual::new(0.2);
            vec![Box::new(Noting { gravity, kept })]
        };
        let steps = (0.02, 3_000);
        let full = fly(
            (&bodies, mutual(0.2)),
            &states,
            method,
            steps,
            Skip::Nothing,
        );
        let reduced = fly((&bodies, noting()), &states, method, steps, skip);
        let error = Accuracy::new(&bodies, &states).error(reduced.states(), full.states());
        assert!(error <= tolerance, "{method}: {error:e}");
        let notes = kept.lock().expect("the notes");
        let levels = |notes: &[Kept]| match notes {
            [] => Level::Dropped,
            [kept, ..] => kept.level,
        };
        let mut course: Vec<_> = notes.iter().map(|note| levels(note)).collect();
        course.dedup();
        if method != METHODS[2] {
            course.remove(0); // the simulation was created before its omissions were set
        }
        println!("{method}: {error:e}, {course:?}, {allowance:?}");
        assert!(course.len() > 2 && reduced.switches() >= 2, "{course:?}");
        assert!(course.contains(&Level::Full), "{course:?}");
        assert!(course[0] < Level::Full && course[course.len() - 1] < Level::Full);
    }
}

/// The error stays within each of three tolerances, and a zero allowance omits nothing.
#[test]
fn errors_follow_the_allowance() {
    let (bodies, states) = flyby();
    for method in [METHODS[1], Method::Taylor { tolerance: 1e-11 }] {
        errors_of(method, &bodies, &states);
    }
}

fn errors_of(method: Method, bodies: &[RigidBody; 2], states: &[BodyState; 2]) {
    let steps = (0.02, 3_000);
    let full = fly((bodies, mutual(0.2)), states, method, steps, Skip::Nothing);
    let accuracy = Accuracy::new(bodies, states);
    let mut system = System::new(bodies.to_vec(), mutual(0.2));
    for tolerance in [1e-3, 1e-5, 1e-7] {
        let skip = Skip::within(&mut system, states, 60.0, tolerance);
        let reduced = fly((bodies, mutual(0.2)), states, method, steps, skip);
        let error = accuracy.error(reduced.states(), full.states());
        println!("{method}, {tolerance:e}: {error:e}");
        assert!(error <= tolerance, "{tolerance:e}: {error:e}");
    }
    let none = Allowance {
        tolerance: 0.0,
        perturbation: 0.0,
        length: accuracy.length,
        response: 1.0,
        evaluations: 0,
    };
    let reduced = fly(
        (bodies, mutual(0.2)),
        states,
        method,
        steps,
        Skip::Within(none),
    );
    assert_eq!(reduced.states(), full.states());
    assert_eq!(reduced.switches(), 0);
}

/// Balls on orbits about a fixed center, most of them far from each other.
fn swarm(count: u64) -> (Vec<RigidBody>, Vec<BodyState>) {
    let each = (0..count).map(|index| {
        let mut random = Random::new(9, index);
        let body = ball(random.log_uniform(1e-12, 1e-11));
        let radius = random.uniform(0.9, 1.1);
        let out = random.direction();
        let along = out.cross(&random.direction()).normalize() / f64::sqrt(radius);
        let state = state(&body, (radius * out).into(), along.into(), &mut random);
        (body, state)
    });
    each.unzip()
}

/// In a system of 24 bodies nearly all pairs are dropped, the tolerance is met, and repeated simulations are bitwise
/// equal.
#[test]
fn negligible_pairs_of_a_swarm_are_dropped() {
    let (bodies, states) = swarm(24);
    let gravity = |kept: &Arc<Mutex<Vec<Vec<Kept>>>>| -> Vec<Box<dyn Gravity>> {
        let (gravity, kept) = (Mutual::new(1.0), kept.clone());
        vec![
            Box::new(Central { gm: 1.0 }),
            Box::new(Noting { gravity, kept }),
        ]
    };
    let kept = Arc::default();
    let (duration, tolerance, steps) = (20.0, 1e-5, (0.05, 400));
    let mut system = System::new(bodies.clone(), gravity(&kept));
    let skip = Skip::within(&mut system, &states, duration, tolerance);
    kept.lock().expect("the notes").clear();
    let flown = |skip| fly((&bodies, gravity(&kept)), &states, METHODS[1], steps, skip);
    let reduced = flown(skip);
    let mut notes: Vec<_> = std::mem::take(&mut *kept.lock().expect("the notes"));
    notes.remove(0); // the simulation was created before its omissions were set
    let most = notes.iter().map(Vec::len).max().expect("evaluations");
    println!(
        "{most} of 276 pairs, {} switches, {skip:?}",
        reduced.switches()
    );
    assert!(most < 40, "{most} pairs");
    assert_eq!(flown(skip).states(), reduced.states());
    let full = flown(Skip::Nothing);
    let error = Accuracy::new(&bodies, &states).error(reduced.states(), full.states());
    println!("{error:e}");
    assert!(error <= tolerance, "{error:e}");
    let alone = fly(
        (&bodies, vec![Box::new(Central { gm: 1.0 })]),
        &states,
        METHODS[1],
        steps,
        Skip::Nothing,
    );
    let effect = Accuracy::new(&bodies, &states).error(alone.states(), full.states());
    assert!(effect > 0.0, "{effect:e}");
}

/// If errors grow too fast, as in a strongly coupled pair, nothing is omitted.
#[test]
fn strong_coupling_leaves_nothing_out() {
    let bodies = [dumbbell(1.0, 0.4), dumbbell(2.0, 0.3)];
    let mut random = Random::new(8, 1);
    let states = [
        state(&bodies[0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], &mut random),
        state(&bodies[1], [0.0, 0.0, 0.0], [0.0, -0.5, 0.0], &mut random),
    ];
    let mut system = System::new(bodies.to_vec(), mutual(1.0));
    assert_eq!(Skip::within(&mut system, &states, 30.0, 1e-6), Skip::Exact);
}

/// After states are set, distances are checked from the new states.
#[test]
fn set_states_are_watched_from_there() {
    let (bodies, states) = flyby();
    let mut system = System::new(bodies.to_vec(), mutual(0.2));
    let skip = Skip::within(&mut system, &states, 60.0, 1e-4);
    let mut near = states;
    near[0].position = Vector3::new(1.5, 0.0, 0.0);
    let flown =
        |from: &[BodyState], skip| fly((&bodies, mutual(0.2)), from, METHODS[0], (0.01, 10), skip);
    let mut moved = flown(&states, skip);
    moved.set_states(&near).expect("states");
    for _ in 0..10 {
        moved.advance(&[Load::default(); 2]).expect("a step");
    }
    assert_eq!(moved.states(), flown(&near, Skip::Nothing).states());
}
