//! Galerkin Lie group variational integrators: order, conservation laws, equivariance, and the reduced equations.

use crate::case::Case;
use lgvi_dynamics::gravity::{Central, Gravity, Mutual};
use lgvi_dynamics::integrator::{ChartOrigin, Quadrature, Rotor};
use lgvi_dynamics::{
    BodyState, Drive, Inertia, Load, Method, MethodError, Mobility, PointMass, RigidBody,
    Simulation, StepError, System,
};
use lgvi_lie::{exp, hat, log};
use lgvi_truth::Errors;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

const ORIGINS: [ChartOrigin; 2] = [ChartOrigin::Start, ChartOrigin::Middle];

/// The Galerkin method with as many Gauss points as the degree.
fn galerkin(degree: u32, origin: ChartOrigin) -> Method {
    Method::Galerkin {
        degree,
        quadrature: Quadrature::Gauss(degree),
        origin,
    }
}

fn euler_poincare(degree: u32, origin: ChartOrigin) -> Method {
    Method::EulerPoincare {
        degree,
        quadrature: Quadrature::Gauss(degree),
        origin,
    }
}

fn fly(simulation: &mut Simulation, controls: &[Load], steps: u32) {
    for _ in 0..steps {
        simulation.advance(controls).expect("a step");
    }
}

fn distance(a: &[BodyState], b: &[BodyState]) -> f64 {
    let each = |(a, b): (&BodyState, &BodyState)| {
        (a.position - b.position)
            .norm()
            .max((a.linear_momentum - b.linear_momentum).norm())
            .max((a.attitude - b.attitude).norm())
            .max((a.angular_momentum - b.angular_momentum).norm())
    };
    a.iter().zip(b).map(each).fold(0.0, f64::max)
}

fn size(e: &Errors) -> f64 {
    e.position
        .max(e.velocity)
        .max(e.attitude)
        .max(e.angular_velocity)
}

/// Degree, time t, numbers of steps up to t, and the tolerance of the observed order around `2s`. The higher the
/// degree, the coarser the steps whose errors are still above rounding.
type Ladder = (u32, f64, [u32; 4], f64);

const LADDERS: [(&str, &[Ladder]); 3] = [
    (
        "b1_free_asymmetric",
        &[
            (1, 1.0, [32, 64, 128, 256], 0.05),
            (2, 1.0, [8, 16, 32, 64], 0.1),
            (3, 1.0, [4, 8, 16, 32], 0.1),
            (4, 10.0, [14, 28, 42, 56], 0.3),
        ],
    ),
    (
        "d_dumbbell_central",
        &[
            (1, 1.0, [64, 128, 256, 512], 0.05),
            (2, 1.0, [16, 32, 64, 128], 0.1),
            (3, 1.0, [8, 16, 32, 64], 0.15),
            (4, 1.0, [2, 4, 8, 16], 0.25),
            (5, 1.0, [2, 3, 5, 8], 0.9),
            (6, 5.0, [8, 11, 15, 20], 1.5),
        ],
    ),
    (
        "a1_two_dumbbells_regular",
        &[
            (1, 1.0, [256, 512, 1024, 2048], 0.05),
            (2, 1.0, [32, 64, 128, 256], 0.1),
            (3, 1.0, [16, 32, 64, 128], 0.1),
            (4, 1.0, [6, 12, 24, 48], 0.6),
        ],
    ),
];

#[test]
fn the_order_is_twice_the_degree() {
    for (case, ladders) in LADDERS {
        let case_data = Case::load(case);
        for &(degree, t, steps, tolerance) in ladders {
            for origin in ORIGINS {
                for quadrature in [Quadrature::Gauss(degree), Quadrature::Lobatto(degree + 1)] {
                    let method = Method::Galerkin {
                        degree,
                        quadrature,
                        origin,
                    };
                    let errors = steps.map(|n| size(&case_data.errors_at(t, n, method)));
                    let orders = [0, 1, 2].map(|i| {
                        let refinement = f64::from(steps[i + 1]) / f64::from(steps[i]);
                        (errors[i] / errors[i + 1]).log2() / refinement.log2()
                    });
                    println!("{case} {quadrature:?} {origin:?}: {orders:.2?} {errors:?}");
                    for order in orders {
                        assert!((order - f64::from(2 * degree)).abs() < tolerance);
                    }
                }
            }
        }
    }
}

