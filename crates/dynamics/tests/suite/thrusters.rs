//! Bodies with thrusters, against the equations of a body of variable mass in its velocities, closed forms and limits.

use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::nalgebra::{Matrix3, Vector3};
use lgvi_dynamics::skip::Skip;
use lgvi_dynamics::thrusters::{Propellant, Thruster, Thrusters};
use lgvi_dynamics::wheels::{ReactionWheel, Wheels};
use lgvi_dynamics::{
    ActuatorStates, BodyError, BodyState, Inertia, Load, Method, MethodError, PointMass, RigidBody,
    Simulation, System,
};

use crate::actuated::{METHODS, random};

/// A body of random shape with some thrusters that use much of its mass.
struct Craft {
    mass: f64,
    inertia: Matrix3<f64>,
    propellant: Propellant,
    thrusters: Vec<Thruster>,
    commands: Vec<f64>,
    velocity: Vector3<f64>,
    rate: Vector3<f64>,
}

impl Craft {
    fn random(seed: u64) -> Self {
        let mut rng = fastrand::Rng::with_seed(seed);
        let mut shape = |scale: f64| {
            let turn = lgvi_lie::exp(&random(&mut rng, 3.0));
            let [a, b, c] = [0.3 + rng.f64(), 0.3 + rng.f64(), 0.3 + rng.f64()];
            let moments = Matrix3::from_diagonal(&Vector3::new(b + c, c + a, a + b));
            scale * (turn * moments * turn.transpose())
        };
        let (dry, wet) = (shape(1.0), shape(0.4));
        let count = 2 + rng.usize(..3);
        let thrusters: Vec<_> = (0..count)
            .map(|_| Thruster {
                exhaust_velocity: 2.0 + rng.f64(),
                ..Thruster::new(
                    random(&mut rng, 1.0),
                    random(&mut rng, 1.0),
                    0.1 + 0.2 * rng.f64(),
                )
            })
            .collect();
        Self {
            mass: 3.0,
            inertia: dry + wet,
            propellant: Propellant {
                mass: 1.0,
                inertia: Some(wet),
            },
            commands: thrusters
                .iter()
                .map(|one| one.thrust * (0.3 + 0.7 * rng.f64()))
                .collect(),
            thrusters,
            velocity: random(&mut rng, 1.0),
            rate: random(&mut rng, 0.6),
        }
    }

    fn body(&self) -> RigidBody {
        let inertia = Inertia::new(self.inertia).expect("valid");
        let thrusters = Thrusters::new(self.thrusters.clone(), self.propellant).expect("valid");
        let body = RigidBody::new(self.mass, inertia, vec![]).expect("valid");
        body.with_thrusters(thrusters).expect("valid")
    }

    fn state(&self, body: &RigidBody) -> BodyState {
        let (x, r) = (Vector3::zeros(), Matrix3::identity());
        BodyState::from_velocities(body, x, self.velocity, r, self.rate)
    }

    fn simulation(&self, method: Method, h: f64) -> Simulation {
        let body = self.body();
        let state = self.state(&body);
        Simulation::new(System::new(vec![body], vec![]), vec![state], method, h).expect("valid")
    }

