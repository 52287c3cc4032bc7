//! Requirements for every integrator, on every case that it supports: order, momenta, reversibility, orthogonality of
//! attitudes, controls, and unchanged states after a failed step.

use crate::case::Case;
use lgvi_dynamics::integrator::{ChartOrigin, KeplerScheme, Quadrature, Rotor};
use lgvi_dynamics::{BodyState, Invariants, Load, Method, RigidBody, Simulation};
use nalgebra::Vector3;

/// A method and its required properties.
pub struct Promise {
    pub method: Method,
    pub order: u32,
    /// Exact conservation of linear and angular momentum, bounded energy error, and rotations without projection.
    pub geometric: bool,
    /// Reversed momenta lead back to the start.
    reversible: bool,
    /// Supports only free bodies.
    pub free: bool,
    /// Supports only bodies that attract each other or are attracted by a center.
    pub central: bool,
}

impl Promise {
    /// The requirements for a variational integrator.
    fn geometric(method: Method, order: u32) -> Self {
        Self {
            method,
            order,
            geometric: true,
            reversible: true,
            free: false,
            central: false,
        }
    }

    /// The requirements for a baseline method.
    fn plain(method: Method, order: u32) -> Self {
        Self {
            geometric: false,
            reversible: false,
            ..Self::geometric(method, order)
        }
    }

    fn fits(&self, case: &str) -> bool {
        (!self.free || is_free(case)) && (!self.central || !case.starts_with(['b', 'c']))
    }

    /// Coarse steps err by the higher of the generalized orders.
    fn at_least(&self) -> bool {
        self.central
    }

    /// The order on a case, or `None` if the method is exact. On a free body, the accuracy of a splitting is that of
    /// its rotor.
    fn order_on(&self, case: &str) -> Option<u32> {
        let rotor = match self.method {
            Method::Lgvi(rotor) | Method::LieEuler(rotor) => rotor,
            Method::Composition { rotor, .. } => rotor,
            Method::Nystrom { .. } => Rotor::Exact,
            _ => return Some(self.order),
        };
        match (rotor, self.method) {
            _ if !is_free(case) => Some(self.order),
            (Rotor::Exact, _) => None,
            (Rotor::Discrete, Method::LieEuler(_)) => Some(2),
            _ => Some(self.order),
        }
    }
}

fn is_free(case: &str) -> bool {
    case.starts_with('b')
}

pub fn promises() -> Vec<Promise> {
    let cayley = Rotor::Discrete;
    let geometric = Promise::geometric;
    let mut all = vec![
        geometric(Method::Lgvi(cayley), 2),
        geometric(Method::Lgvi(Rotor::Exact), 2),
        geometric(Method::LagrangianLgvi, 2),
        Promise {
            reversible: false,
            ..geometric(Method::LieEuler(cayley), 1)
        },
        Promise::plain(Method::ExplicitMidpoint, 2),
        Promise {
            reversible: true,
            ..Promise::plain(Method::ImplicitMidpoint, 2)
        },
        Promise::plain(Method::CrouchGrossman, 2),
        Promise::plain(Method::RungeKutta4, 4),
    ];
    for order in [4, 6, 8, 10] {
        for rotor in [cayley, Rotor::Exact] {
            all.push(geometric(Method::Composition { order, rotor }, order));
        }
    }
    for order in [4, 6, 8] {
        all.push(geometric(Method::Nystrom { order }, order));
    }
    for (scheme, order) in [
        (KeplerScheme::Leapfrog, 2),
        (KeplerScheme::Aba82, 2),
        (KeplerScheme::Aba864, 4),
        (KeplerScheme::Aba1064, 4),
    ] {
        all.push(Promise {
            central: true,
            ..geometric(Method::WisdomHolman { scheme }, order)
        });
    }
    for degree in [1, 2, 3, 4] {
        for quadrature in [Quadrature::Gauss(degree), Quadrature::Lobatto(degree + 1)] {
            let origin = ChartOrigin::Middle;
            let galerkin = Method::Galerkin {
                degree,
                quadrature,
                origin,
            };
            let euler_poincare = Method::EulerPoincare {
                degree,
                quadrature,
                origin,
            };
            all.push(geometric(galerkin, 2 * degree));
            all.push(Promise {
                free: true,
                ..geometric(euler_poincare, 2 * degree)
            });
        }
    }
    all
}