/// A quadrature of low degree limits the order: the Lobatto rule with s points is exact up to degree `2s − 3`, which
/// gives order `2s − 2`.
#[test]
fn a_weak_quadrature_limits_the_order() {
    let case = Case::load("b1_free_asymmetric");
    let method = Method::Galerkin {
        degree: 3,
        quadrature: Quadrature::Lobatto(3),
        origin: ChartOrigin::Middle,
    };
    let errors = [16, 32, 64, 128].map(|n| size(&case.errors_at(1.0, n, method)));
    for pair in errors.windows(2) {
        assert!(((pair[0] / pair[1]).log2() - 4.0).abs() < 0.1, "{errors:?}");
    }
}

/// Both are second-order variational methods for the same action with different discretizations. If the axial moment is
/// a sixtieth of the others, as in the dumbbells, the geodesics of degree 1 are less accurate than the LGVI in rotation
/// and equally accurate in translation.
#[test]
fn degree_one_is_about_as_accurate_as_the_lgvi() {
    let lgvi = Method::Lgvi(Rotor::default());
    for quadrature in [Quadrature::Gauss(1), Quadrature::Lobatto(2)] {
        let method = Method::Galerkin {
            degree: 1,
            quadrature,
            origin: ChartOrigin::Middle,
        };
        let free = Case::load("b1_free_asymmetric");
        let [ours, theirs] = [method, lgvi].map(|method| size(&free.errors_at(1.0, 200, method)));
        println!("{quadrature:?}: {:.2} of the LGVI's error", ours / theirs);
        assert!((0.2..1.0).contains(&(ours / theirs)));

        let dumbbells = Case::load("a1_two_dumbbells_regular");
        let [ours, theirs] = [method, lgvi].map(|method| dumbbells.errors_at(1.0, 2000, method));
        println!("{quadrature:?}: {ours:?}, LGVI {theirs:?}");
        assert!((0.2..5.0).contains(&(ours.position / theirs.position)));
        assert!(ours.angular_velocity < 30.0 * theirs.angular_velocity);
    }
}

/// The errors are rounding only: 1e4 steps with errors of a few ε = 2e-16, mostly of random sign.
#[test]
fn momenta_are_kept_to_rounding_and_attitudes_stay_rotations() {
    let case = Case::load("a1_two_dumbbells_regular");
    for origin in ORIGINS {
        for degree in 1..=4 {
            let mut simulation = case.simulation(galerkin(degree, origin), 0.02);
            let start = simulation.invariants();
            let mut energy = 0.0_f64;
            let (mut linear, mut angular) = (0.0_f64, 0.0_f64);
            for _ in 0..10_000 {
                fly(&mut simulation, &[Load::default(); 2], 1);
                let now = simulation.invariants();
                energy = energy.max((now.energy - start.energy).abs());
                linear = linear.max((now.linear_momentum - start.linear_momentum).norm());
                angular = angular.max((now.angular_momentum - start.angular_momentum).norm());
                assert!(now.orthogonality_error < 2e-15);
            }
            println!("{degree} {origin:?}: {linear:.1e}, {angular:.1e}, energy {energy:.1e}");
            assert!(linear < 1e-13, "{linear:e}");
            assert!(angular < 1e-12, "{angular:e}");
            // The error is bounded: ten thousand steps show the same error as the first revolutions.
            let bound = [1e-3, 5e-7, 3e-10, 1e-12][degree as usize - 1];
            assert!(energy < bound, "degree {degree}: {energy:e}");
        }
    }
}

#[test]
fn the_energy_error_does_not_grow() {
    let case = Case::load("d_dumbbell_central");
    for origin in ORIGINS {
        let mut simulation = case.simulation(galerkin(2, origin), 0.1);
        let start = simulation.invariants().energy;
        let mut worst = [0.0_f64; 2];
        for half in &mut worst {
            for _ in 0..20_000 {
                fly(&mut simulation, &[Load::default()], 1);
                *half = half.max((simulation.invariants().energy - start).abs());
            }
        }
        println!("{origin:?}: {worst:?}");
        assert!(worst[1] < 1.5 * worst[0], "{worst:?}");
        assert!(worst[0] < 1e-5);
    }
}

