//! Plans by thrusters that use propellant.

use fastrand::Rng;
use lgvi_control::{
    Actuation, Dynamics, NewtonSettings, Plan, PlanError, Start, Transfer, miss, solve,
};
use lgvi_dynamics::gravity::Central;
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::thrusters::{Propellant, Thruster, Thrusters};
use lgvi_dynamics::{BodyState, Inertia, Load, Method, RigidBody, Simulation, System};

use crate::thrusters::{ends, layout, limited};

fn planned(transfer: &Transfer) -> Result<Plan, PlanError> {
    solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true)
}

/// The body of the tests of thrusters, of mass 2, with so much propellant.
fn body(thrusters: &[Thruster], propellant: f64) -> RigidBody {
    let inertia = Inertia::principal([1.0, 1.4, 1.9]).expect("inertia");
    let propellant = Propellant {
        mass: propellant,
        inertia: None,
    };
    let thrusters = Thrusters::new(thrusters.to_vec(), propellant).expect("thrusters");
    RigidBody::new(2.0, inertia, Vec::new())
        .and_then(|body| body.with_thrusters(thrusters))
        .expect("a body")
}

fn with(thrusters: &[Thruster], thrust: f64, exhaust_velocity: f64) -> Vec<Thruster> {
    let each = thrusters.iter().map(|thruster| Thruster {
        thrust,
        exhaust_velocity,
        ..*thruster
    });
    each.collect()
}

fn flown(body: RigidBody, initial: BodyState, plan: &Plan) -> Simulation {
    let count = body.thrusters().expect("thrusters").thrusters().len();
    let system = System::new(vec![body], vec![Box::new(Central { gm: 1.0 })]);
    let method = Method::Lgvi(Rotor::default());
    let mut simulation =
        Simulation::new(system, vec![initial], method, plan.h).expect("a simulation");
    for command in &plan.commands {
        simulation.set_thruster_commands(0, &command.as_slice()[..count]);
        simulation.advance(&[Load::default()]).expect("a step");
    }
    simulation
}

fn transfer_of(
    body: &RigidBody,
    [initial, target]: [BodyState; 2],
    fuel: bool,
) -> Transfer {
    let thrusters = body.thrusters().expect("thrusters");
    let limits: Vec<_> = thrusters.thrusters().iter().map(|one| one.thrust).collect();
    let weights: Vec<_> = thrusters
        .thrusters()
        .iter()
        .map(|one| if fuel { one.exhaust_velocity.recip() } else { 1.0 })
        .collect();
    let limits = [limited(&limits)];
    let mut actuation = Actuation::thrusters(thrusters, &weights).expect("an actuation");
    if fuel {
        actuation = actuation.minimizing_fuel(&limits).expect("limits");
    }
    let (h, n) = (2.0 / 60.0, 60);
    Transfer::new(body.clone(), Central { gm: 1.0 }, h, n, initial, target, actuation)
        .expect("a transfer")
        .with_dynamics(Dynamics::Lgvi)
        .with_constraints(&limits)
}

#[test]
fn random_layouts_fly_to_their_targets_with_the_masses_of_the_plan() {
    let mut rng = Rng::with_seed(61);
    for round in 0..4 {
        let count = 7 + 2 * round;
        let layout = layout(&mut rng, count);
        let ends = ends(&mut rng);
        let free = transfer_of(&body(&with(&layout, 100.0, f64::INFINITY), 0.0), ends, false);
        let free = planned(&free).expect("a plan without limits");
        let most = free.commands.iter().map(|w| w.max()).fold(0.0, f64::max);
        let impulse: f64 = free.commands.iter().map(|w| free.h * w.sum()).sum();
        // So that about 0.6 of 2 are used.
        let thrusters = with(&layout, std::env::var("SHARE").unwrap().parse::<f64>().unwrap() * most, impulse / std::env::var("USED").unwrap().parse::<f64>().unwrap());
        let body = body(&thrusters, 1.2);
        for fuel in [true, false] {
            let transfer = transfer_of(&body, ends, fuel);
            let plan = match planned(&transfer) { Ok(plan) => plan, Err(error) => { eprintln!("FAIL {round} {fuel}: {error}"); continue } };
            let masses = plan.masses(&transfer);
            eprintln!("{round} {fuel} {:?} mass {}", plan.certificate, masses[60]);
            let simulation = flown(body.clone(), ends[0], &plan);
            let factor = masses[60] / 2.0;
            let mut end = simulation.states()[0];
            end.linear_momentum /= factor;
            end.angular_momentum /= factor;
            let off = miss(&ends[1], &end).amax();
            eprintln!("off {off:e} {}", simulation.system().bodies()[0].mass() - masses[60]);
        }
    }
}
