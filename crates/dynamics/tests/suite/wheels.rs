//! Bodies with reaction wheels, against Hughes' equations in the wheels' speeds, closed forms and conservation laws.

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use lgvi_dynamics::{
    BodyState, Inertia, Load, Method, MethodError, PointMass, RigidBody, Simulation, System,
};

use crate::actuated::{METHODS, random};

/// A body of random shape with three or four skew wheels, and its inertia with locked wheels.
struct Craft {
    locked: Matrix3<f64>,
    wheels: Vec<ReactionWheel>,
    speeds: Vec<f64>,
    rate: Vector3<f64>,
}

impl Craft {
    fn random(seed: u64) -> Self {
        let mut rng = fastrand::Rng::with_seed(seed);
        let turn = lgvi_lie::exp(&random(&mut rng, 3.0));
        let [a, b, c] = [0.3 + rng.f64(), 0.3 + rng.f64(), 0.3 + rng.f64()];
        let moments = Matrix3::from_diagonal(&Vector3::new(b + c, c + a, a + b));
        let count = 3 + rng.usize(..2);
        let wheels = (0..count)
            .map(|_| ReactionWheel::new(random(&mut rng, 1.0), 0.002 + 0.004 * rng.f64()));
        Self {
            locked: turn * moments * turn.transpose(),
            wheels: wheels.collect(),
            speeds: (0..count).map(|_| 200.0 * (rng.f64() - 0.5)).collect(),
            rate: random(&mut rng, 0.4),
        }
    }

    fn wheels(&self) -> Wheels {
        let mut wheels = Wheels::new(self.wheels.clone()).expect("valid");
        wheels.set_speeds(&self.speeds, &self.rate);
        wheels
    }

    fn body(&self, points: Vec<PointMass>) -> RigidBody {
        let body =
            RigidBody::new(2.0, Inertia::new(self.locked).expect("valid"), points).expect("valid");
        body.with_wheels(self.wheels()).expect("valid")
    }

    fn simulation(&self, method: Method, h: f64) -> Simulation {
        let body = self.body(vec![]);
        let state = self.state(&body, Vector3::zeros(), Vector3::zeros());
        Simulation::new(System::new(vec![body], vec![]), vec![state], method, h).expect("valid")
    }

    fn state(&self, body: &RigidBody, x: Vector3<f64>, v: Vector3<f64>) -> BodyState {
        BodyState::from_velocities(body, x, v, Matrix3::identity(), self.rate)
    }