fn reversed(states: &[BodyState]) -> Vec<BodyState> {
    let each = |s: &BodyState| BodyState {
        linear_momentum: -s.linear_momentum,
        angular_momentum: -s.angular_momentum,
        ..*s
    };
    states.iter().map(each).collect()
}

fn mutual() -> Vec<Box<dyn Gravity>> {
    vec![Box::new(Mutual::new(1.0))]
}

fn bodies_of(simulation: &Simulation) -> Vec<RigidBody> {
    simulation.system().bodies().to_vec()
}

/// The deviation from the start after 200 steps forward and 200 steps back, by reversed momenta and by a negative step.
fn misses(method: Method) -> [f64; 2] {
    let case = Case::load("a1_two_dumbbells_regular");
    let h = 0.05;
    let controls = [Load::default(); 2];
    let mut there = case.simulation(method, h);
    let start = there.states().to_vec();
    fly(&mut there, &controls, 200);
    let back = |states, h| {
        let system = System::new(bodies_of(&there), mutual());
        let mut simulation = Simulation::new(system, states, method, h).expect("a method");
        fly(&mut simulation, &controls, 200);
        simulation.states().to_vec()
    };
    [
        distance(&reversed(&back(reversed(there.states()), h)), &start),
        distance(&back(there.states().to_vec(), -h), &start),
    ]
}

#[test]
fn the_middle_chart_is_reversible_and_the_starting_one_is_not() {
    for degree in 1..=5 {
        let missed = misses(galerkin(degree, ChartOrigin::Middle));
        println!("{degree}: {missed:?}");
        assert!(missed.iter().all(|&miss| miss < 1e-10), "{missed:?}");
    }
    // Geodesics are the same from both ends, but polynomials of higher degree are not.
    assert!(
        misses(galerkin(1, ChartOrigin::Start))
            .iter()
            .all(|&miss| miss < 1e-9)
    );
    assert!(
        misses(galerkin(2, ChartOrigin::Start))
            .iter()
            .all(|&miss| miss > 1e-7)
    );
}

/// Lemmas 2.1 and 2.2: a transformed initial state has the transformed trajectory, and a boost adds uniform motion.
#[test]
fn trajectories_move_with_euclidean_motions_and_boosts() {
    let case = Case::load("a1_two_dumbbells_regular");
    let turn = exp(&Vector3::new(0.7, -1.1, 0.4));
    let shift = Vector3::new(0.3, -2.0, 1.5);
    let boost = Vector3::new(-0.2, 0.5, 0.1);
    let (h, steps) = (0.05, 40);
    for origin in ORIGINS {
        for degree in [1, 3, 6] {
            let mut plain = case.simulation(galerkin(degree, origin), h);
            let bodies = bodies_of(&plain);
            let moved = |states: &[BodyState], t: f64| -> Vec<BodyState> {
                let each = |(state, body): (&BodyState, &RigidBody)| BodyState {
                    position: turn * state.position + shift + t * boost,
                    linear_momentum: turn * state.linear_momentum + body.mass() * boost,
                    attitude: turn * state.attitude,
                    ..*state
                };
                states.iter().zip(&bodies).map(each).collect()
            };
            let system = System::new(bodies.clone(), mutual());
            let start = moved(plain.states(), 0.0);
            let mut other =
                Simulation::new(system, start, galerkin(degree, origin), h).expect("a method");
            fly(&mut plain, &[Load::default(); 2], steps);
            fly(&mut other, &[Load::default(); 2], steps);
            let apart = distance(other.states(), &moved(plain.states(), plain.time()));
            println!("{degree} {origin:?}: {apart:e}");
            assert!(apart < 1e-11, "{apart:e}");
        }
    }
}

type Tangent = SVector<f64, 12>;

/// `[x, γ, log, Π]` of a state, with the attitude relative to `base`.
fn coordinates(base: &BodyState, state: &BodyState) -> Tangent {
    let zeta = log(&(base.attitude.transpose() * state.attitude));
    let parts = [
        state.position,
        state.linear_momentum,
        zeta,
        state.angular_momentum,
    ];
    Tangent::from_iterator(parts.iter().flatten().copied())
}

fn displaced(base: &BodyState, z: &Tangent) -> BodyState {
    let part = |i: usize| Vector3::new(z[i], z[i + 1], z[i + 2]);
    BodyState {
        position: base.position + part(0),
        linear_momentum: base.linear_momentum + part(3),
        attitude: base.attitude * exp(&part(6)),
        angular_momentum: base.angular_momentum + part(9),
    }
}

