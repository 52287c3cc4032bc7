//! Plans by an engine that uses propellant: in the flight by the propagator's steps, against IPOPT with the mass as a state
//! (`tests/truth/engine.json`), against the published transfer from Earth to Mars, and by the rocket equation.

use fastrand::Rng;
use lgvi_control::constraint::{NormLimit, Place};
use lgvi_control::shooting::{ExtremalError, ShootingError};
use lgvi_control::terminal::FinalPosition;
use lgvi_control::{
    Actuation, Chances, Constraint, Dynamics, Motion, NewtonSettings, Plan, PlanError, Start,
    Terminal, Transfer, TransferError, Uncertainty, miss, shooting, solve,
};
use lgvi_dynamics::gravity::{Attractor, Central, Uniform};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::thrusters::{Engine, Propellant, Thrusters};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use lgvi_lie::exp;
use nalgebra::{Matrix3, SVector, Vector3};

use crate::fuel::{number, references, vector};
use crate::propellant::refuses_a_free_duration;

fn planned(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

/// A body of this mass with an engine and propellant.
fn body(mass: f64, propellant: f64, engine: Engine) -> RigidBody {
    let inertia = mass * Matrix3::from_diagonal(&Vector3::new(1.0, 1.4, 1.9));
    let inertia = Inertia::new(inertia).expect("inertia");
    let propellant = Propellant {
        mass: propellant,
        inertia: None,
    };
    let thrusters = Thrusters::new(Vec::new(), propellant).and_then(|all| all.with_engine(engine));
    let body = RigidBody::new(mass, inertia, Vec::new()).expect("a body");
    body.with_thrusters(thrusters.expect("an engine"))
        .expect("a body")
}

/// What a plan costs.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cost {
    Propellant,
    Energy,
    /// The energy with weights of the components of the force.
    Weighted,
}

/// Those of `engine.py`.
const WEIGHTS: Vector3<f64> = Vector3::new(1.0, 25.0, 4.0);

#[derive(Clone)]
struct Case<F> {
    field: F,
    h: f64,
    steps: usize,
    start: BodyState,
    target: Terminal,
    motion: Motion,
}

impl<F: Attractor + Copy + 'static> Case<F> {
    fn transfer(&self, body: &RigidBody, cost: Cost) -> Result<Transfer, TransferError> {
        let engine = body.thrusters().and_then(Thrusters::engine);
        let engine = engine.expect("an engine");
        let limit = NormLimit::new(Place::Position, engine.thrust).expect("a limit");
        let limits = [Constraint::commands(limit)];
        let price = match cost {
            Cost::Propellant => Vector3::repeat(engine.exhaust_velocity.recip()),
            Cost::Energy => Vector3::repeat(1.0),
            Cost::Weighted => WEIGHTS,
        };
        let weight = Matrix3::from_diagonal(&price);
        let actuation = Actuation::full(&weight, &Matrix3::identity()).expect("an actuation");
        let actuation = match cost {
            Cost::Propellant => actuation.minimizing_fuel(&limits).expect("limits"),
            Cost::Energy | Cost::Weighted => actuation,
        };
        let transfer = Transfer::new(
            body.clone(),
            self.field,
            self.h,
            self.steps,
            self.start,
            self.target.clone(),
            actuation,
        )?;
        Ok(transfer
            .with_dynamics(Dynamics::Lgvi)
            .with_motion(self.motion)
            .with_constraints(&limits))
    }

    /// Flies a plan and checks its states and masses. Returns the body and its state at the end.
    fn flown(&self, body: &RigidBody, plan: &Plan, transfer: &Transfer) -> (RigidBody, BodyState) {
        let system = System::new(vec![body.clone()], vec![Box::new(self.field)]);
        let method = Method::Lgvi(Rotor::default());
        let mut simulation =
            Simulation::new(system, vec![plan.states[0]], method, plan.h).expect("a simulation");
        let masses = plan.masses(transfer);
        for (k, control) in plan.controls.iter().enumerate() {
            let moment = simulation.command(0, *control);
            simulation.advance(&[moment]).expect("a step");
            let apart = miss(&plan.states[k + 1], &simulation.states()[0]);
            assert!(apart.amax() < 1e-7, "step {k}: {apart:?}");
            let mass = simulation.system().bodies()[0].mass();
            let off = (mass - masses[k + 1]) / masses[0];
            assert!(off.abs() < 1e-13, "step {k}: {off:e}");
        }
        (
            simulation.system().bodies()[0].clone(),
            simulation.states()[0],
        )
    }
}