    /// Angular velocity, attitude and speeds of the wheels after a time, from Hughes' equations in these unknowns,
    /// integrated by the classical Runge–Kutta method: `J Ω̇ + Σ I a ω̇ = −Ω × (J Ω + Σ I a ω)`, `I (ω̇ + a·Ω̇) = u`, with the
    /// inertia `J` of locked wheels.
    fn hughes(
        &self,
        torques: &[f64],
        t: f64,
        steps: u32,
    ) -> (Vector3<f64>, Matrix3<f64>, Vec<f64>) {
        let count = self.wheels.len();
        let axes: Vec<_> = self
            .wheels
            .iter()
            .map(|wheel| wheel.axis.normalize())
            .collect();
        let mut mass = DMatrix::zeros(3 + count, 3 + count);
        mass.view_mut((0, 0), (3, 3)).copy_from(&self.locked);
        for (k, (wheel, axis)) in self.wheels.iter().zip(&axes).enumerate() {
            mass.view_mut((0, 3 + k), (3, 1))
                .copy_from(&(wheel.inertia * axis));
            mass.view_mut((3 + k, 0), (1, 3))
                .copy_from(&(wheel.inertia * axis.transpose()));
            mass[(3 + k, 3 + k)] = wheel.inertia;
        }
        let solver = mass.lu();
        let rates = |y: &DVector<f64>| {
            let rate = Vector3::new(y[0], y[1], y[2]);
            let mut momentum = self.locked * rate;
            for (k, (wheel, axis)) in self.wheels.iter().zip(&axes).enumerate() {
                momentum += wheel.inertia * y[3 + k] * axis;
            }
            let mut right = DVector::zeros(3 + count);
            right.rows_mut(0, 3).copy_from(&-rate.cross(&momentum));
            right.rows_mut(3, count).copy_from_slice(torques);
            let accelerations = solver.solve(&right).expect("valid");
            let r = Matrix3::from_column_slice(&y.as_slice()[3 + count..]);
            let turning = r * rate.cross_matrix();
            let mut all = DVector::zeros(y.len());
            all.rows_mut(0, 3 + count).copy_from(&accelerations);
            all.as_mut_slice()[3 + count..].copy_from_slice(turning.as_slice());
            all
        };
        let mut y = DVector::zeros(12 + count);
        y.rows_mut(0, 3).copy_from(&self.rate);
        y.rows_mut(3, count).copy_from_slice(&self.speeds);
        y.as_mut_slice()[3 + count..].copy_from_slice(Matrix3::<f64>::identity().as_slice());
        let h = t / f64::from(steps);
        for _ in 0..steps {
            let k1 = rates(&y);
            let k2 = rates(&(&y + 0.5 * h * &k1));
            let k3 = rates(&(&y + 0.5 * h * &k2));
            let k4 = rates(&(&y + h * &k3));
            y += (h / 6.0) * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        }
        (
            Vector3::new(y[0], y[1], y[2]),
            Matrix3::from_column_slice(&y.as_slice()[3 + count..]),
            y.rows(3, count).iter().copied().collect(),
        )
    }
}

fn fly(simulation: &mut Simulation, steps: u32) {
    for _ in 0..steps {
        simulation.advance(&[Load::default()]).expect("valid");
    }
}

/// Angular velocity, attitude and speeds of the wheels.
fn found(simulation: &Simulation) -> (Vector3<f64>, Matrix3<f64>, Vec<f64>) {
    let (body, state) = (&simulation.system().bodies()[0], &simulation.states()[0]);
    let rate = state.angular_velocity(body);
    let wheels = body.wheels().expect("valid");
    let speeds = (0..wheels.wheels().len()).map(|k| wheels.speed(k, &rate));
    (rate, state.attitude, speeds.collect())
}

/// The error against Hughes' equations after 2 units of time in so many steps.
fn error(craft: &Craft, method: Method, torques: &[f64], steps: u32) -> f64 {
    let (rate, attitude, speeds) = craft.hughes(torques, 2.0, 4000);
    let mut simulation = craft.simulation(method, 2.0 / f64::from(steps));
    simulation.set_wheel_commands(0, torques);
    fly(&mut simulation, steps);
    let (found_rate, found_attitude, found_speeds) = found(&simulation);
    let speed_error = speeds.iter().zip(&found_speeds).map(|(a, b)| (a - b).abs());
    (found_rate - rate).norm()
        + (found_attitude - attitude).norm()
        + speed_error.fold(0.0, f64::max) / 100.0
}

#[test]
fn coasting_wheels_follow_hughes_equations_at_the_order_of_the_method() {
    for seed in 0..6 {
        let craft = Craft::random(seed);
        let none = vec![0.0; craft.wheels.len()];
        for method in METHODS {
            let exact = matches!(method.rotor(), Some(Rotor::Exact)) || method.has_error_control();
            if exact {
                let error = error(&craft, method, &none, 50);
                assert!(error < 2e-10, "{method} on {seed}: {error:e}");
                continue;
            }
            let order = method.order().unwrap();
            let steps = if order > 2 { 60 } else { 100 };
            let [coarse, fine] =
                [steps, 2 * steps].map(|steps| error(&craft, method, &none, steps));
            let found = (coarse / fine).log2();
            assert!(
                (found - f64::from(order)).abs() < 0.35,
                "{method} on {seed}: {found}"
            );
        }
    }
}