/// The canonical form in variations `[δx, δγ, ζ, δΠ]`: `δx·δγ' − δγ·δx' + ζ·δΠ' − δΠ·ζ' + Π·(ζ × ζ')`.
fn symplectic_form(state: &BodyState) -> SMatrix<f64, 12, 12> {
    let identity = Matrix3::identity();
    let mut form = SMatrix::<f64, 12, 12>::zeros();
    form.fixed_view_mut::<3, 3>(0, 3).copy_from(&identity);
    form.fixed_view_mut::<3, 3>(3, 0).copy_from(&-identity);
    form.fixed_view_mut::<3, 3>(6, 9).copy_from(&identity);
    form.fixed_view_mut::<3, 3>(9, 6).copy_from(&-identity);
    let pi = hat(&state.angular_momentum);
    form.fixed_view_mut::<3, 3>(6, 6).copy_from(&-pi);
    form
}

/// Checks `DᵀωD = ω` for the derivative D of a step that is coarse enough for its error to show.
#[test]
fn a_step_is_a_symplectic_map() {
    let case = Case::load("d_dumbbell_central");
    for origin in ORIGINS {
        for degree in [1, 2, 4] {
            let method = galerkin(degree, origin);
            let template = case.simulation(method, 0.2);
            let bodies = bodies_of(&template);
            let base = template.states()[0];
            let step = |state: BodyState| {
                let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Central { gm: 1.0 })];
                let system = System::new(bodies.clone(), gravity);
                let mut simulation =
                    Simulation::new(system, vec![state], method, 0.2).expect("a method");
                fly(&mut simulation, &[Load::default()], 1);
                simulation.states()[0]
            };
            let end = step(base);
            let mut derivative = SMatrix::<f64, 12, 12>::zeros();
            for column in 0..12 {
                // Angular momenta have the magnitude of J, 4e-4 to 2e-2.
                let e = if column < 9 { 3e-4 } else { 3e-6 };
                let central = |e: f64| {
                    let at = |e: f64| {
                        let mut z = Tangent::zeros();
                        z[column] = e;
                        coordinates(&end, &step(displaced(&base, &z)))
                    };
                    (at(e) - at(-e)) / (2.0 * e)
                };
                derivative.set_column(column, &((4.0 * central(e) - central(2.0 * e)) / 3.0));
            }
            let kept = derivative.transpose() * symplectic_form(&end) * derivative;
            let violation = (kept - symplectic_form(&base)).amax();
            println!("{degree} {origin:?}: {violation:e}");
            assert!(violation < 1e-8, "{violation:e}");
        }
    }
}

/// A step is `Π_1 = FᵀΠ_0` and `R_1 = R_0 F` (§2.3).
#[test]
fn euler_poincare_reconstructs_attitudes_from_momenta_and_refuses_gravity() {
    let case = Case::load("b1_free_asymmetric");
    for origin in ORIGINS {
        for degree in 1..=5 {
            let mut simulation = case.simulation(euler_poincare(degree, origin), 0.2);
            for _ in 0..100 {
                let before = simulation.states()[0];
                fly(&mut simulation, &[Load::default()], 1);
                let after = simulation.states()[0];
                let f = before.attitude.transpose() * after.attitude;
                let carried = f.transpose() * before.angular_momentum;
                assert!((after.angular_momentum - carried).norm() < 1e-14);
            }
        }
    }
    let order = [4, 8, 16, 32]
        .map(|n| size(&case.errors_at(1.0, n, euler_poincare(3, ChartOrigin::Middle))))
        .windows(2)
        .map(|pair| (pair[0] / pair[1]).log2())
        .fold(f64::INFINITY, f64::min);
    assert!(order > 5.9, "{order}");
    let gravity = Case::load("d_dumbbell_central");
    let (system, _) = gravity.system();
    assert_eq!(
        euler_poincare(2, ChartOrigin::Middle)
            .integrator(&system)
            .err(),
        Some(MethodError::Gravity {
            method: "Euler–Poincaré"
        })
    );
}