/// In units of 149.6 million km, of the mass at the start, and of the year over 2 π: E. Taheri, I. Kolmanovsky, E. Atkins,
/// *Enhanced smoothing technique for indirect optimization of minimum-fuel low-thrust trajectories*, J. Guidance, Control, and
/// Dynamics 39, 2016.
fn earth_mars(steps: usize) -> (Case<Central>, RigidBody) {
    let (length, gm): (f64, f64) = (149.6e6, 132_712_440_018.0);
    let time = (length.powi(3) / gm).sqrt();
    let speed = length / time;
    let engine = Engine {
        thrust: 0.5e-3 / 1000.0 * time * time / length,
        exhaust_velocity: 2000.0 * 9.80665e-3 / speed,
    };
    let body = body(1.0, 0.9, engine);
    let at = |place: [f64; 3], velocity: [f64; 3]| {
        let still = Vector3::zeros();
        let [place, velocity] = [
            Vector3::from(place) / length,
            Vector3::from(velocity) / speed,
        ];
        BodyState::from_velocities(&body, place, velocity, Matrix3::identity(), still)
    };
    let start = at(
        [-140_699_693.0, -51_614_428.0, 980.0],
        [9.774596, -28.07828, 4.337725e-4],
    );
    let end = at(
        [-172_682_023.0, 176_959_469.0, 7_948_912.0],
        [-16.427384, -14.860506, 9.21486e-2],
    );
    let case = Case {
        field: Central { gm: 1.0 },
        h: 348.795 * 86400.0 / time / steps as f64,
        steps,
        start,
        target: end.try_into().expect("a target"),
        motion: Motion::Translation,
    };
    (case, body)
}

/// The published final mass is 603.94 kg. Steps deviate by the square of their length.
#[test]
fn from_earth_to_mars_it_burns_what_is_published() {
    let [few, many] = [200, 400].map(|steps| {
        let (case, body) = earth_mars(steps);
        let transfer = case.transfer(&body, Cost::Propellant).expect("a transfer");
        let plan = planned(&transfer).expect("a plan");
        let (flown, _) = case.flown(&body, &plan, &transfer);
        assert!((1.0 - plan.cost - flown.mass()).abs() < 1e-12);
        let certificate = plan.certificate;
        assert!(certificate.sufficient, "{certificate:?}");
        let switching = certificate.switching.expect("a switching structure");
        assert_eq!(switching.switches, 4, "three arcs: {switching}");
        assert!(switching.contradiction < 1e-5, "{switching}");
        flown.mass()
    });
    let limit = many + (many - few) / 3.0;
    assert!((1000.0 * limit - 603.94).abs() < 5e-3, "{limit}");
    let text = include_str!("../../../../tests/truth/engine.json");
    let all: serde_json::Value = serde_json::from_str(text).expect("references");
    let shot = number(&all["earth_mars"]["final_mass"]);
    assert!((limit - shot).abs() < 5e-6, "{limit} for {shot}");
}

/// What is minimized, and the propellant.
#[test]
fn propellant_is_what_ipopt_finds_with_the_mass_as_a_state() {
    for reference in references("engine", "cases") {
        let of = |key: &str| number(&reference[key]);
        let engine = Engine {
            thrust: of("limit"),
            exhaust_velocity: of("exhaust_velocity"),
        };
        let body = body(of("mass"), 0.99 * of("mass"), engine);
        let steps = reference["N"].as_u64().expect("N") as usize;
        let at = |which: &str| {
            let [place, velocity] = [0, 1].map(|i| vector(&reference[which][i]));
            let still = Vector3::zeros();
            BodyState::from_velocities(&body, place, velocity, Matrix3::identity(), still)
        };
        let case = Case {
            field: Central { gm: of("gm") },
            h: of("T") / steps as f64,
            steps,
            start: at("start"),
            target: at("end").try_into().expect("a target"),
            motion: Motion::Translation,
        };
        for (cost, key) in [
            (Cost::Propellant, "fuel"),
            (Cost::Energy, "energy"),
            (Cost::Weighted, "weighted"),
        ] {
            let transfer = case.transfer(&body, cost).expect("a transfer");
            let plan = planned(&transfer).expect("a plan");
            let masses = plan.masses(&transfer);
            let weights = match cost {
                Cost::Weighted => WEIGHTS,
                _ => Vector3::repeat(1.0),
            };
            let scaled = |(k, force): (usize, &Load)| {
                let middle = 0.5 * (masses[k] + masses[k + 1]);
                let force = force.force.component_mul(&weights.map(f64::sqrt));
                force.norm() * masses[0] / middle
            };
            let scaled: Vec<_> = plan.controls.iter().enumerate().map(scaled).collect();
            let minimum: f64 = match cost {
                Cost::Propellant => scaled.iter().sum::<f64>() / engine.exhaust_velocity,
                Cost::Energy | Cost::Weighted => scaled.iter().map(|w| 0.5 * w * w).sum(),
            };
            let minimum = case.h * minimum;
            let dearer = minimum / number(&reference[key]["minimum"]) - 1.0;
            println!("{} {key}: {dearer:e}", reference["name"]);
            assert!(
                dearer.abs() < 2e-6,
                "{} {key}: {dearer:e}",
                reference["name"]
            );
            case.flown(&body, &plan, &transfer);
        }
    }
}