/// What Basilisk 2.12.1 finds for 20 s of constant torques, in steps of 1 ms, which differs by 2e-12 from twice the step
/// (`tests/references/basilisk_wheels.py`): modified Rodrigues parameters, angular velocity, speeds.
const BASILISK: [[f64; 3]; 3] = [
    [-0.5190023645122879, 0.4806414642526207, -0.5124080277871532],
    [
        -0.24406207681097633,
        0.18163806396967966,
        -0.2548761901148149,
    ],
    [220.26370975054107, -140.19601418788162, 240.39715355942093],
];

#[test]
fn a_body_with_driven_wheels_moves_as_in_basilisk() {
    let wheels = [
        (Vector3::new(1.0, 0.2, 0.1), 0.004),
        (Vector3::new(-0.1, 1.0, 0.3), 0.006),
        (Vector3::new(0.2, -0.3, 1.0), 0.005),
    ];
    let craft = Craft {
        locked: Matrix3::new(1.2, 0.1, -0.05, 0.1, 1.5, 0.08, -0.05, 0.08, 0.9),
        wheels: wheels
            .map(|(axis, inertia)| ReactionWheel::new(axis, inertia))
            .to_vec(),
        speeds: vec![120.0, -90.0, 200.0],
        rate: Vector3::new(0.05, -0.08, 0.03),
    };
    let [mrp, rate, speeds] = BASILISK.map(Vector3::from);
    let quaternion = lgvi_lie::Quaternion {
        w: 1.0 - mrp.norm_squared(),
        u: 2.0 * mrp,
    };
    for method in [
        Method::Lgvi(Rotor::Discrete),
        Method::Composition {
            order: 4,
            rotor: Rotor::Exact,
        },
    ] {
        let end = |steps: u32| {
            let mut simulation = craft.simulation(method, 20.0 / f64::from(steps));
            simulation.set_wheel_commands(0, &[0.02, -0.015, 0.01]);
            fly(&mut simulation, steps);
            found(&simulation)
        };
        let [coarse, fine] = [2000, 4000].map(end);
        // Second order in the step while torques act.
        let attitude = (4.0 * fine.1 - coarse.1) / 3.0;
        let miss = (attitude - quaternion.matrix()).norm();
        assert!(miss < 1e-8, "{method}: {miss:e}");
        let miss = ((4.0 * fine.0 - coarse.0) / 3.0 - rate).norm();
        assert!(miss < 1e-8, "{method}: {miss:e}");
        for (k, speed) in speeds.iter().enumerate() {
            let miss = ((4.0 * fine.2[k] - coarse.2[k]) / 3.0 - speed).abs();
            assert!(miss < 1e-7, "{method}: {miss:e}");
        }
        let miss = (fine.1 - quaternion.matrix()).norm();
        assert!(miss < 1e-4, "{method}: {miss:e}");
    }
}

#[test]
fn torques_act_at_second_order() {
    for seed in 10..14 {
        let craft = Craft::random(seed);
        let torques: Vec<_> = (0..craft.wheels.len())
            .map(|k| 0.05 - 0.03 * k as f64)
            .collect();
        for method in METHODS {
            let [coarse, fine] = [100, 200].map(|steps| error(&craft, method, &torques, steps));
            let found = (coarse / fine).log2();
            assert!(
                (found - 2.0).abs() < 0.3,
                "{method} on {seed}: {found} from {coarse:e}"
            );
        }
    }
}

#[test]
fn the_momentum_of_body_and_wheels_is_kept_to_rounding() {
    for seed in 20..24 {
        let craft = Craft::random(seed);
        for method in METHODS
            .into_iter()
            .filter(|method| method.rotor().is_some())
        {
            let mut simulation = craft.simulation(method, 0.02);
            let before = simulation.invariants().angular_momentum;
            let mut rng = fastrand::Rng::with_seed(seed);
            for _ in 0..2000 {
                let torques: Vec<_> = craft
                    .wheels
                    .iter()
                    .map(|_| 0.1 * (rng.f64() - 0.5))
                    .collect();
                simulation.set_wheel_commands(0, &torques);
                fly(&mut simulation, 1);
            }
            let after = simulation.invariants().angular_momentum;
            let change = (after - before).norm() / before.norm();
            assert!(change < 3e-13, "{method} on {seed}: {change:e}");
        }
    }
}