/// A pivoted, a driven, a fixed and a free body under mutual gravity and controls.
fn company() -> (System, Vec<BodyState>) {
    let inertia = || Inertia::principal([0.2, 0.3, 0.4]).expect("inertia");
    let arm = |x: f64, y: f64, z: f64| {
        [1.0, -1.0].map(|sign| PointMass {
            mass: 0.5,
            position: sign * Vector3::new(x, y, z),
        })
    };
    let drive = Drive::circle(
        Vector3::zeros(),
        Vector3::new(0.0, 0.1, 0.8),
        Vector3::new(0.3, 0.0, 0.0),
    );
    let pendulum = [PointMass {
        mass: 1.0,
        position: Vector3::new(0.2, 0.1, -0.4),
    }];
    let bodies = vec![
        RigidBody::pivoted(1.0, inertia(), pendulum.to_vec()).expect("body"),
        RigidBody::new(1.0, inertia(), arm(0.1, 0.2, 0.3).to_vec())
            .expect("body")
            .with_mobility(Mobility::Driven(drive)),
        RigidBody::new(1.0, inertia(), arm(0.3, 0.2, 0.0).to_vec())
            .expect("body")
            .with_mobility(Mobility::Fixed),
        RigidBody::new(1.0, inertia(), arm(0.2, 0.0, 0.3).to_vec()).expect("body"),
    ];
    let states = [
        ([0.0, 0.0, 0.0], [1.0, 0.5, -0.4]),
        ([1.5, 0.0, 0.2], [0.0; 3]),
        ([-1.6, 0.5, 0.0], [0.0; 3]),
        ([0.0, 2.5, 0.0], [0.3, 1.2, -0.5]),
    ];
    let states = bodies.iter().zip(states).map(|(body, (x, omega))| {
        let velocity = Vector3::new(0.2, 0.1, 0.4);
        let attitude = exp(&Vector3::new(0.3, 0.2, 0.1));
        BodyState::from_velocities(body, x.into(), velocity, attitude, omega.into())
    });
    let states = states.collect();
    (System::new(bodies, mutual()), states)
}

#[test]
fn constrained_bodies_and_controls_keep_the_order() {
    let control = Load {
        force: Vector3::new(0.1, -0.2, 0.05),
        moment: Vector3::new(0.05, 0.02, -0.04),
    };
    let fly = |degree, origin, steps: u32| {
        let (system, states) = company();
        let h = 1.0 / f64::from(steps);
        let mut simulation =
            Simulation::new(system, states, galerkin(degree, origin), h).expect("a method");
        fly(&mut simulation, &[control; 4], steps);
        simulation
    };
    let reference = fly(6, ChartOrigin::Middle, 40);
    for origin in ORIGINS {
        for degree in [1, 2, 3] {
            let errors = [10, 20, 40, 80]
                .map(|steps| distance(fly(degree, origin, steps).states(), reference.states()));
            for pair in errors.windows(2) {
                let order = (pair[0] / pair[1]).log2();
                println!("{degree} {origin:?}: {order:.2}");
                assert!((order - f64::from(2 * degree)).abs() < 0.4, "{errors:?}");
            }
        }
    }
    let (system, mut states) = company();
    system.constrain(&mut states);
    let end = reference.states();
    assert_eq!(end[0].position, states[0].position);
    assert_eq!(end[0].linear_momentum, states[0].linear_momentum);
    assert_eq!(end[2], states[2]);
    if let Mobility::Driven(drive) = system.bodies()[1].mobility() {
        let expected = drive.advance(&system.bodies()[1], &states[1], 1.0);
        assert!(distance(&[end[1]], &[expected]) < 1e-13);
    }
}

/// Under a force and a moment along the spin axis of a sphere, the motion is a polynomial of degree 2, which the
/// methods reproduce exactly from that degree on.
#[test]
fn controls_act_as_constant_force_and_moment() {
    let inertia = Inertia::principal([2.0; 3]).expect("inertia");
    let body = RigidBody::new(4.0, inertia, vec![]).expect("body");
    let zero = Vector3::zeros();
    let state = BodyState::from_velocities(&body, zero, zero, Matrix3::identity(), zero);
    let control = Load {
        force: Vector3::new(8.0, 0.0, 0.0),
        moment: Vector3::new(0.0, 0.0, 1.0),
    };
    for method in [
        galerkin(2, ChartOrigin::Start),
        galerkin(3, ChartOrigin::Middle),
        euler_poincare(2, ChartOrigin::Middle),
    ] {
        let system = System::new(vec![body.clone()], vec![]);
        let mut simulation = Simulation::new(system, vec![state], method, 0.25).expect("a method");
        fly(&mut simulation, &[control], 4);
        let end = simulation.states()[0];
        assert!((end.position.x - 1.0).abs() < 1e-14);
        assert!((end.linear_momentum.x - 8.0).abs() < 1e-14);
        assert!((end.angular_momentum.z - 1.0).abs() < 1e-14);
        assert!((log(&end.attitude).z - 0.25).abs() < 1e-14);
    }
}