/// Cases, each with a final time before chaos and the minimum number of steps.
const CASES: [(&str, f64, u32); 7] = [
    ("a1_two_dumbbells_regular", 2.0, 6),
    ("b1_free_asymmetric", 10.0, 5),
    ("b2_dzhanibekov", 10.0, 5),
    ("c1_3d_pendulum", 2.0, 4),
    ("c3_3d_pendulum_regular_small", 2.0, 4),
    ("d_dumbbell_central", 5.0, 3),
    ("e_kw4_like", 86_400.0, 10),
];

/// Errors near or below this level are rounding errors, amplified by the divergence of the case.
const FLOOR: f64 = 1e-11;

/// Magnitudes of a case's quantities, by which errors are scaled: the largest initial values, or 1 for zero.
struct Scale {
    position: f64,
    velocity: f64,
    angular_velocity: f64,
    linear_momentum: f64,
    angular_momentum: f64,
}

impl Scale {
    fn of(case: &Case) -> Self {
        let (system, states) = case.system();
        let greatest = |size: &dyn Fn(&RigidBody, &BodyState) -> f64| {
            let sizes = system.bodies().iter().zip(&states);
            match sizes
                .map(|(body, state)| size(body, state))
                .fold(0.0, f64::max)
            {
                0.0 => 1.0,
                size => size,
            }
        };
        Self {
            position: greatest(&|_, state| state.position.norm()),
            velocity: greatest(&|body, state| state.velocity(body).norm()),
            angular_velocity: greatest(&|body, state| state.angular_velocity(body).norm()),
            linear_momentum: greatest(&|_, state| state.linear_momentum.norm()),
            angular_momentum: greatest(&|_, state| state.angular_momentum.norm()),
        }
    }

    /// Largest difference between states, in poses and momenta.
    fn distance(&self, one: &[BodyState], other: &[BodyState]) -> f64 {
        let each = |(a, b): (&BodyState, &BodyState)| {
            let linear = (a.linear_momentum - b.linear_momentum).norm();
            let angular = (a.angular_momentum - b.angular_momentum).norm();
            ((a.position - b.position).norm() / self.position)
                .max((a.attitude - b.attitude).norm())
                .max(linear / self.linear_momentum)
                .max(angular / self.angular_momentum)
        };
        one.iter().zip(other).map(each).fold(0.0, f64::max)
    }
}

/// Largest deviation from the reference, or `None` if a step cannot be made.
fn error(case: &Case, scale: &Scale, t: f64, method: Method, steps: u32) -> Option<f64> {
    let mut simulation = case.simulation(method, t / f64::from(steps));
    let controls = vec![Load::default(); simulation.states().len()];
    for _ in 0..steps {
        simulation.advance(&controls).ok()?;
    }
    let errors = case.compare(t, &simulation);
    let all = [
        errors.position / scale.position,
        errors.velocity / scale.velocity,
        errors.attitude,
        errors.angular_velocity / scale.angular_velocity,
    ];
    Some(all.into_iter().fold(0.0, f64::max))
}

/// Errors for steps that are successively shorter by √2, from the first error below a tenth to the last one above
/// rounding.
fn convergence(case: &Case, t: f64, method: Method, fewest: u32) -> Vec<f64> {
    let scale = Scale::of(case);
    let mut errors = Vec::new();
    for halves in 0..30 {
        let steps = (f64::from(fewest) * 2.0_f64.powf(0.5 * f64::from(halves))).round();
        match error(case, &scale, t, method, steps as u32) {
            Some(error) if error < FLOOR => break,
            Some(error) if error < 0.1 => errors.push(error),
            _ => {}
        }
        if errors.len() == 10 {
            break;
        }
    }
    errors
}