/// In free rotation the energy errs by `O(h²)` for ever; it does not drift.
#[test]
fn the_energy_of_coasting_wheels_stays_bounded() {
    for seed in 30..34 {
        let craft = Craft::random(seed);
        let range = |steps: u32| {
            let mut simulation = craft.simulation(Method::Lgvi(Rotor::Discrete), 0.02);
            let start = simulation.invariants().energy;
            let mut most = 0.0_f64;
            for _ in 0..steps {
                fly(&mut simulation, 1);
                most = most.max((simulation.invariants().energy - start).abs());
            }
            most / start
        };
        let [short, long] = [range(2000), range(40_000)];
        assert!(
            short < 1e-3 && long < 1.2 * short + 1e-12,
            "{short:e} {long:e}"
        );
    }
}

/// An axisymmetric body with a wheel on its axis has a uniform precession: `Ω₁ + i Ω₂` turns at `((J₃ − J₁) Ω₃ + h)/J₁`, where
/// `J` is the inertia without the wheel's about its axis.
#[test]
fn the_precession_of_a_dual_spin_body_is_that_of_the_closed_form() {
    let wheel = ReactionWheel::new(Vector3::z(), 0.01);
    let locked = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.5));
    let craft = Craft {
        locked,
        wheels: vec![wheel],
        speeds: vec![120.0],
        rate: Vector3::new(0.1, -0.05, 0.2),
    };
    let t = 30.0;
    for method in METHODS {
        let mut simulation = craft.simulation(method, 0.01);
        fly(&mut simulation, 3000);
        let h = 0.01 * (120.0 + 0.2);
        let turn: f64 = t * ((1.49 - 1.0) * 0.2 + h) / 1.0;
        let (sin, cos) = turn.sin_cos();
        let (x, y) = (craft.rate.x, craft.rate.y);
        let expected = Vector3::new(cos * x - sin * y, sin * x + cos * y, 0.2);
        let error = (found(&simulation).0 - expected).norm();
        let limit = match method.order() {
            Some(2) => 1e-3,
            Some(4) => 1e-6,
            _ if method.has_error_control() => 1e-11,
            _ => 1e-12,
        };
        assert!(error < limit, "{method}: {error:e}");
    }
}

#[test]
fn reversed_momenta_lead_back() {
    let craft = Craft::random(40);
    for method in METHODS
        .into_iter()
        .filter(|method| method.rotor().is_some())
    {
        let mut simulation = craft.simulation(method, 0.02);
        fly(&mut simulation, 500);
        let body = simulation.system().bodies()[0].clone();
        let mut state = simulation.states()[0];
        let (rate, _, speeds) = found(&simulation);
        state.angular_momentum = -state.angular_momentum;
        let mut wheels = body.wheels().unwrap().clone();
        let speeds: Vec<_> = speeds.iter().map(|speed| -speed).collect();
        wheels.set_speeds(&speeds, &-rate);
        let locked = RigidBody::new(2.0, Inertia::new(craft.locked).unwrap(), vec![]).unwrap();
        let body = locked.with_wheels(wheels).unwrap();
        let mut back =
            Simulation::new(System::new(vec![body], vec![]), vec![state], method, 0.02).unwrap();
        fly(&mut back, 500);
        let miss = (back.states()[0].attitude - Matrix3::identity()).norm();
        assert!(miss < 1e-12, "{method}: {miss:e}");
    }
}

