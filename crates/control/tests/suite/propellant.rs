//! Plans by thrusters that use propellant: in the flight by the propagator's steps, against IPOPT with the mass as a state
//! (`tests/truth/propellant.json`), and by the rocket equation.

use fastrand::Rng;
use lgvi_control::{
    Actuation, Dynamics, FinalTime, FinalTimeError, Motion, NewtonSettings, Plan, PlanError,
    SearchSettings, Start, Transfer, TransferError, miss, search, solve, solve_final_time,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::thrusters::{Propellant, Thruster, Thrusters};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};
use lgvi_lie::exp;
use nalgebra::{Matrix3, Vector3};

use crate::fuel::{number, references, vector};
use crate::thrusters::{ends, layout, limited, pairs};

fn planned(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

fn made(body: RigidBody, thrusters: Vec<Thruster>, propellant: f64) -> RigidBody {
    let propellant = Propellant {
        mass: propellant,
        inertia: None,
    };
    let thrusters = Thrusters::new(thrusters, propellant).expect("thrusters");
    body.with_thrusters(thrusters).expect("a body")
}

/// The body of the tests of thrusters, of mass 2, with so much propellant.
fn body(thrusters: Vec<Thruster>, propellant: f64) -> RigidBody {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("inertia");
    let body = RigidBody::new(2.0, inertia, Vec::new()).expect("a body");
    made(body, thrusters, propellant)
}

fn with(thrusters: &[Thruster], thrust: f64, exhaust_velocity: f64) -> Vec<Thruster> {
    let each = thrusters.iter().map(|thruster| Thruster {
        thrust,
        exhaust_velocity,
        ..*thruster
    });
    each.collect()
}

/// What a plan costs.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cost {
    Propellant,
    Energy,
}

struct Case {
    gm: f64,
    h: f64,
    steps: usize,
    ends: [BodyState; 2],
}

impl Case {
    fn transfer(&self, body: &RigidBody, cost: Cost) -> Result<Transfer, TransferError> {
        let thrusters = body.thrusters().expect("thrusters");
        let all = thrusters.thrusters();
        let limits: Vec<_> = all.iter().map(|one| one.thrust).collect();
        let weight = |one: &Thruster| match cost {
            Cost::Propellant => one.exhaust_velocity.recip(),
            Cost::Energy => 1.0,
        };
        let weights: Vec<_> = all.iter().map(weight).collect();
        let limits = [limited(&limits)];
        let actuation = Actuation::thrusters(thrusters, &weights).expect("an actuation");
        let actuation = match cost {
            Cost::Propellant => actuation.minimizing_fuel(&limits).expect("limits"),
            Cost::Energy => actuation,
        };
        let Self { gm, h, steps, ends } = *self;
        let field = Central { gm };
        let [initial, target] = ends;
        Transfer::new(body.clone(), field, h, steps, initial, target, actuation).map(|transfer| {
            transfer
                .with_dynamics(Dynamics::Lgvi)
                .with_constraints(&limits)
        })
    }

    /// Flies a plan. Returns the distance of the state at the end from the target at the target's velocities, relative to
    /// momenta of the full body, and the body.
    fn flown(&self, body: &RigidBody, plan: &Plan) -> (f64, RigidBody) {
        let field = Central { gm: self.gm };
        let system = System::new(vec![body.clone()], vec![Box::new(field)]);
        let count = body.thrusters().expect("thrusters").thrusters().len();
        let method = Method::Lgvi(Rotor::default());
        let mut simulation =
            Simulation::new(system, vec![plan.states[0]], method, plan.h).expect("a simulation");
        for (k, command) in plan.commands.iter().enumerate() {
            simulation.set_thruster_commands(0, &command.as_slice()[..count]);
            simulation.advance(&[Load::default()]).expect("a step");
            let apart = miss(&plan.states[k + 1], &simulation.states()[0]);
            assert!(apart.amax() < 1e-6, "step {k}: {apart:?}");
        }
        let flown = simulation.system().bodies()[0].clone();
        let end = simulation.states()[0];
        let mut full = flown.clone();
        full.set_propellant(flown.thrusters().expect("thrusters").propellant().mass);
        let factor = full.mass() / flown.mass();
        let end = BodyState {
            linear_momentum: factor * end.linear_momentum,
            angular_momentum: factor * end.angular_momentum,
            ..end
        };
        (miss(&self.ends[1], &end).amax(), flown)
    }
}