/// From rest in a uniform field to a height within a time, where the velocity is free: full thrust up to `t` and no force then.
/// `z = c t − (c m/q) ln(m₀/m) − g t²/2` and `v = c ln(m₀/m) − g t`, with the flow `q` and the mass `m = m₀ − q t`.
#[test]
fn an_ascent_in_vacuum_pushes_first_and_coasts_then() {
    let (gravity, height, duration) = (1.0, 1.0, 2.0);
    let engine = Engine {
        thrust: 5.0,
        exhaust_velocity: 2.5,
    };
    let flow = engine.thrust / engine.exhaust_velocity;
    let reached = |t: f64| {
        let (c, left) = (engine.exhaust_velocity, 2.0 - flow * t);
        let ratio = (2.0 / left).ln();
        let place = c * t - c * left / flow * ratio - 0.5 * gravity * t * t;
        let coast = duration - t;
        place + (c * ratio - gravity * t) * coast - 0.5 * gravity * coast * coast
    };
    let mut times = [0.0, 0.9];
    for _ in 0..60 {
        let middle = 0.5 * (times[0] + times[1]);
        times[usize::from(reached(middle) > height)] = middle;
    }
    let expected = flow * times[0];
    let body = body(2.0, 1.9, engine);
    let still = Vector3::zeros();
    let start = BodyState::from_velocities(&body, still, still, Matrix3::identity(), still);
    let target = FinalPosition::new(height * Vector3::z(), None).expect("a position");
    let errors = [50, 100, 200].map(|steps| {
        let case = Case {
            field: Uniform {
                acceleration: -gravity * Vector3::z(),
            },
            h: duration / steps as f64,
            steps,
            start,
            target: Terminal::FREE.with(target),
            motion: Motion::Translation,
        };
        let transfer = case.transfer(&body, Cost::Propellant).expect("a transfer");
        let plan = planned(&transfer).expect("a plan");
        let (flown, end) = case.flown(&body, &plan, &transfer);
        assert!((end.position - height * Vector3::z()).norm() < 1e-9);
        let switching = plan.certificate.switching.expect("a switching structure");
        assert_eq!(switching.switches, 1, "{switching}");
        assert!(plan.controls[0].force.z > 0.999 * engine.thrust);
        (2.0 - flown.mass()) / expected - 1.0
    });
    assert!(errors[2].abs() < 1e-4, "{errors:?}");
}

fn turning(rng: &mut Rng, body: &RigidBody, place: Vector3<f64>, speed: Vector3<f64>) -> BodyState {
    let mut turn = || Vector3::from_fn(|_, _| rng.f64() - 0.5);
    let [place, speed] = [place + 0.5 * turn(), speed + 0.2 * turn()];
    BodyState::from_velocities(body, place, speed, exp(&turn()), 0.6 * turn())
}

