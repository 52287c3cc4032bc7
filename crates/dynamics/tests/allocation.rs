//! A step neither allocates nor frees memory, for every method and every kind of load.

#![allow(clippy::expect_used)]
#![allow(dead_code, reason = "a case has more than this test needs")]

#[path = "suite/case.rs"]
mod case;

use allocation_counter::{AllocationInfo, measure};
use case::Case;
use lgvi_dynamics::docking::{Docking, Port};
use lgvi_dynamics::gravity::{Fixed, Gravity, Multipole, Mutual, Polyhedron};
use lgvi_dynamics::integrator::{ChartOrigin, KeplerScheme, Quadrature, Rotor};
use lgvi_dynamics::skip::Allowance;
use lgvi_dynamics::{
    BodyState, Drive, Inertia, Load, Method, Mobility, PointMass, RigidBody, Simulation, Skip,
    System,
};
use nalgebra::{Matrix3, Vector3};

/// Number of steps before the measurement, and of measured steps. The latter exceeds the length of the history of
/// initial guesses.
const STEPS: [u32; 2] = [3, 100];

fn methods() -> Vec<Method> {
    let mut all = vec![
        Method::LagrangianLgvi,
        Method::ExplicitMidpoint,
        Method::ImplicitMidpoint,
        Method::CrouchGrossman,
        Method::RungeKutta4,
        Method::Fehlberg78 { tolerance: 1e-10 },
        Method::DormandPrince853 { tolerance: 1e-10 },
        Method::Taylor { tolerance: 1e-10 },
    ];
    for rotor in [Rotor::Discrete, Rotor::Exact] {
        all.push(Method::Lgvi(rotor));
        all.push(Method::LieEuler(rotor));
        all.push(Method::Composition { order: 8, rotor });
    }
    all.push(Method::Nystrom { order: 8 });
    for quadrature in [Quadrature::Gauss(3), Quadrature::Lobatto(4)] {
        for origin in [ChartOrigin::Start, ChartOrigin::Middle] {
            all.push(Method::Galerkin {
                degree: 3,
                quadrature,
                origin,
            });
        }
    }
    all
}

/// Methods that need motion about a center.
fn central_methods() -> [Method; 2] {
    [KeplerScheme::Leapfrog, KeplerScheme::Aba1064].map(|scheme| Method::WisdomHolman { scheme })
}

/// Methods that support only free bodies.
fn free_methods() -> [Method; 2] {
    let euler_poincare = Method::EulerPoincare {
        degree: 3,
        quadrature: Quadrature::Gauss(3),
        origin: ChartOrigin::Middle,
    };
    [euler_poincare, Method::ClosedForm]
}

/// The allocations of steps with and without controls.
fn taken(mut simulation: Simulation) -> AllocationInfo {
    let bodies = simulation.states().len();
    let small = Load {
        force: Vector3::new(1e-3, 2e-3, -1e-3),
        moment: Vector3::new(1e-4, -2e-4, 1e-4),
    };
    let controls = [vec![Load::default(); bodies], vec![small; bodies]];
    let mut fly = |steps: u32| {
        (0..steps).for_each(|step| {
            let controls = &controls[usize::from(step % 4 == 3)];
            simulation.advance(controls).expect("a step");
        });
    };
    fly(STEPS[0]);
    measure(|| fly(STEPS[1]))
}

#[test]
fn what_is_taken_is_counted() {
    let info = measure(|| drop(std::hint::black_box(vec![1_u64])));
    assert_eq!((info.count_total, info.bytes_total), (1, 8));
}

#[test]
fn a_step_of_any_method_allocates_nothing() {
    for (name, h) in [
        ("a1_two_dumbbells_regular", 0.002),
        ("b1_free_asymmetric", 0.01),
        ("c1_3d_pendulum", 1e-3),
        ("d_dumbbell_central", 0.01),
        ("e_kw4_like", 40.0),
    ] {
        let case = Case::load(name);
        let free = free_methods().into_iter();
        let free = free.filter(|_| name.starts_with('b'));
        let central = central_methods().into_iter();
        let central = central.filter(|_| !name.starts_with(['b', 'c']));
        for method in methods().into_iter().chain(free).chain(central) {
            assert_eq!(
                taken(case.simulation(method, h)),
                AllocationInfo::default(),
                "{name}, {method}"
            );
        }
    }
}

/// A step divided in each possible way: into a given number of substeps, because it does not resolve the motion, or
/// because it cannot be made.
#[test]
fn a_step_that_is_cut_allocates_nothing() {
    let case = Case::load("a1_two_dumbbells_regular");
    for method in methods().into_iter().chain(central_methods()) {
        let simulation = case.simulation(method, 0.01).with_substeps(4);
        assert_eq!(
            taken(simulation),
            AllocationInfo::default(),
            "{method}, substeps"
        );
        if method.has_error_control() {
            continue;
        }
        let simulation = case.simulation(method, 0.2).with_subdivision(12);
        let info = taken(simulation.expect("a depth"));
        assert_eq!(info, AllocationInfo::default(), "{method}, subdivision");
    }
}

/// A step that fails does not allocate either.
#[test]
fn a_step_that_fails_allocates_nothing() {
    let mut simulation =
        Case::load("b1_free_asymmetric").simulation(Method::Lgvi(Rotor::Discrete), 10.0);
    let info = measure(|| {
        simulation
            .advance(&[Load::default()])
            .expect_err("too far a turn");
    });
    assert_eq!(info, AllocationInfo::default());
}