/// Steps that cover two thirds of a radian of the orbit and a larger rotation. Guesses from the last step or from
/// constant velocity do not always converge, but guesses from shorter steps do.
#[test]
fn steps_of_a_radian_are_solved() {
    let case = Case::load("d_dumbbell_central");
    for (degree, steps, bound) in [(4, 15, 1e-2), (6, 15, 1e-4), (10, 16, 1e-9)] {
        for origin in ORIGINS {
            let errors = case.errors_at(10.0, steps, galerkin(degree, origin));
            println!("{degree} {origin:?}: {:.1e}", size(&errors));
            assert!(size(&errors) < bound, "{errors:?}");
        }
    }
}

#[test]
fn a_step_that_turns_too_far_is_an_error_and_leaves_the_state() {
    let inertia = Inertia::principal([1.0, 2.0, 2.5]).expect("inertia");
    let body = RigidBody::new(1.0, inertia, vec![]).expect("body");
    let zero = Vector3::zeros();
    let omega = Vector3::new(0.0, 0.0, 1.0);
    let state = BodyState::from_velocities(&body, zero, zero, Matrix3::identity(), omega);
    for origin in ORIGINS {
        for method in [galerkin(3, origin), euler_poincare(3, origin)] {
            let simulation = |h| {
                let system = System::new(vec![body.clone()], vec![]);
                Simulation::new(system, vec![state], method, h).expect("a method")
            };
            let mut long = simulation(3.15);
            let error = long.advance(&[Load::default()]).expect_err("too far");
            assert!(
                matches!(error, StepError::TurnsTooFar { body: 0, turn } if (turn - 3.15).abs() < 1e-9),
                "{error}"
            );
            assert_eq!(long.states(), [state]);
            fly(&mut simulation(3.13), &[Load::default()], 1);
        }
    }
}

#[test]
fn steps_that_cannot_be_made_are_errors() {
    let case = Case::load("a1_two_dumbbells_regular");
    let (_, start) = case.system();
    let step = |origin, h: f64| {
        let (mut system, mut states) = case.system();
        let mut integrator = galerkin(3, origin).integrator(&system).expect("a method");
        integrator.start(&mut system, &states);
        let made = integrator.step(&mut system, &mut states, &[Load::default(); 2], h);
        (made, states)
    };
    for h in [10.0, 1e6, f64::INFINITY, f64::NAN] {
        for origin in ORIGINS {
            let (made, states) = step(origin, h);
            let error = made.expect_err("no step");
            assert!(
                matches!(
                    error,
                    StepError::TurnsTooFar { .. } | StepError::NotConverged { .. }
                ),
                "{error}"
            );
            assert_eq!(states, start);
        }
    }
    let (made, states) = step(ChartOrigin::Middle, 0.0);
    made.expect("a step of no length");
    assert!(distance(&states, &start) < 1e-15);
}

#[test]
fn parameters_out_of_range_are_refused() {
    let (system, _) = Case::load("b1_free_asymmetric").system();
    for (degree, quadrature) in [
        (0, Quadrature::Gauss(1)),
        (11, Quadrature::Gauss(11)),
        (3, Quadrature::Gauss(2)),
        (1, Quadrature::Lobatto(1)),
        (2, Quadrature::Gauss(25)),
    ] {
        let origin = ChartOrigin::Middle;
        for method in [
            Method::Galerkin {
                degree,
                quadrature,
                origin,
            },
            Method::EulerPoincare {
                degree,
                quadrature,
                origin,
            },
        ] {
            let error = method.integrator(&system).err();
            assert!(
                matches!(error, Some(MethodError::Parameter { .. })),
                "{method:?}"
            );
        }
    }
}