fn near_a_center(ends: [BodyState; 2]) -> Case {
    Case {
        gm: 1.0,
        h: 2.0 / 60.0,
        steps: 60,
        ends,
    }
}

/// Between tumbling states, up to a third of the mass flows out, from thrusters off the center of mass.
#[test]
fn random_layouts_fly_to_their_targets_with_the_masses_of_the_plan() {
    let mut rng = Rng::with_seed(61);
    for (round, (share, used)) in [(2.0, 0.3), (0.9, 0.3), (0.8, 0.6), (1.2, 0.15)]
        .into_iter()
        .enumerate()
    {
        let layout = layout(&mut rng, 7 + 2 * round);
        let case = near_a_center(ends(&mut rng));
        let free = body(with(&layout, 100.0, f64::INFINITY), 0.0);
        let free = planned(&case.transfer(&free, Cost::Energy).expect("a transfer"));
        let free = free.expect("a plan without propellant");
        let most = free.commands.iter().map(|w| w.max()).fold(0.0, f64::max);
        let impulse: f64 = free.commands.iter().map(|w| free.h * w.sum()).sum();
        let thrusters = with(&layout, share * most, impulse / used);
        let body = body(thrusters, 1.2);
        for cost in [Cost::Propellant, Cost::Energy] {
            let transfer = case.transfer(&body, cost).expect("a transfer");
            let plan = planned(&transfer);
            let plan = plan.unwrap_or_else(|error| panic!("{round} {cost:?}: {error}"));
            let certificate = &plan.certificate;
            assert!(
                certificate.sufficient && certificate.terminal < 2e-8,
                "{certificate:?}"
            );
            let masses = plan.masses(&transfer);
            let (off, flown) = case.flown(&body, &plan);
            assert!(off < 1e-7, "{round} {cost:?}: the flight misses by {off:e}");
            assert!((flown.mass() - masses[60]).abs() < 1e-13);
            let gone = masses[0] - masses[60];
            assert!(gone > 0.4 * used, "{gone}");
            if cost == Cost::Propellant {
                assert!((plan.cost / gone - 1.0).abs() < 1e-12);
                let switching = certificate.switching.expect("a switching structure");
                assert!(switching.contradiction < 1e-3, "{round}: {switching}");
            }
        }
    }
}

#[test]
fn propellant_is_what_ipopt_finds_with_the_mass_as_a_state() {
    for case in references("propellant", "cases") {
        let [duration, limit, velocity, expected] =
            ["T", "limit", "exhaust_velocity", "propellant"].map(|key| number(&case[key]));
        let places = case["positions"].as_array().expect("positions").iter();
        let ways = case["directions"].as_array().expect("directions").iter();
        let thruster = |(place, way)| Thruster::new(vector(place), vector(way), 1.0);
        let thrusters: Vec<_> = places.zip(ways).map(thruster).collect();
        let body = body(with(&thrusters, limit, velocity), 1.9);
        let end = |which: &str, spin: usize, turn: Matrix3<f64>| {
            let [mut position, speed] = [0, 1].map(|at| vector(&case[which][at]));
            if number(&case["gm"]) == 0.0 {
                // Away from the center that attracts nothing.
                position += Vector3::y();
            }
            let spin = vector(&case["spins"][spin]);
            BodyState::from_velocities(&body, position, speed, turn, spin)
        };
        let steps = case["N"].as_u64().expect("N") as usize;
        let case_ = Case {
            gm: number(&case["gm"]),
            h: duration / steps as f64,
            steps,
            ends: [
                end("start", 0, Matrix3::identity()),
                end("end", 1, exp(&vector(&case["turn"]))),
            ],
        };
        let transfer = case_.transfer(&body, Cost::Propellant).expect("a transfer");
        let plan = planned(&transfer).expect("a plan");
        let dearer = plan.cost / expected - 1.0;
        // Gradients neglect that the Coriolis force and the jet damping depend on the commands, by the part `r Ω/c`.
        let name = case["name"].as_str().expect("a name");
        let most = match velocity {
            _ if name.ends_with("in free space") => 2e-6,
            fast if fast > 10.0 => 1e-4,
            _ => 3e-3,
        };
        assert!(
            dearer > -2e-6 && dearer < most,
            "{}: {} for {expected}",
            case["name"],
            plan.cost
        );
        let (off, _) = case_.flown(&body, &plan);
        assert!(off < 1e-7, "{}: {off:e}", case["name"]);
    }
}

