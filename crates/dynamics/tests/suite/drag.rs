//! Drag against orbits by an independent method (`tests/truth/drag.json`), by laws, and in every method.

use std::ops::ControlFlow;
use std::sync::Arc;

use lgvi_dynamics::auto::{Run, choose};
use lgvi_dynamics::docking::{Docking, Port};
use lgvi_dynamics::drag::{Atmosphere, Drag};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::{ChartOrigin, KeplerScheme, Quadrature, Rotor};
use lgvi_dynamics::lanes::{Unfit, fit};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, MethodError, RigidBody, Simulation, System};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

struct Case {
    gm: f64,
    body: RigidBody,
    start: BodyState,
    duration: f64,
    end: [Vector3<f64>; 2],
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| number(&value[i]))
}

fn pair(value: &Value) -> [f64; 2] {
    [0, 1].map(|i| number(&value[i]))
}

fn body(mass: f64, drag: Drag) -> RigidBody {
    let inertia = Inertia::principal([10.0, 12.0, 15.0]).expect("inertia");
    let body = RigidBody::new(mass, inertia, vec![]).expect("a body");
    body.with_drag(drag)
}

fn at(body: &RigidBody, place: Vector3<f64>, velocity: Vector3<f64>) -> BodyState {
    let rate = Vector3::new(1e-3, -2e-3, 5e-4);
    BodyState::from_velocities(body, place, velocity, Matrix3::identity(), rate)
}

impl Case {
    fn load(name: &str) -> Self {
        let text = include_str!("../../../../tests/truth/drag.json");
        let all: Value = serde_json::from_str(text).expect("references");
        let mut orbits = all["orbits"].as_array().expect("orbits").iter();
        let case = orbits.find(|case| case["name"] == name).expect(name);
        let layers = case["layers"].as_array().expect("layers").iter();
        let layers: Vec<_> = layers.map(pair).collect();
        let [radius, height, area] =
            ["radius", "scale_height", "area"].map(|key| number(&case[key]));
        let omega = vector(&case["omega"]);
        let air = Atmosphere::new(Vector3::zeros(), omega, radius, &layers, height);
        let drag = Drag::new(Arc::new(air.expect("an atmosphere")), area);
        let body = body(number(&case["mass"]), drag.expect("drag"));
        let [place, velocity] = [0, 1].map(|i| vector(&case["start"][i]));
        Self {
            gm: number(&case["gm"]),
            start: at(&body, place, velocity),
            body,
            duration: number(&case["T"]),
            end: [0, 1].map(|i| vector(&case["end"][i])),
        }
    }

    fn system(&self) -> System {
        let gravity = Central { gm: self.gm };
        System::new(vec![self.body.clone()], vec![Box::new(gravity)])
    }

    /// The error of the position after so many steps.
    fn error(&self, method: Method, steps: u32) -> f64 {
        let h = self.duration / f64::from(steps);
        let simulation = Simulation::new(self.system(), vec![self.start], method, h);
        let mut simulation = simulation.expect("a simulation");
        for _ in 0..steps {
            simulation.advance(&[Load::default()]).expect("a step");
        }
        (simulation.states()[0].position - self.end[0]).norm()
    }
}

/// The reference itself is known to 1e-6 m. Without drag the end is 69 km away.
#[test]
fn a_circular_orbit_decays_with_the_order_of_the_method() {
    let case = Case::load("circular");
    let rotor = Rotor::default();
    let four = Method::Composition { order: 4, rotor };
    let six = Method::Composition { order: 6, rotor };
    for (method, steps, order, finest) in [
        (Method::Lgvi(rotor), 6000, 2.0, 1e3),
        (four, 1000, 4.0, 0.2),
        (six, 400, 6.0, 1e-4),
        (Method::RungeKutta4, 4000, 4.0, 5e-3),
        (Method::ExplicitMidpoint, 24_000, 2.0, 2e3),
        (Method::ImplicitMidpoint, 6000, 2.0, 2e3),
        (Method::CrouchGrossman, 24_000, 2.0, 2e3),
    ] {
        let errors = [1, 2, 4].map(|factor| case.error(method, factor * steps));
        println!("{method}: {errors:?}");
        for pair in errors.windows(2) {
            let observed = (pair[0] / pair[1]).log2();
            assert!((observed - order).abs() < 0.4, "{method}: {errors:?}");
        }
        assert!(errors[2] < finest, "{method}: {errors:?}");
    }
    let precise = Method::DormandPrince853 { tolerance: 1e-14 };
    let error = case.error(precise, 100);
    println!("{precise}: {error:e}");
    assert!(error < 1e-4, "{error:e}");
}