#[test]
fn errors_fall_with_the_order() {
    for (name, t, fewest) in CASES {
        let case = Case::load(name);
        for promise in promises().iter().filter(|promise| promise.fits(name)) {
            let method = promise.method;
            let Some(order) = promise.order_on(name) else {
                let error = error(&case, &Scale::of(&case), t, method, fewest);
                let exact = error.is_some_and(|error| error < FLOOR);
                assert!(exact, "{name}, {method}: {error:?}");
                continue;
            };
            let errors = convergence(&case, t, method, fewest);
            let slopes: Vec<_> = errors
                .windows(3)
                .map(|pair| (pair[0] / pair[2]).log2())
                .collect();
            println!("{name}, {method}: {slopes:.2?}");
            // Three halvings, or fewer for high orders, whose errors decrease from a tenth to rounding in fewer
            // halvings. `coefficients` also checks these orders.
            let least = match order {
                ..6 => 5,
                6 => 3,
                _ => 1,
            };
            assert!(slopes.len() >= least, "{name}, {method}: {errors:?}");
            let last = &slopes[slopes.len() - least..];
            let mean = last.iter().sum::<f64>() / least as f64;
            let expected = f64::from(order);
            // Coarse steps may converge faster than the order, but not slower. The finest steps show the order itself
            // if rounding permits fine steps.
            let tolerance = 0.1 * expected;
            let finest = last[least - 1];
            let fine = order > 4 || promise.at_least() || (finest - expected).abs() < tolerance;
            let of_order = mean > expected - tolerance && fine;
            assert!(of_order, "{name}, {method}: {slopes:.2?}");
        }
    }
}

fn reversed(states: &[BodyState]) -> Vec<BodyState> {
    let reverse = |state: &BodyState| BodyState {
        linear_momentum: -state.linear_momentum,
        angular_momentum: -state.angular_momentum,
        ..*state
    };
    states.iter().map(reverse).collect()
}

fn fly(mut simulation: Simulation, steps: u32) -> Simulation {
    let controls = vec![Load::default(); simulation.states().len()];
    for _ in 0..steps {
        simulation.advance(&controls).expect("a step");
    }
    simulation
}

#[test]
fn reversed_momenta_lead_back_where_promised() {
    for (name, t, fewest) in CASES {
        let case = Case::load(name);
        for promise in promises().iter().filter(|promise| promise.fits(name)) {
            let (method, steps) = (promise.method, 100 * fewest);
            let h = t / f64::from(steps);
            let there = fly(case.simulation(method, h), steps);
            let start = case.simulation(method, h).states().to_vec();
            let back = case.simulation_from(reversed(there.states()), method, h);
            let end = reversed(fly(back, steps).states());
            let missed = Scale::of(&case).distance(&end, &start);
            if promise.reversible || promise.order_on(name).is_none() {
                assert!(missed < 1e-11, "{name}, {method}: {missed:e}");
            } else if promise.geometric && !is_free(name) {
                assert!(missed > 1e-7, "{name}, {method}: {missed:e}");
            }
        }
    }
}

/// The deviation of the conserved momenta from their initial values. A pendulum conserves the angular momentum about
/// the vertical, and a body around a fixed center conserves the angular momentum.
fn momentum_error(case: &str, scale: &Scale, now: &Invariants, start: &Invariants) -> f64 {
    let angular = now.angular_momentum - start.angular_momentum;
    let linear = (now.linear_momentum - start.linear_momentum).norm() / scale.linear_momentum;
    let orbital = scale.position * scale.linear_momentum;
    let whole = angular.norm() / scale.angular_momentum.max(orbital);
    match &case[..1] {
        "c" => angular.z.abs() / scale.angular_momentum,
        "d" => whole,
        _ => whole.max(linear),
    }
}

#[test]
fn geometric_methods_keep_momenta_rotations_and_energy() {
    for (name, t, fewest) in CASES {
        let case = Case::load(name);
        let scale = Scale::of(&case);
        for promise in promises().iter().filter(|promise| promise.fits(name)) {
            let (method, steps) = (promise.method, 100 * fewest);
            let mut simulation = case.simulation(method, t / f64::from(steps));
            let start = simulation.invariants();
            let controls = vec![Load::default(); simulation.states().len()];
            let (mut energy, mut orthogonality, mut momentum) = (0.0_f64, 0.0_f64, 0.0_f64);
            for _ in 0..5 * steps {
                simulation.advance(&controls).expect("a step");
                let now = simulation.invariants();
                energy = energy.max((now.energy / start.energy - 1.0).abs());
                orthogonality = orthogonality.max(now.orthogonality_error);
                momentum = momentum.max(momentum_error(name, &scale, &now, &start));
            }
            println!(
                "{name}, {method}: energy {energy:.1e}, RᵀR {orthogonality:.1e}, momenta {momentum:.1e}"
            );
            if promise.geometric {
                assert!(orthogonality < 3e-15, "{name}, {method}: {orthogonality:e}");
                assert!(momentum < 1e-12, "{name}, {method}: {momentum:e}");
                let bound = if promise.order == 1 { 0.1 } else { 0.01 };
                assert!(energy < bound, "{name}, {method}: {energy:e}");
            }
        }
    }
}