/// At rest at both ends, moved by `way`, by pairs of thrusters.
fn straight(way: Vector3<f64>, thrust: f64, velocity: f64, propellant: f64) -> (Case, RigidBody) {
    let body = body(with(&pairs(), thrust, velocity), propellant);
    let (still, upright) = (Vector3::zeros(), Matrix3::identity());
    let at = |place| BodyState::from_velocities(&body, place, still, upright, still);
    let case = Case {
        gm: 0.0,
        h: 0.1,
        steps: 60,
        ends: [at(Vector3::y()), at(Vector3::y() + way)],
    };
    (case, body)
}

/// Pairs of thrusters along x change the velocity, by `c · 2 artanh(a/2)` in a step in which `ln m` falls by that.
#[test]
fn masses_obey_the_rocket_equation() {
    let velocity = 3.0;
    let (case, body) = straight(Vector3::x(), 0.4, velocity, 1.0);
    let transfer = case.transfer(&body, Cost::Propellant).expect("a transfer");
    let plan = planned(&transfer).expect("a plan");
    let masses = plan.masses(&transfer);
    let speeds = plan.states.iter().zip(&masses);
    let speeds: Vec<_> = speeds
        .map(|(state, mass)| state.linear_momentum.x / mass)
        .collect();
    let changes = speeds.windows(2).map(|ends| (ends[1] - ends[0]).abs());
    let expected: f64 = changes
        .map(|change| 2.0 * (0.5 * change / velocity).atanh())
        .sum();
    let fallen = (masses[0] / masses[60]).ln();
    assert!(fallen > 0.1, "{fallen}");
    assert!(
        (fallen / expected - 1.0).abs() < 1e-6,
        "{fallen} for {expected}"
    );
    // A body that becomes lighter brakes in a shorter time than it takes to speed up.
    let open = |steps: std::ops::Range<usize>| -> f64 {
        plan.commands[steps].iter().map(|w| w.sum()).sum()
    };
    assert!(
        open(0..30) > 1.02 * open(30..60),
        "{} {}",
        open(0..30),
        open(30..60)
    );
}

#[test]
fn propellant_that_does_not_suffice_is_an_error() {
    let (case, body) = straight(Vector3::x(), 0.4, 3.0, 0.1);
    let transfer = case.transfer(&body, Cost::Propellant).expect("a transfer");
    match planned(&transfer) {
        Err(PlanError::Propellant { needed, available }) => {
            assert!(needed > 0.2 && available == 0.1, "{needed} of {available}");
        }
        other => panic!("{other:?}"),
    }
}

/// The rest of a plan from where its flight is, with the propellant that is left, is planned warm, and again as it was.
#[test]
fn the_rest_is_planned_with_the_propellant_that_is_left() {
    let mut rng = Rng::with_seed(62);
    let case = near_a_center(ends(&mut rng));
    let body = body(with(&pairs(), 2.5, 10.0), 1.0);
    let transfer = case.transfer(&body, Cost::Propellant).expect("a transfer");
    let plan = planned(&transfer).expect("a plan");
    let masses = plan.masses(&transfer);
    let left = 1.0 - (masses[0] - masses[20]);
    for nudge in [0.0, 1e-3] {
        let mut state = plan.states[20];
        state.linear_momentum.x += nudge;
        let rest = transfer.remaining(20, state).expect("a rest");
        let rest = rest.with_propellant(left).expect("propellant");
        let guess = plan.remaining(&transfer, 20).expect("a rest");
        let again = solve(
            &rest,
            Start::Warm(&guess),
            &NewtonSettings::default(),
            |_| true,
        );
        let again = again.expect("a plan");
        let (off, flown) = case.flown(
            &{
                let mut body = body.clone();
                body.set_propellant(left);
                body
            },
            &again,
        );
        assert!(off < 1e-7, "{nudge}: {off:e}");
        let apart = flown.mass() - masses[60];
        assert!(
            apart.abs() < if nudge == 0.0 { 1e-6 } else { 1e-2 },
            "{nudge}: {apart:e}"
        );
    }
    let refused = transfer.with_propellant(1.5).err();
    let (left, most) = (1.5, 1.0);
    assert_eq!(refused, Some(TransferError::Propellant { left, most }));
}