/// Between tumbling states about a center, up to two fifths of the mass flow out.
#[test]
fn random_transfers_arrive_with_the_masses_of_the_plan() {
    let mut rng = Rng::with_seed(71);
    for round in 0..6 {
        let motion = [Motion::Full, Motion::Translation][round % 2];
        let engine = Engine {
            thrust: 0.35 + 0.3 * rng.f64(),
            exhaust_velocity: 1.2 + rng.f64(),
        };
        let body = body(2.0, 1.9, engine);
        let start = turning(&mut rng, &body, 3.0 * Vector3::x(), 0.57 * Vector3::y());
        let (place, speed) = (Vector3::new(1.5, 2.6, 0.0), Vector3::new(-0.49, 0.28, 0.0));
        let end = turning(&mut rng, &body, place, speed);
        let case = Case {
            field: Central { gm: 1.0 },
            h: 0.1,
            steps: 60,
            start,
            target: end.try_into().expect("a target"),
            motion,
        };
        for cost in [Cost::Propellant, Cost::Energy] {
            let transfer = case.transfer(&body, cost).expect("a transfer");
            let plan = planned(&transfer);
            let plan = plan.unwrap_or_else(|error| panic!("{round} {cost:?}: {error}"));
            let (flown, reached) = case.flown(&body, &plan, &transfer);
            let factor = 2.0 / flown.mass();
            let reached = BodyState {
                linear_momentum: factor * reached.linear_momentum,
                angular_momentum: factor * reached.angular_momentum,
                ..reached
            };
            let rows = if motion == Motion::Full { 12 } else { 6 };
            let off = miss(&end, &reached).rows(0, rows).amax();
            assert!(off < 1e-7, "{round} {cost:?}: {off:e}");
            assert!(plan.certificate.sufficient, "{:?}", plan.certificate);
            // Moments that are commands have a cost of their own.
            if cost == Cost::Propellant && motion == Motion::Translation {
                assert!((plan.cost / (2.0 - flown.mass()) - 1.0).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn the_rest_is_planned_with_the_propellant_that_is_left() {
    let (case, body) = earth_mars(100);
    let transfer = case.transfer(&body, Cost::Propellant).expect("a transfer");
    let plan = planned(&transfer).expect("a plan");
    let masses = plan.masses(&transfer);
    let left = 0.9 - (1.0 - masses[30]);
    let rest = transfer.remaining(30, plan.states[30]).expect("a rest");
    let rest = rest.with_propellant(left).expect("propellant");
    let guess = plan.remaining(&transfer, 30).expect("a rest");
    let settings = NewtonSettings::default();
    let again = solve(&rest, Start::Warm(&guess), &settings, |_| true).expect("a plan");
    let end = again.masses(&rest)[70];
    assert!((end - masses[100]).abs() < 1e-6, "{end} {}", masses[100]);
}

/// In steps in which the force is off nothing flows out.
#[test]
fn a_force_that_is_off_uses_nothing() {
    let (case, body) = earth_mars(100);
    for cost in [Cost::Propellant, Cost::Energy] {
        let transfer = case.transfer(&body, cost).expect("a transfer");
        let free = planned(&transfer).expect("a plan");
        let coasting = transfer.without_commands(15..25, &[0, 1, 2]);
        let coasting = coasting.expect("a transfer");
        let plan = planned(&coasting).expect("a plan");
        let masses = plan.masses(&coasting);
        assert_eq!(masses[15], masses[25]);
        assert!(plan.cost > free.cost && plan.certificate.sufficient);
        case.flown(&body, &plan, &coasting);
    }
}

#[test]
fn what_an_engine_does_not_do_is_an_error() {
    let (case, tank) = earth_mars(60);
    let engine = *tank.thrusters().and_then(Thrusters::engine).expect("one");
    let small = body(1.0, 0.3, engine);
    let transfer = case.transfer(&small, Cost::Propellant).expect("a transfer");
    match planned(&transfer) {
        Err(PlanError::Propellant { needed, available }) => {
            assert!((0.38..0.42).contains(&needed) && available == 0.3);
        }
        other => panic!("{other:?}"),
    }
    let euler = planned(&transfer.clone().with_dynamics(Dynamics::LieEuler));
    let (dynamics, motion) = (Dynamics::LieEuler, Motion::Translation);
    assert_eq!(euler, Err(PlanError::PropellantDoes { dynamics, motion }));
    refuses_a_free_duration(&transfer);

    let uncertainty = Uncertainty {
        position: 1e-3,
        ..Uncertainty::default()
    };
    let chances = Chances::new(uncertainty, 0.9).expect("chances");
    let risky = planned(&transfer.clone().with_chances(chances));
    assert!(matches!(risky, Err(PlanError::ChancesBeside { .. })));
    let plain = Case {
        motion: Motion::Full,
        ..case.clone()
    };
    let plain = plain.transfer(&small, Cost::Energy).expect("a transfer");
    let plain = plain
        .with_constraints(&[])
        .with_dynamics(Dynamics::LieEuler);
    let settings = shooting::Settings::default();
    let shot = shooting::solve(&plain, SVector::zeros(), &settings, |_| true).err();
    let unsupported = matches!(shot, Some(ShootingError::Start(ExtremalError::Unsupported)));
    assert!(unsupported, "{shot:?}");

    let columns = [([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1.0)];
    let pushes = Actuation::actuators(&columns).expect("an actuation");
    let Case {
        field,
        h,
        steps,
        start,
        target,
        ..
    } = case;
    let refused = Transfer::new(small, field, h, steps, start, target, pushes).err();
    assert_eq!(refused, Some(TransferError::EngineActuators));
}
