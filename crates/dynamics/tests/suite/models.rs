//! Every gravity model with methods of every kind: order, conserved quantities, and agreement with a method with error
//! control.

use lgvi_dynamics::gravity::{
    Central, Fixed, Gravity, Moments, Multipole, Mutual, Polyhedron, Uniform,
};
use lgvi_dynamics::integrator::{ChartOrigin, Quadrature, Rotor};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, PointMass, RigidBody, Simulation, System};
use nalgebra::Vector3;

/// Bodies under a gravity model. `isolated` is true if their total momenta are conserved.
struct Scene {
    name: &'static str,
    make: fn() -> (System, Vec<BodyState>),
    isolated: bool,
}

const SCENES: [Scene; 7] = [
    Scene {
        name: "dumbbell round an oblate planet",
        make: || {
            alone(
                dumbbell(),
                Fixed::new(Multipole::oblate(1.0, 0.02, 0.5), place(), turned()),
            )
        },
        isolated: false,
    },
    Scene {
        name: "multipole round a point",
        make: || alone(quadrupole(), Central { gm: 1.0 }),
        isolated: false,
    },
    Scene {
        name: "heavy top in a uniform field",
        make: || {
            alone(
                top(),
                Uniform {
                    acceleration: Vector3::new(0.1, -0.2, 0.3),
                },
            )
        },
        isolated: false,
    },
    Scene {
        name: "multipoles of fourth order",
        make: || together(ellipsoid([0.3, 0.2, 0.15]), ellipsoid([0.2, 0.25, 0.1])),
        isolated: true,
    },
    Scene {
        name: "multipole and dumbbell",
        make: || together(quadrupole(), dumbbell()),
        isolated: true,
    },
    Scene {
        name: "polyhedron and dumbbell",
        make: || together(cuboid([0.3, 0.2, 0.15]), dumbbell()),
        isolated: true,
    },
    Scene {
        name: "polyhedra",
        make: || together(cuboid([0.3, 0.2, 0.15]), cuboid([0.2, 0.15, 0.1])),
        isolated: true,
    },
];

fn place() -> Vector3<f64> {
    Vector3::new(0.05, -0.03, 0.02)
}

fn turned() -> nalgebra::Matrix3<f64> {
    lgvi_lie::exp(&Vector3::new(0.3, -0.2, 0.5))
}

fn inertia() -> Inertia {
    Inertia::principal([0.02, 0.05, 0.06]).expect("inertia")
}

fn dumbbell() -> RigidBody {
    let point = |x: f64| PointMass {
        mass: 0.5,
        position: Vector3::new(x, 0.0, 0.0),
    };
    RigidBody::new(1.0, inertia(), vec![point(0.2), point(-0.2)]).expect("body")
}

fn top() -> RigidBody {
    let point = PointMass {
        mass: 1.0,
        position: Vector3::new(0.05, 0.0, 0.3),
    };
    RigidBody::pivoted(1.0, inertia(), vec![point]).expect("body")
}

fn quadrupole() -> RigidBody {
    let multipole = Multipole::of_inertia(1.0, &inertia());
    RigidBody::with_multipole(inertia(), multipole).expect("body")
}

fn ellipsoid(axes: [f64; 3]) -> RigidBody {
    let multipole = Multipole::of_moments(1.0, &Moments::of_ellipsoid(1.0, axes));
    RigidBody::with_multipole(inertia(), multipole).expect("body")
}

fn cuboid(axes: [f64; 3]) -> RigidBody {
    let volume = 8.0 * axes[0] * axes[1] * axes[2];
    let polyhedron = Polyhedron::cuboid(axes, 1.0 / volume).expect("polyhedron");
    RigidBody::with_polyhedron(None, &polyhedron, 2).expect("body")
}

fn state(body: &RigidBody, x: [f64; 3], v: [f64; 3], omega: [f64; 3]) -> BodyState {
    BodyState::from_velocities(body, x.into(), v.into(), turned(), omega.into())
}

fn alone(body: RigidBody, source: impl Gravity + 'static) -> (System, Vec<BodyState>) {
    let state = state(&body, [1.0, 0.0, 0.2], [0.0, 0.9, 0.1], [0.6, -0.4, 0.9]);
    (System::new(vec![body], vec![Box::new(source)]), vec![state])
}