/// Approaches in a low orbit, in SI, by layouts at random.
#[test]
fn approaches_in_a_low_orbit_use_the_propellant_of_the_plan() {
    let mut rng = Rng::with_seed(63);
    let (gm, radius): (f64, f64) = (3.986_004_418e14, 6.778e6);
    let rate = (gm / radius.powi(3)).sqrt();
    let (h, steps) = (1.0, 120);
    for round in 0..3 {
        let count = 9 + round;
        let inertia = Inertia::principal([30.0, 33.0, 36.0]).expect("inertia");
        let craft = RigidBody::new(150.0, inertia, Vec::new()).expect("a body");
        let layout = with(&layout(&mut rng, count), 4.0, 2200.0);
        let craft = made(craft, layout, 8.0);
        let mut turn = || Vector3::from_fn(|_, _| rng.f64() - 0.5);
        let at = |place: Vector3<f64>, time: f64, turn: Vector3<f64>| {
            let frame = exp(&Vector3::new(0.0, 0.0, rate * time));
            let position = frame * (Vector3::new(radius, 0.0, 0.0) + place);
            let velocity = Vector3::new(0.0, 0.0, rate).cross(&position);
            let spin = 0.02 * turn;
            BodyState::from_velocities(&craft, position, velocity, frame * exp(&turn), spin)
        };
        let ends = [
            at(20.0 * turn(), 0.0, turn()),
            at(20.0 * turn(), h * steps as f64, turn()),
        ];
        let case = Case { gm, h, steps, ends };
        let transfer = case.transfer(&craft, Cost::Propellant).expect("a transfer");
        let plan = planned(&transfer);
        let plan = plan.unwrap_or_else(|error| panic!("{round}: {error}"));
        let masses = plan.masses(&transfer);
        let certificate = &plan.certificate;
        assert!(certificate.terminal < 2e-8, "{round}: {certificate:?}");
        let used = masses[0] - masses[steps];
        assert!(
            used > 1e-3 && (plan.cost / used - 1.0).abs() < 1e-9,
            "{used}"
        );
    }
}

#[test]
fn a_search_finds_the_plan_of_a_cold_start_or_a_cheaper_one() {
    let (case, body) = straight(Vector3::new(0.5, 0.2, 0.1), 0.4, 5.0, 1.0);
    let transfer = case.transfer(&body, Cost::Energy).expect("a transfer");
    let plan = planned(&transfer).expect("a plan");
    let settings = SearchSettings {
        starts: 2,
        seed: 1,
        newton: NewtonSettings::default(),
    };
    let minima = search(&transfer, &settings, |_| true).expect("minima");
    assert!(minima[0].plan.cost <= plan.cost * (1.0 + 1e-6));
    let (off, _) = case.flown(&body, &minima[0].plan);
    assert!(off < 1e-7, "{off:e}");
}

pub(crate) fn refuses_a_free_duration(transfer: &Transfer) {
    let time = FinalTime {
        shortest: 4.0,
        longest: 8.0,
        weight: 0.0,
        tolerance: 1e-3,
    };
    let settings = NewtonSettings::default();
    let free = solve_final_time(transfer, &time, Start::Cold, &settings, |_| true);
    assert_eq!(free.err(), Some(FinalTimeError::Propellant));
}

#[test]
fn what_is_not_planned_with_propellant_is_refused() {
    let (case, body) = straight(Vector3::x(), 0.4, 3.0, 0.5);
    let transfer = case.transfer(&body, Cost::Energy).expect("a transfer");
    let euler = planned(&transfer.clone().with_dynamics(Dynamics::LieEuler));
    let (dynamics, motion) = (Dynamics::LieEuler, Motion::Full);
    assert_eq!(euler, Err(PlanError::PropellantDoes { dynamics, motion }));
    let half = planned(&transfer.clone().with_motion(Motion::Rotation));
    let (dynamics, motion) = (Dynamics::Lgvi, Motion::Rotation);
    assert_eq!(half, Err(PlanError::PropellantDoes { dynamics, motion }));
    refuses_a_free_duration(&transfer);

    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("inertia");
    let propellant = Propellant {
        mass: 0.5,
        inertia: Some(0.1 * Matrix3::identity()),
    };
    let thrusters = Thrusters::new(with(&pairs(), 0.4, 3.0), propellant).expect("thrusters");
    let own = RigidBody::new(2.0, inertia, Vec::new()).expect("a body");
    let own = own.with_thrusters(thrusters).expect("a body");
    let refused = case.transfer(&own, Cost::Energy).err();
    assert_eq!(refused, Some(TransferError::PropellantInertia));
}