    /// Position, velocity, attitude and rate after a time, by the classical Runge–Kutta method for `m v̇ = R (Σ F d − 2 ṁ Ω ×
    /// r)`, `J Ω̇ = −Ω × J Ω − J̇ Ω + Σ r × F d − ṁ r × (Ω × r)`.
    fn reference(&self, time: f64, steps: u32) -> [Vector3<f64>; 3] {
        let flow: f64 = (self.thrusters.iter().zip(&self.commands))
            .map(|(thruster, command)| command / thruster.exhaust_velocity)
            .sum();
        let per_mass = self.propellant.inertia.expect("given") / self.propellant.mass;
        let rates = |t: f64, [x, r, w]: [Matrix3<f64>; 3]| {
            // The columns of x are position, velocity, and none.
            let (m, j) = (self.mass - flow * t, self.inertia - (flow * t) * per_mass);
            let w = w.column(0).into_owned();
            let mut force = Vector3::zeros();
            let mut moment = -w.cross(&(j * w)) + flow * (per_mass * w);
            for (thruster, command) in self.thrusters.iter().zip(&self.commands) {
                let (at, d) = (thruster.position, thruster.direction.normalize());
                let used = command / thruster.exhaust_velocity;
                force += *command * d - 2.0 * used * w.cross(&at);
                moment += at.cross(&(*command * d)) - used * at.cross(&w.cross(&at));
            }
            let acceleration = r * force / m;
            let turning = j.try_inverse().expect("valid") * moment;
            let zero = Vector3::zeros();
            [
                Matrix3::from_columns(&[x.column(1).into_owned(), acceleration, zero]),
                r * w.cross_matrix(),
                Matrix3::from_columns(&[turning, zero, zero]),
            ]
        };
        let zero = Vector3::zeros();
        let mut y = [
            Matrix3::from_columns(&[zero, self.velocity, zero]),
            Matrix3::identity(),
            Matrix3::from_columns(&[self.rate, zero, zero]),
        ];
        let h = time / f64::from(steps);
        let add = |y: &[Matrix3<f64>; 3], k: &[Matrix3<f64>; 3], h: f64| {
            [0, 1, 2].map(|i| y[i] + h * k[i])
        };
        for step in 0..steps {
            let t = f64::from(step) * h;
            let a = rates(t, y);
            let b = rates(t + 0.5 * h, add(&y, &a, 0.5 * h));
            let c = rates(t + 0.5 * h, add(&y, &b, 0.5 * h));
            let d = rates(t + h, add(&y, &c, h));
            y = [0, 1, 2].map(|i| y[i] + (h / 6.0) * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
        [
            y[0].column(0).into_owned(),
            y[0].column(1).into_owned(),
            y[2].column(0).into_owned(),
        ]
    }
}

fn fly(simulation: &mut Simulation, steps: u32) {
    for _ in 0..steps {
        let loads = vec![Load::default(); simulation.states().len()];
        simulation.advance(&loads).expect("a step");
    }
}

fn found(simulation: &Simulation) -> [Vector3<f64>; 3] {
    let (state, body) = (&simulation.states()[0], &simulation.system().bodies()[0]);
    [
        state.position,
        state.velocity(body),
        state.angular_velocity(body),
    ]
}

fn left(simulation: &Simulation) -> f64 {
    ActuatorStates::of(simulation.system()).propellants[0]
}

#[test]
fn the_motion_is_that_of_a_body_of_variable_mass_at_second_order() {
    for seed in 0..4 {
        let craft = Craft::random(seed);
        let reference = craft.reference(3.0, 3000);
        for method in METHODS {
            let error = |steps: u32| {
                let mut simulation = craft.simulation(method, 3.0 / f64::from(steps));
                simulation.set_thruster_commands(0, &craft.commands);
                fly(&mut simulation, steps);
                let misses = found(&simulation).into_iter().zip(reference);
                misses.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
            };
            let [coarse, fine] = [150, 300].map(error);
            let order = (coarse / fine).log2();
            assert!(
                (order - 2.0).abs() < 0.01 && fine < 1e-5,
                "{method} on {seed}: order {order} with {fine:e}"
            );
        }
    }
}

/// `v = c ln(m₀/m)`, and nothing more when the propellant is used up.
#[test]
fn the_change_of_velocity_is_that_of_the_rocket_equation() {
    for method in METHODS {
        let craft = Craft {
            thrusters: vec![Thruster {
                exhaust_velocity: 2.5,
                ..Thruster::new(Vector3::zeros(), Vector3::x(), 0.5)
            }],
            velocity: Vector3::zeros(),
            rate: Vector3::zeros(),
            ..Craft::random(5)
        };
        // A flow of 0.2: 1.0 lasts for 5 s.
        for (steps, mass) in [(3_000, 3.0 - 0.6), (7_000, 2.0)] {
            let mut simulation = craft.simulation(method, 1e-3);
            simulation.set_thruster_commands(0, &[0.5]);
            fly(&mut simulation, steps);
            let [_, velocity, _] = found(&simulation);
            let miss = (velocity.x - 2.5 * f64::ln(3.0 / mass)).abs();
            assert!(miss < 2e-8, "{method}: {miss:e}");
            assert!((simulation.system().bodies()[0].mass() - mass).abs() < 1e-12);
            assert!((left(&simulation) - (mass - 2.0)).abs() < 1e-12);
        }
    }
}

/// Two thrusters that push against each other at `r` do nothing but eject mass: with the propellant's radius of gyration `k`,
/// the rate is `Ω₀ (J/J₀)^(r²/k² − 1)` (W. T. Thomson, *Introduction to Space Dynamics*, 1961, ch. 8).
#[test]
fn jet_damping_is_that_of_the_closed_form() {
    let wet = Matrix3::from_diagonal(&Vector3::new(0.3, 0.3, 0.5));
    let inertia = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.4));
    for radius in [0.3, 0.9_f64] {
        let at = |side: f64| Thruster {
            exhaust_velocity: 2.0,
            ..Thruster::new(
                Vector3::new(side * radius, 0.0, 0.0),
                Vector3::new(-side, 0.0, 0.0),
                0.2,
            )
        };
        let craft = Craft {
            inertia,
            propellant: Propellant {
                mass: 1.0,
                inertia: Some(wet),
            },
            thrusters: vec![at(1.0), at(-1.0)],
            velocity: Vector3::new(0.1, 0.2, 0.3),
            rate: Vector3::new(0.0, 0.0, 0.7),
            ..Craft::random(6)
        };
        let mut simulation = craft.simulation(Method::Lgvi(Rotor::Discrete), 1e-3);
        simulation.set_thruster_commands(0, &[0.2, 0.2]);
        fly(&mut simulation, 4000);
        let [_, velocity, rate] = found(&simulation);
        let j = 1.4 - 0.8 * 0.5;
        let expected = 0.7 * f64::powf(j / 1.4, radius * radius / 0.5 - 1.0);
        assert!((rate.z - expected).abs() < 1e-8, "{} {expected}", rate.z);
        assert!((velocity - craft.velocity).norm() < 1e-12, "{velocity}");
    }
}