fn together(one: RigidBody, other: RigidBody) -> (System, Vec<BodyState>) {
    let states = vec![
        state(&one, [0.6, 0.0, 0.1], [0.0, 0.6, 0.1], [0.6, -0.4, 0.9]),
        state(
            &other,
            [-0.6, 0.1, 0.0],
            [0.0, -0.6, -0.1],
            [-0.3, 0.8, 0.5],
        ),
    ];
    let gravity: Vec<Box<dyn Gravity>> = vec![Box::new(Mutual::new(1.0))];
    (System::new(vec![one, other], gravity), states)
}

const T: f64 = 1.0;

fn fly(scene: &Scene, method: Method, steps: u32) -> Simulation {
    let (system, states) = (scene.make)();
    let h = T / f64::from(steps);
    let mut simulation = Simulation::new(system, states, method, h).expect("a method");
    let controls = vec![Load::default(); simulation.states().len()];
    for _ in 0..steps {
        simulation.advance(&controls).expect("a step");
    }
    simulation
}

fn distance(one: &[BodyState], other: &[BodyState]) -> f64 {
    let each = |(a, b): (&BodyState, &BodyState)| {
        let pose = (a.position - b.position)
            .norm()
            .max((a.attitude - b.attitude).norm());
        pose.max((a.angular_momentum - b.angular_momentum).norm())
    };
    one.iter().zip(other).map(each).fold(0.0, f64::max)
}

const NYSTROM_8: Method = Method::Nystrom { order: 8 };

#[test]
fn methods_of_every_kind_have_their_order_under_every_model() {
    let fixed = [
        (Method::Lgvi(Rotor::Discrete), 2.0, 40),
        (Method::ImplicitMidpoint, 2.0, 40),
        (Method::Nystrom { order: 4 }, 4.0, 9),
        (
            Method::Composition {
                order: 4,
                rotor: Rotor::Discrete,
            },
            4.0,
            8,
        ),
        (
            Method::Galerkin {
                degree: 2,
                quadrature: Quadrature::Gauss(2),
                origin: ChartOrigin::Middle,
            },
            4.0,
            8,
        ),
        (Method::RungeKutta4, 4.0, 40),
    ];
    for scene in &SCENES {
        let fine = fly(scene, NYSTROM_8, 60);
        let finer = fly(scene, NYSTROM_8, 90);
        let own = distance(fine.states(), finer.states());
        assert!(own < 1e-12, "{}: {own:e}", scene.name);
        for (method, order, steps) in fixed {
            let errors = [1, 2, 4, 8]
                .map(|finer| distance(fly(scene, method, steps * finer).states(), fine.states()));
            let slope = (errors[0] / errors[3]).log2() / 3.0;
            println!(
                "{}, {method}: order {slope:.2}, {:.0e}",
                scene.name, errors[3]
            );
            assert!(
                (slope - order).abs() < 0.3,
                "{}, {method}: {errors:?}",
                scene.name
            );
        }
        let adaptive = Method::DormandPrince853 { tolerance: 1e-10 };
        let error = distance(fly(scene, adaptive, 1).states(), fine.states());
        assert!(error < 1e-8, "{}: {error:e}", scene.name);
    }
}

#[test]
fn bodies_among_themselves_keep_their_momenta_under_every_model() {
    for scene in SCENES.iter().filter(|scene| scene.isolated) {
        let (system, states) = (scene.make)();
        let method = Method::Nystrom { order: 4 };
        let start = lgvi_dynamics::Invariants::of(&system, &states);
        let end = fly(scene, method, 100).invariants();
        let linear = (end.linear_momentum - start.linear_momentum).norm();
        let angular = (end.angular_momentum - start.angular_momentum).norm();
        let energy = (end.energy - start.energy).abs();
        println!(
            "{}: {linear:.0e}, {angular:.0e}, energy {energy:.0e}",
            scene.name
        );
        assert!(
            linear < 1e-14 && angular < 1e-14,
            "{}: {linear:e}, {angular:e}",
            scene.name
        );
        assert!(energy < 1e-7, "{}: {energy:e}", scene.name);
    }
}