/// The density has a kink at each altitude of the table.
#[test]
fn an_eccentric_orbit_passes_through_the_layers() {
    let case = Case::load("eccentric");
    let rotor = Rotor::default();
    for (method, steps, largest) in [
        (Method::Composition { order: 6, rotor }, 4000, 1e-3),
        (Method::DormandPrince853 { tolerance: 1e-13 }, 1000, 1.0),
    ] {
        let error = case.error(method, steps);
        println!("{method}: {error:e}");
        assert!(error < largest, "{method}: {error:e}");
    }
}

/// `da/dt = −ρ C_D A √(GM a)/m` on a circular orbit in air at rest (D. King-Hele, *Satellite Orbits in an Atmosphere*, 1987),
/// but for the square of the decay in a revolution.
#[test]
fn a_circular_orbit_in_air_at_rest_sinks_by_the_law_of_king_hele() {
    let (gm, radius) = (3.986e14, 6.4e6);
    let still = Vector3::zeros();
    let air = Atmosphere::new(still, still, radius, &[[0.0, 4e-9]], 6e4).expect("an atmosphere");
    let drag = Drag::new(Arc::new(air), 2.2).expect("drag");
    let body = body(100.0, drag);
    let place = Vector3::new(radius + 3e5, 0.0, 0.0);
    let speed = (gm / place.norm()).sqrt();
    let start = at(&body, place, Vector3::new(0.0, 0.6 * speed, 0.8 * speed));
    let density = body.drag().expect("drag").atmosphere().density(&place);
    let expected = -density * 2.2 * (gm * place.norm()).sqrt() / body.mass();
    let system = System::new(vec![body.clone()], vec![Box::new(Central { gm })]);
    let method = Method::Lgvi(Rotor::default());
    let mut simulation = Simulation::new(system, vec![start], method, 1.0).expect("a simulation");
    let axis = |state: &BodyState| {
        let energy = 0.5 * state.velocity(&body).norm_squared() - gm / state.position.norm();
        -0.5 * gm / energy
    };
    let steps = 5400;
    for _ in 0..steps {
        simulation.advance(&[Load::default()]).expect("a step");
    }
    let rate = (axis(&simulation.states()[0]) - axis(&start)) / f64::from(steps);
    let error = rate / expected - 1.0;
    println!("{rate:e} m/s for {expected:e}: {error:e}");
    assert!(error.abs() < 5e-3, "{error:e}");
}

#[test]
fn steps_backwards_undo_steps() {
    let case = Case::load("eccentric");
    for method in [
        Method::Lgvi(Rotor::Discrete),
        Method::Composition {
            order: 4,
            rotor: Rotor::Exact,
        },
    ] {
        let fly = |start: BodyState, h: f64| {
            let simulation = Simulation::new(case.system(), vec![start], method, h);
            let mut simulation = simulation.expect("a simulation");
            for _ in 0..200 {
                simulation.advance(&[Load::default()]).expect("a step");
            }
            simulation.states()[0]
        };
        let back = fly(fly(case.start, 20.0), -20.0);
        let apart = (back.position - case.start.position).norm();
        assert!(apart < 1e-5, "{method}: {apart:e}");
    }
}

#[test]
fn methods_without_drag_refuse_it() {
    let case = Case::load("circular");
    let quadrature = Quadrature::Gauss(2);
    let origin = ChartOrigin::default();
    let scheme = KeplerScheme::default();
    for method in [
        Method::LagrangianLgvi,
        Method::Nystrom { order: 6 },
        Method::WisdomHolman { scheme },
        Method::Taylor { tolerance: 1e-12 },
        Method::ClosedForm,
        Method::Galerkin {
            degree: 2,
            quadrature,
            origin,
        },
        Method::EulerPoincare {
            degree: 2,
            quadrature,
            origin,
        },
    ] {
        let refused = method.integrator(&case.system()).err();
        assert_eq!(refused, Some(MethodError::Drag { method, body: 0 }));
    }
    let lgvi = Method::Lgvi(Rotor::default());
    let unfit = fit(&case.system(), lgvi);
    assert_eq!(unfit, Err(Unfit::Drag { body: 0 }));
}