/// Valves open for whole pulses of at least the minimum impulse, after their delay.
#[test]
fn pulses_have_their_impulse_to_rounding() {
    let mut rng = fastrand::Rng::with_seed(7);
    let h = 0.02;
    for _ in 0..50 {
        let thrust = 0.5 + rng.f64();
        let steps = 1 + rng.u32(..20);
        let period = f64::from(steps) * h;
        let minimum = 0.2 * rng.f64() * thrust * period;
        let delay = 0.5 * rng.f64();
        let craft = Craft {
            thrusters: vec![Thruster {
                pulse_period: period,
                minimum_impulse: minimum,
                delay,
                ..Thruster::new(Vector3::zeros(), Vector3::y(), thrust)
            }],
            rate: Vector3::zeros(),
            velocity: Vector3::zeros(),
            ..Craft::random(8)
        };
        let mut simulation = craft.simulation(Method::Lgvi(Rotor::Discrete), h);
        let mut expected = 0.0;
        let mut latest = 0.0;
        for _ in 0..30 {
            let asked = thrust * (1.4 * rng.f64() - 0.2);
            simulation.set_thruster_commands(0, &[asked]);
            fly(&mut simulation, steps);
            let impulse = asked.clamp(0.0, thrust) * period;
            expected += if impulse < minimum { 0.0 } else { impulse };
            let gained = simulation.states()[0].linear_momentum.y;
            assert!(gained >= latest, "{gained} after {latest}");
            latest = gained;
        }
        simulation.set_thruster_commands(0, &[0.0]);
        fly(&mut simulation, 30);
        let miss = simulation.states()[0].linear_momentum.y - expected;
        assert!(miss.abs() < 1e-12, "{miss:e} of {expected}");
        let told = ActuatorStates::of(simulation.system()).thrusters[0].impulse;
        assert!((told - expected).abs() < 1e-12, "{told} of {expected}");
    }
}

#[test]
fn a_pulse_begins_after_its_delay() {
    let craft = Craft {
        thrusters: vec![Thruster {
            pulse_period: 1.0,
            delay: 0.25,
            ..Thruster::new(Vector3::zeros(), Vector3::x(), 2.0)
        }],
        rate: Vector3::zeros(),
        velocity: Vector3::zeros(),
        ..Craft::random(9)
    };
    let mut simulation = craft.simulation(Method::Lgvi(Rotor::Discrete), 0.125);
    simulation.set_thruster_commands(0, &[0.625]);
    let thrusts: Vec<_> = (0..16)
        .map(|_| {
            fly(&mut simulation, 1);
            ActuatorStates::of(simulation.system()).thrusters[0].thrust
        })
        .collect();
    let pulse = [0.0, 0.0, 2.0, 2.0, 1.0, 0.0, 0.0, 0.0];
    assert_eq!(thrusts, [pulse, pulse].concat());
}