/// A rock, a multipole, a sphere, a driven body and a fixed body attract each other, and an oblate planet attracts
/// them; then the rock and the multipole are joined.
#[test]
fn gravity_of_every_kind_allocates_nothing() {
    let inertia = || Inertia::principal([1.0, 1.2, 1.5]).expect("inertia");
    let rock = Polyhedron::ellipsoid([0.5, 0.4, 0.3], 1, 2.0).expect("a polyhedron");
    let bodies = vec![
        RigidBody::with_polyhedron(None, &rock, 4).expect("a rock"),
        RigidBody::with_multipole(inertia(), Multipole::of_inertia(1.0, &inertia())).expect("body"),
        RigidBody::new(1.0, inertia(), vec![]).expect("body"),
        RigidBody::new(1.0, inertia(), vec![])
            .expect("body")
            .with_mobility(Mobility::Fixed),
        RigidBody::new(1.0, inertia(), vec![])
            .expect("body")
            .with_mobility(Mobility::Driven(Drive::uniform(
                Vector3::new(0.1, 0.0, 0.0),
                Vector3::new(0.0, 0.0, 0.3),
            ))),
    ];
    let states: Vec<_> = (0_u8..)
        .zip(&bodies)
        .map(|(index, body)| {
            BodyState::from_velocities(
                body,
                Vector3::new(4.0 * f64::from(index), 0.0, 5.0),
                Vector3::new(0.0, 0.1, 0.0),
                Matrix3::identity(),
                Vector3::new(0.1, 0.2, -0.1),
            )
        })
        .collect();
    let planet = Multipole::oblate(1.0, 0.1, 0.5);
    let gravity = move || -> Vec<Box<dyn Gravity>> {
        let place = Vector3::new(0.0, -20.0, 0.0);
        vec![
            Box::new(Mutual::new(1e-2)),
            Box::new(Fixed::new(planet.clone(), place, Matrix3::identity())),
        ]
    };
    let port = |body| Port {
        body,
        position: Vector3::zeros(),
        axis: Vector3::x(),
    };
    let docking = Docking {
        ports: [port(0), port(1)],
        distance: f64::INFINITY,
        angle: 4.0,
        speed: f64::INFINITY,
        rate: f64::INFINITY,
    };
    for method in methods() {
        // The first does not support fixed or driven bodies, the second no polyhedra.
        if matches!(method, Method::LagrangianLgvi | Method::Taylor { .. }) {
            continue;
        }
        let simulation = move |system, states| Simulation::new(system, states, method, 0.01);
        let start = || {
            let system = System::new(bodies.clone(), gravity());
            simulation(system, states.clone()).expect("a method")
        };
        assert_eq!(taken(start()), AllocationInfo::default(), "{method}");
        let joined = start().with_dockings(vec![docking], gravity.clone(), simulation);
        let info = taken(joined.expect("a docking"));
        assert_eq!(info, AllocationInfo::default(), "{method}, joined");
    }
}

/// Two bodies pass each other, and the level of their attraction rises and falls again.
#[test]
fn a_change_of_what_is_left_out_allocates_nothing() {
    let points = [Vector3::x(), Vector3::y(), Vector3::z()];
    let points = points
        .into_iter()
        .flat_map(|axis| [0.2 * axis, -0.2 * axis]);
    let points = points.map(|position| PointMass {
        mass: 0.25,
        position,
    });
    let inertia = Inertia::principal([3.0, 4.0, 5.0]).expect("inertia");
    let body = RigidBody::new(1.5, inertia, points.collect()).expect("a body");
    let bodies = [body.clone(), body];
    let states = [-1.0, 1.0].map(|side| {
        BodyState::from_velocities(
            &bodies[0],
            Vector3::new(5.0 * side, 0.4 * side, 0.0),
            Vector3::new(-2.0 * side, 0.0, 0.0),
            Matrix3::identity(),
            Vector3::new(0.1, 0.2, -0.1),
        )
    });
    let skip = Skip::Within(Allowance {
        tolerance: 0.1,
        perturbation: 0.02,
        length: 1.0,
        response: 1.0,
        evaluations: 0,
    });
    // Taylor series are set up anew at a change.
    let all = methods().into_iter();
    let all = all.filter(|method| !matches!(method, Method::Taylor { .. }));
    for (method, depth) in all.flat_map(|method| [(method, 0), (method, 2)]) {
        let system = System::new(bodies.to_vec(), vec![Box::new(Mutual::new(0.1))]);
        let simulation = Simulation::new(system, states.to_vec(), method, 0.05);
        let mut simulation = simulation.expect("a method");
        if depth > 0 && !method.has_error_control() {
            simulation = simulation.with_subdivision(depth).expect("a depth");
        }
        let mut simulation = simulation.with_skips(skip);
        let mut fly = |steps: u32| {
            (0..steps).for_each(|_| {
                simulation.advance(&[Load::default(); 2]).expect("a step");
            });
        };
        fly(STEPS[0]);
        let info = measure(|| fly(STEPS[1]));
        assert_eq!(info, AllocationInfo::default(), "{method}, {depth}");
        assert!(
            simulation.switches() >= 4,
            "{method}: {}",
            simulation.switches()
        );
    }
}