/// On a heavy body a wheel slows down exponentially by viscous friction, linearly by Coulomb friction, and then rests.
#[test]
fn friction_stops_a_wheel_as_the_closed_forms_say() {
    let with = |wheel: ReactionWheel, t: f64, h: f64| {
        let craft = Craft {
            locked: Matrix3::from_diagonal(&Vector3::new(1e9, 1e9, 1e9)),
            wheels: vec![wheel],
            speeds: vec![50.0],
            rate: Vector3::zeros(),
        };
        let mut simulation = craft.simulation(Method::Lgvi(Rotor::Discrete), h);
        fly(&mut simulation, (t / h).round() as u32);
        found(&simulation).2[0]
    };
    let wheel = ReactionWheel::new(Vector3::x(), 0.01);
    let viscous = ReactionWheel {
        viscous_friction: 2e-3,
        ..wheel
    };
    let expected = 50.0 * (-0.2_f64 * 5.0).exp();
    assert!((with(viscous, 5.0, 0.01) - expected).abs() < 1e-5);
    let coulomb = ReactionWheel {
        coulomb_friction: 0.05,
        ..wheel
    };
    assert!((with(coulomb, 5.0, 0.01) - 25.0).abs() < 1e-6);
    assert!(with(coulomb, 20.0, 0.01).abs() < 1e-6);
    assert!(with(coulomb, 20.0, 0.37).abs() < 1e-6);
}

#[test]
fn torque_and_speed_are_limited() {
    let wheel = ReactionWheel {
        max_torque: 0.1,
        max_speed: 60.0,
        ..ReactionWheel::new(Vector3::x(), 0.01)
    };
    let craft = Craft {
        locked: Matrix3::from_diagonal(&Vector3::new(1e9, 1e9, 1e9)),
        wheels: vec![wheel],
        speeds: vec![50.0],
        rate: Vector3::zeros(),
    };
    let mut simulation = craft.simulation(Method::Lgvi(Rotor::Discrete), 0.1);
    simulation.set_wheel_commands(0, &[5.0]);
    fly(&mut simulation, 1);
    assert!((found(&simulation).2[0] - 51.0).abs() < 1e-9);
    fly(&mut simulation, 20);
    assert!((found(&simulation).2[0] - 60.0).abs() < 1e-9);
    simulation.set_wheel_commands(0, &[-5.0]);
    fly(&mut simulation, 1);
    assert!((found(&simulation).2[0] - 59.0).abs() < 1e-9);
}

/// In orbit, with gravity-gradient moments: the methods converge to the same flight.
#[test]
fn methods_agree_under_gravity() {
    let craft = Craft::random(50);
    let points = [0.05, -0.05].map(|x| PointMass {
        mass: 1.0,
        position: Vector3::new(x, 0.5 * x, -x),
    });
    let fly_by = |method: Method, steps: u32| {
        let body = craft.body(points.to_vec());
        let state = craft.state(&body, Vector3::x(), Vector3::y());
        let gravity: Vec<Box<dyn lgvi_dynamics::gravity::Gravity>> =
            vec![Box::new(Central { gm: 1.0 })];
        let system = System::new(vec![body], gravity);
        let mut simulation =
            Simulation::new(system, vec![state], method, 4.0 / f64::from(steps)).unwrap();
        fly(&mut simulation, steps);
        simulation.states()[0]
    };
    let reference = fly_by(Method::DormandPrince853 { tolerance: 1e-14 }, 50);
    for (method, steps, limit) in [
        (Method::Nystrom { order: 8 }, 200, 1e-11),
        (
            Method::Composition {
                order: 10,
                rotor: Rotor::Exact,
            },
            200,
            1e-11,
        ),
        (
            Method::Composition {
                order: 6,
                rotor: Rotor::Discrete,
            },
            2000,
            1e-8,
        ),
        (Method::Lgvi(Rotor::Exact), 4000, 5e-6),
    ] {
        let state = fly_by(method, steps);
        let miss = (state.attitude - reference.attitude).norm()
            + (state.position - reference.position).norm()
            + (state.angular_momentum - reference.angular_momentum).norm();
        assert!(miss < limit, "{method}: {miss:e}");
    }
}