/// Gravity takes the present mass, in all ways in which it is computed.
#[test]
fn gravity_acts_on_the_mass_that_is_left() {
    let push = |side: f64| Thruster {
        exhaust_velocity: 2.0,
        ..Thruster::new(Vector3::zeros(), Vector3::new(side, 0.0, 0.0), 0.2)
    };
    let points = |mass: f64| {
        [-0.1, 0.1].map(|z| PointMass {
            mass: 0.5 * mass,
            position: Vector3::new(0.0, 0.0, z),
        })
    };
    for spread in [false, true] {
        let flown = |skip: Skip, fires: bool| {
            let inertia = Inertia::principal([1.0, 1.1, 0.9]).expect("valid");
            let points = if spread { points(3.0).to_vec() } else { vec![] };
            let propellant = Propellant {
                mass: 2.0,
                inertia: None,
            };
            let thrusters = Thrusters::new(vec![push(1.0), push(-1.0)], propellant).expect("valid");
            let body = RigidBody::new(3.0, inertia, points).expect("valid");
            let body = body.with_thrusters(thrusters).expect("valid");
            let (x, v) = (Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.1));
            let state =
                BodyState::from_velocities(&body, x, v, Matrix3::identity(), Vector3::zeros());
            let system = System::new(vec![body], vec![Box::new(Central { gm: 1.0 })]);
            let method = Method::Lgvi(Rotor::Discrete);
            let simulation = Simulation::new(system, vec![state], method, 1e-3).expect("valid");
            let mut simulation = simulation.with_skips(skip);
            let thrust = if fires { 0.2 } else { 0.0 };
            simulation.set_thruster_commands(0, &[thrust; 2]);
            fly(&mut simulation, 6000);
            found(&simulation)
        };
        // The gas of a body that is spread out takes no angular momentum, so that the attitude changes.
        let expected = flown(Skip::Nothing, spread);
        for skip in [Skip::Nothing, Skip::Exact] {
            let [x, v, _] = flown(skip, true);
            let miss = (x - expected[0]).norm() + (v - expected[1]).norm();
            assert!(miss < 1e-11, "{skip:?}: {miss:e}");
        }
    }
}

/// Wheels and thrusters act together: the sum of the momenta changes by the impulse of the thrusters alone.
#[test]
fn wheels_and_thrusters_act_at_once() {
    let craft = Craft::random(10);
    let mut rng = fastrand::Rng::with_seed(10);
    let wheels = [Vector3::x(), Vector3::new(0.3, 1.0, -0.2)];
    let wheels = wheels.map(|axis| ReactionWheel::new(axis, 0.01));
    let body = craft.body();
    let body = body.with_wheels(Wheels::new(wheels.to_vec()).expect("valid"));
    let body = body.expect("valid");
    let massless = Propellant {
        mass: 0.0,
        inertia: None,
    };
    let thrusters = craft.thrusters.iter().map(|one| Thruster {
        exhaust_velocity: f64::INFINITY,
        ..*one
    });
    let body = body.with_thrusters(Thrusters::new(thrusters.collect(), massless).expect("valid"));
    let body = body.expect("valid");
    let state = craft.state(&body);
    let system = System::new(vec![body], vec![]);
    let method = Method::Lgvi(Rotor::Discrete);
    let mut simulation = Simulation::new(system, vec![state], method, 0.01).expect("valid");
    let mut expected = simulation.invariants();
    let impulse = |simulation: &Simulation, at: &BodyState| {
        let mut change = (Vector3::zeros(), Vector3::zeros());
        let states = ActuatorStates::of(simulation.system()).thrusters;
        for (thruster, state) in craft.thrusters.iter().zip(states) {
            let force = state.thrust * thruster.direction.normalize();
            change.0 += 0.005 * (at.attitude * force);
            change.1 += 0.005 * (at.attitude * thruster.position.cross(&force));
        }
        (change.0, change.1 + at.position.cross(&change.0))
    };
    for _ in 0..500 {
        let commands: Vec<_> = craft.thrusters.iter().map(|_| 0.2 * rng.f64()).collect();
        simulation.set_thruster_commands(0, &commands);
        simulation.set_wheel_commands(0, &[0.1 * rng.f64(), -0.1 * rng.f64()]);
        let begin = simulation.states()[0];
        fly(&mut simulation, 1);
        for at in [begin, simulation.states()[0]] {
            let (linear, angular) = impulse(&simulation, &at);
            expected.linear_momentum += linear;
            expected.angular_momentum += angular;
        }
    }
    let after = simulation.invariants();
    let miss = (after.linear_momentum - expected.linear_momentum).norm();
    assert!(miss < 1e-12, "{miss:e}");
    let miss = (after.angular_momentum - expected.angular_momentum).norm();
    assert!(miss < 1e-11, "{miss:e}");
}