/// All methods, with their orders and a case for each.
fn methods() -> Vec<(Method, u32, &'static str)> {
    let of = |promise: Promise| {
        let case = if promise.free {
            "b1_free_asymmetric"
        } else {
            "a1_two_dumbbells_regular"
        };
        (promise.method, promise.order, case)
    };
    let mut all: Vec<_> = promises().into_iter().map(of).collect();
    all.push((Method::ClosedForm, 2, "b1_free_asymmetric"));
    for method in ADAPTIVE {
        all.push((method, 8, "a1_two_dumbbells_regular"));
    }
    all
}

/// Methods with error control, at nearly their highest accuracy.
const ADAPTIVE: [Method; 3] = [
    Method::Fehlberg78 { tolerance: 1e-13 },
    Method::DormandPrince853 { tolerance: 1e-13 },
    Method::Taylor { tolerance: 1e-13 },
];

/// Makes 25 steps of 0.02 under controls that change from step to step.
fn controlled(case: &Case, method: Method, substeps: u32) -> Simulation {
    let mut simulation = case.simulation(method, 0.02).with_substeps(substeps);
    let mut controls = vec![Load::default(); simulation.states().len()];
    for step in 0..25 {
        for (control, phase) in controls.iter_mut().zip((step..).map(f64::from)) {
            control.force = 0.1 * Vector3::new(libm::sin(phase), 0.5, libm::cos(phase));
            control.moment = 0.01 * Vector3::new(0.3, libm::cos(phase), libm::sin(phase));
        }
        simulation.advance(&controls).expect("a step");
    }
    simulation
}

#[test]
fn controls_that_change_keep_the_order() {
    for (method, order, name) in methods() {
        let case = Case::load(name);
        let scale = Scale::of(&case);
        let reference = controlled(&case, ADAPTIVE[1], 1);
        let errors = [1, 2, 4, 8].map(|substeps| {
            let simulation = controlled(&case, method, substeps);
            scale.distance(simulation.states(), reference.states())
        });
        let above = errors.iter().take_while(|&&error| error > FLOOR).count();
        println!("{name}, {method}: {errors:?}");
        for pair in errors[..above].windows(2) {
            let found = (pair[0] / pair[1]).log2();
            assert!(
                found > 0.85 * f64::from(order),
                "{name}, {method}: {errors:?}"
            );
        }
    }
}

/// A NaN control is rejected, and the simulation continues as if it had not been given.
#[test]
fn a_step_that_fails_leaves_no_trace() {
    for (method, _, name) in methods() {
        let case = Case::load(name);
        let scale = Scale::of(&case);
        let [mut failing, mut smooth] = [0, 1].map(|_| case.simulation(method, 0.02));
        let none = vec![Load::default(); smooth.states().len()];
        let mut bad = none.clone();
        let last = bad.len() - 1;
        for step in 0..20 {
            if step % 5 == 2 {
                let before = failing.states().to_vec();
                bad[last] = Load::default();
                let vector = if step % 2 == 0 {
                    &mut bad[last].force
                } else {
                    &mut bad[last].moment
                };
                vector.x = f64::NAN;
                failing.advance(&bad).expect_err("not a number");
                assert_eq!(failing.states(), before, "{name}, {method}");
            }
            failing.advance(&none).expect("a step");
            smooth.advance(&none).expect("a step");
            let apart = scale.distance(failing.states(), smooth.states());
            assert!(apart < FLOOR, "{name}, {method}: {apart:e}");
        }
    }
}