#[test]
fn the_automatic_choice_keeps_its_tolerance() {
    let case = Case::load("circular");
    let tolerance = 1e-8;
    let run = Run {
        duration: case.duration,
        steps: 500,
    };
    let goes_on = &mut |_| ControlFlow::Continue(());
    let choice = choose(&mut case.system(), &[case.start], run, tolerance, goes_on);
    let choice = choice.expect("a choice");
    let steps = 500 * choice.substeps;
    let error = case.error(choice.method, steps) / case.start.position.norm();
    println!("{} × {}: {error:e}", choice.method, choice.substeps);
    assert!(error < tolerance, "{error:e}");
    assert!(choice.method.carries_drag());
}

/// Without gravity the automatic choice would be the closed form, which has no drag.
#[test]
fn a_body_without_gravity_slows_down_in_the_automatic_choice() {
    let still = Vector3::zeros();
    let air = Atmosphere::new(still, still, 1.0, &[[0.0, 0.5]], 1e9).expect("an atmosphere");
    let body = body(2.0, Drag::new(Arc::new(air), 0.4).expect("drag"));
    let start = at(&body, Vector3::x(), 3.0 * Vector3::y());
    let mut system = System::new(vec![body.clone()], vec![]);
    let run = Run {
        duration: 10.0,
        steps: 100,
    };
    let goes_on = &mut |_| ControlFlow::Continue(());
    let choice = choose(&mut system, &[start], run, 1e-9, goes_on).expect("a choice");
    let h = 0.1 / f64::from(choice.substeps);
    let simulation = Simulation::new(system, vec![start], choice.method, h);
    let mut simulation = simulation.expect("a simulation");
    for _ in 0..100 * choice.substeps {
        simulation.advance(&[Load::default()]).expect("a step");
    }
    let slower = 1.0 + 0.5 * 0.5 * 0.4 / 2.0 * 3.0 * 10.0;
    let speed = simulation.states()[0].velocity(&body).norm();
    assert!((speed - 3.0 / slower).abs() < 1e-7, "{speed}");
}

/// Two bodies that fly side by side dock, and slow down as one with the areas of both.
#[test]
fn bodies_that_have_docked_slow_down_together() {
    let still = Vector3::zeros();
    let air = Atmosphere::new(still, still, 1.0, &[[0.0, 0.5]], 1e9).expect("an atmosphere");
    let air = Arc::new(air);
    let of = |area: f64| body(2.0, Drag::new(Arc::clone(&air), area).expect("drag"));
    let bodies = [of(0.1), of(0.3)];
    let states = [0.0, 2.0].map(|x| {
        let place = Vector3::new(1.0 + x, 0.0, 0.0);
        let velocity = 3.0 * Vector3::y();
        let upright = Matrix3::identity();
        BodyState::from_velocities(&bodies[0], place, velocity, upright, still)
    });
    let port = |body, side: f64| Port {
        body,
        position: side * Vector3::x(),
        axis: side * Vector3::x(),
    };
    let docking = Docking {
        ports: [port(0, 1.0), port(1, -1.0)],
        distance: 1e-6,
        angle: 0.1,
        speed: f64::INFINITY,
        rate: f64::INFINITY,
    };
    let (method, h) = (Method::Lgvi(Rotor::default()), 0.1);
    let simulation = move |system, states| Simulation::new(system, states, method, h);
    let apart = simulation(System::new(bodies.to_vec(), Vec::new()), states.to_vec());
    let joined = apart.expect("a simulation");
    let mut joined = joined
        .with_dockings(vec![docking], Vec::new, simulation)
        .expect("a docking");
    for _ in 0..100 {
        joined.advance(&[Load::default(); 2]).expect("a step");
    }
    assert_eq!(joined.docked().len(), 1);
    let slower = 1.0 + 0.5 * 0.5 * 0.4 / 4.0 * 3.0 * 10.0;
    for (body, state) in bodies.iter().zip(joined.states()) {
        let speed = state.velocity(body).norm();
        assert!((speed - 3.0 / slower).abs() < 1e-7, "{speed}");
    }
}