#[test]
fn the_change_of_velocity_is_told() {
    let craft = Craft::random(11);
    let mut simulation = craft.simulation(Method::Lgvi(Rotor::Exact), 0.01);
    simulation.set_thruster_commands(0, &craft.commands);
    for _ in 0..20 {
        let [_, before, _] = found(&simulation);
        fly(&mut simulation, 1);
        let [_, after, _] = found(&simulation);
        let body = &simulation.system().bodies()[0];
        let told = body.thrusters().expect("some").velocity_change();
        assert!((after - before - told).norm() < 1e-15, "{told}");
    }
}

#[test]
fn a_failed_step_leaves_body_and_thrusters_as_they_were() {
    let craft = Craft::random(12);
    let mut simulation = craft.simulation(Method::Lgvi(Rotor::Discrete), 10.0);
    simulation.set_thruster_commands(0, &craft.commands);
    let before = (
        simulation.system().bodies().to_vec(),
        simulation.states().to_vec(),
    );
    simulation.advance(&[Load::default()]).unwrap_err();
    let after = (
        simulation.system().bodies().to_vec(),
        simulation.states().to_vec(),
    );
    assert_eq!(after, before);
}

#[test]
fn methods_without_thrusters_say_so() {
    let craft = Craft::random(13);
    let body = craft.body();
    let state = craft.state(&body);
    let method = Method::Taylor { tolerance: 1e-12 };
    let system = System::new(vec![body], vec![]);
    let refused = Simulation::new(system, vec![state], method, 0.1).err();
    assert_eq!(refused, Some(MethodError::Actuators { method, body: 0 }));
}

#[test]
fn thrusters_are_checked() {
    let none = Propellant {
        mass: 0.0,
        inertia: None,
    };
    let good = Thruster::new(Vector3::zeros(), Vector3::x(), 1.0);
    let refused = |thruster| {
        Thrusters::new(vec![thruster], none)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        refused(Thruster {
            direction: Vector3::zeros(),
            ..good
        }),
        "the direction of thruster 0 is [0.0, 0.0, 0.0], expected three finite numbers that are not all 0"
    );
    assert_eq!(
        refused(Thruster {
            thrust: 0.0,
            ..good
        }),
        "the thrust of thruster 0 is 0, expected a finite number > 0"
    );
    assert_eq!(
        refused(Thruster {
            delay: f64::NAN,
            ..good
        }),
        "the delay of thruster 0 is NaN, expected a finite number ≥ 0"
    );
    let heavy = Propellant { mass: 2.0, ..none };
    let body = RigidBody::new(2.0, Inertia::principal([1.0; 3]).unwrap(), vec![]).unwrap();
    let thrusters = Thrusters::new(vec![good], heavy).unwrap();
    assert_eq!(
        body.clone().with_thrusters(thrusters),
        Err(BodyError::Propellant {
            propellant: 2.0,
            mass: 2.0
        })
    );
    let wide = Propellant {
        mass: 1.0,
        inertia: Some(Matrix3::identity()),
    };
    let thrusters = Thrusters::new(vec![good], wide).unwrap();
    assert!(matches!(
        body.with_thrusters(thrusters),
        Err(BodyError::Inertia(_))
    ));
}