/// Wheels of more than half of the inertia, whose friction and limits act on the body as much as on them.
#[test]
fn heavy_wheels_with_friction_come_to_rest() {
    for (viscous_friction, coulomb_friction) in [(5.0, 0.0), (0.0, 0.5), (80.0, 0.1)] {
        let wheel = ReactionWheel {
            viscous_friction,
            coulomb_friction,
            ..ReactionWheel::new(Vector3::x(), 0.8)
        };
        let craft = Craft {
            locked: Matrix3::from_diagonal(&Vector3::new(1.0, 1.2, 1.3)),
            wheels: vec![wheel],
            speeds: vec![3.0],
            rate: Vector3::zeros(),
        };
        let mut simulation = craft.simulation(Method::Lgvi(Rotor::Discrete), 0.1);
        let mut energy = simulation.invariants().energy;
        for _ in 0..200 {
            fly(&mut simulation, 1);
            let next = simulation.invariants().energy;
            assert!(next <= energy * (1.0 + 1e-14), "{next} after {energy}");
            energy = next;
        }
        let (rate, _, speeds) = found(&simulation);
        assert!(speeds[0].abs() < 1e-6, "{speeds:?}");
        // Body and wheel turn with the momentum of the wheel.
        assert!((rate - Vector3::new(2.4, 0.0, 0.0)).norm() < 1e-6, "{rate}");
    }
}

#[test]
fn a_failed_step_leaves_body_and_wheels_as_they_were() {
    let craft = Craft::random(60);
    let mut simulation = craft.simulation(Method::Lgvi(Rotor::Discrete), 10.0);
    simulation.set_wheel_commands(0, &vec![0.3; craft.wheels.len()]);
    let before = (found(&simulation), simulation.states().to_vec());
    simulation.advance(&[Load::default()]).unwrap_err();
    assert_eq!((found(&simulation), simulation.states().to_vec()), before);
}

#[test]
fn methods_without_wheels_say_so() {
    let craft = Craft::random(70);
    let body = craft.body(vec![]);
    let state = craft.state(&body, Vector3::zeros(), Vector3::zeros());
    for method in [
        Method::LagrangianLgvi,
        Method::ClosedForm,
        Method::Taylor { tolerance: 1e-12 },
    ] {
        let system = System::new(vec![body.clone()], vec![]);
        let refused = Simulation::new(system, vec![state], method, 0.1).err();
        assert_eq!(refused, Some(MethodError::Actuators { method, body: 0 }));
    }
}

#[test]
fn wheels_are_checked() {
    let refused = |wheel: ReactionWheel| Wheels::new(vec![wheel]).unwrap_err().to_string();
    let wheel = ReactionWheel::new(Vector3::x(), 0.01);
    assert_eq!(
        refused(ReactionWheel {
            axis: Vector3::zeros(),
            ..wheel
        }),
        "the axis of wheel 0 is [0.0, 0.0, 0.0], expected three finite numbers that are not all 0"
    );
    assert_eq!(
        refused(ReactionWheel {
            inertia: -1.0,
            ..wheel
        }),
        "the inertia of wheel 0 is -1, expected 1e-100 to 1e100"
    );
    assert!(
        refused(ReactionWheel {
            max_speed: f64::NAN,
            ..wheel
        })
        .contains("NaN")
    );
    assert!(
        refused(ReactionWheel {
            coulomb_friction: -0.1,
            ..wheel
        })
        .contains("≥ 0")
    );
    let heavy = Wheels::new(vec![ReactionWheel::new(Vector3::x(), 2.0)]).unwrap();
    let body = RigidBody::new(1.0, Inertia::principal([1.0; 3]).unwrap(), vec![]).unwrap();
    assert!(body.with_wheels(heavy).is_err());
}
