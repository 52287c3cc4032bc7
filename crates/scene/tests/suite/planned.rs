//! Plans of the shipped scenes of each class, flown as planned.

use lgvi_control::constraint::{ComponentLimit, Corridor, KeepOutCone, NormLimit};
use lgvi_control::{NewtonSettings, Plan, Start, miss, solve};
use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::Scene;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

use crate::shipped::{shipped, shipped_text};

fn plan(scene: &Scene) -> Plan {
    let transfer = scene.transfer().unwrap().unwrap();
    let settings = NewtonSettings::default();
    solve(&transfer, Start::Cold, &settings, |_| true).unwrap_or_else(|error| panic!("{error}"))
}

/// Flies a plan by the scene's own integrator without disturbance and returns the planned body's states, one per step.
fn flown(scene: &Scene, plan: &Plan) -> Vec<BodyState> {
    let body = scene.maneuver.as_ref().unwrap().body;
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let mut loads = vec![Load::default(); scene.bodies.len()];
    let mut states = Vec::new();
    for control in &plan.controls {
        loads[body] = *control;
        simulation.advance(&loads).unwrap();
        states.push(simulation.states()[body]);
    }
    states
}

#[test]
fn the_telescope_turns_past_the_sun_within_the_moment_of_its_wheels() {
    let scene = shipped("slew_keep_out");
    let plan = plan(&scene);
    let states = flown(&scene, &plan);
    let miss = scene.miss(states.last().unwrap()).unwrap();
    assert!(miss.norm() < 1e-9, "{miss}");
    let constraints = &scene.maneuver.as_ref().unwrap().constraints;
    let cone: &KeepOutCone = constraints[0].downcast_ref().expect("a cone");
    let [axis, direction] = [cone.axis(), cone.direction()];
    let wheels: &ComponentLimit = constraints[1].downcast_ref().expect("limits");
    let limit = wheels.limit();
    let angles = states
        .iter()
        .map(|state| direction.angle(&(state.attitude * axis)));
    let nearest = angles.fold(f64::INFINITY, f64::min);
    // The shortest path leads straight through the cone, so the optimal path touches its surface.
    assert!((nearest - cone.half_angle()).abs() < 1e-4, "{nearest}");
    let largest = plan
        .controls
        .iter()
        .map(|u| u.moment.amax())
        .fold(0.0, f64::max);
    assert!((largest - limit.x).abs() < 1e-6, "{largest}");
    assert!(plan.controls.iter().all(|u| u.force.norm() == 0.0));
}

/// The thrusters that the plan commands fly it, and push to one side only.
#[test]
fn the_chaser_is_flown_to_the_station_by_its_thrusters() {
    let scene = shipped("thruster_rendezvous");
    let plan = plan(&scene);
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let loads = vec![Load::default(); scene.bodies.len()];
    let mut open = 0;
    for command in &plan.commands {
        let thrust: Vec<_> = command.iter().take(12).map(|w| w.max(0.0)).collect();
        simulation.set_thruster_commands(1, &thrust);
        simulation.advance(&loads).unwrap();
        assert!(command.min() > -1e-7 && command.max() < 1.0 + 1e-7);
        for pair in thrust.chunks(2) {
            assert!(
                pair[0].min(pair[1]) < 1e-3,
                "{pair:?} push against each other"
            );
        }
        open += thrust.iter().filter(|thrust| **thrust > 0.999).count();
    }
    let miss = scene.miss(&simulation.states()[1]).unwrap();
    assert!(miss.norm() < 1e-5, "{miss}");
    assert!(open > 10, "{open} thrusters wide open");
}

/// A shipped scene with one line changed.
fn changed(name: &str, line: &str, instead: &str) -> Result<Scene, String> {
    let text = shipped_text(name);
    assert!(text.contains(line), "{line}");
    let changed = text.replacen(line, instead, 1);
    Scene::parse(name, &changed).map_err(|error| error.to_string())
}

#[test]
fn costs_that_are_not_of_fuel_are_refused_with_their_keys() {
    let fuel = "[maneuver]\ncost = \"fuel\"";
    for (name, keys, expected) in [
        ("slew_keep_out", "", "where the commands are moments"),
        (
            "inclination_change",
            "",
            "a constraint that limits command 0",
        ),
        ("wheel_slew_plan", "", "torques of wheels"),
        (
            "docking_corridor",
            "\nforce_weight = [1, 2, 1]",
            "maneuver.force_weight",
        ),
        ("docking_corridor", "\nfeedback = true", "maneuver.feedback"),
        (
            "docking_corridor",
            "\nsolver = { method = \"shooting\" }\ndynamics = \"lie_euler\"",
            "`maneuver.cost` is \"fuel\", expected \"energy\" where `solver.method` is \"shooting\"",
        ),
        (
            "docking_corridor",
            "\nprocessed = true\ndynamics = \"lie_euler\"",
            "`maneuver.cost` is \"fuel\", expected \"energy\" where `processed` is true",
        ),
        (
            "docking_corridor",
            "\nfinal_time = { min = 100.0, minimize = \"time\" }",
            "`maneuver.cost` is \"fuel\", expected \"energy\" beside `final_time.minimize = \"time\"`",
        ),
    ] {
        let refused = changed(name, "[maneuver]", &format!("{fuel}{keys}"));
        let refused = refused.expect_err(name);
        assert!(refused.contains(expected), "{name}: {refused}");
    }
    assert!(changed("docking_corridor", "[maneuver]", fuel).is_ok());
}

#[test]
fn a_price_beside_a_minimum_time_is_refused_with_its_key() {
    let soft = "limit = 50.0\nprice = 2.0";
    let refused = changed("minimum_time_slew", "limit = 50.0", soft).expect_err("a price");
    assert!(
        refused.contains("`maneuver.constraints[0].price` is 2"),
        "{refused}"
    );
}

/// A sphere in the axes of the station that costs next to nothing is flown through.
#[test]
fn constraints_that_move_keep_their_prices() {
    let scene = changed(
        "low_orbit_approach",
        "radius = 4.0",
        "radius = 24.0\nprice = 1e-9",
    )
    .unwrap();
    let constraints = &scene.maneuver.as_ref().unwrap().constraints;
    assert_eq!(constraints[1].price(), Some(1e-9));
    let plan = plan(&scene);
    assert!(
        plan.certificate.priced > 1e-3 && plan.paid > 0.0,
        "{plan:?}"
    );
    assert!(
        self::plan(&shipped("low_orbit_approach"))
            .certificate
            .priced
            == 0.0
    );
}

/// Thrusters at minimum fuel are shut or wide open, and burn less than those of the plan at least energy.
#[test]
fn the_chaser_burns_coasts_and_burns_at_minimum_fuel() {
    let scene = shipped("minimum_fuel");
    let transfer = scene.transfer().unwrap().unwrap();
    let plan = plan(&scene);
    let fuel = |plan: &Plan| plan.h * plan.commands.iter().map(|w| w.sum()).sum::<f64>();
    assert!((fuel(&plan) / plan.cost - 1.0).abs() < 1e-6);
    let switching = plan.certificate.switching.unwrap();
    assert!(switching.contradiction < 1e-3, "{switching:?}");
    assert!(
        switching.at_limit > 50 && switching.between < 60,
        "{switching:?}"
    );
    let middle = transfer.intervals() / 2;
    let coast = &plan.commands[middle - 20..middle + 20];
    assert!(coast.iter().all(|w| w.amax() < 1e-3), "no coast");
    let energy = changed("minimum_fuel", "cost = \"fuel\"", "cost = \"energy\"");
    let energy = self::plan(&energy.unwrap());
    assert!(fuel(&energy) > 1.5 * fuel(&plan), "{}", fuel(&energy));
}

/// The published final mass is 603.94 kg; steps of 21 hours end 0.05 kg below.
#[test]
fn the_spacecraft_arrives_at_mars_with_the_mass_that_is_published() {
    let scene = shipped("earth_mars");
    let transfer = scene.transfer().unwrap().unwrap();
    let plan = plan(&scene);
    let masses = plan.masses(&transfer);
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    for (k, control) in plan.controls.iter().enumerate() {
        let mass = simulation.system().bodies()[0].mass();
        assert!((mass - masses[k]).abs() < 1e-10, "step {k}");
        let rest = simulation.command(0, *control);
        simulation.advance(&[rest]).unwrap();
    }
    let bodies = simulation.system().bodies();
    let left = bodies[0].mass();
    assert!((603.89..603.94).contains(&left), "{left}");
    assert!((1000.0 - left - plan.cost).abs() < 1e-9);
    let state = &simulation.states()[0];
    let miss = scene.miss_among(bodies, simulation.states(), state);
    let miss = miss.unwrap().fixed_rows::<3>(0).norm();
    assert!(miss < 0.01, "{miss:e} km of 2.5e8 km");
}

/// The satellite's attitude by another integration, and the cost of the transfer by IPOPT (`tests/truth/envisat.json`).
#[test]
fn a_rendezvous_with_a_satellite_that_tumbles_like_envisat_costs_what_ipopt_finds() {
    let text = include_str!("../../../../tests/truth/envisat.json");
    let truth: Value = serde_json::from_str(text).unwrap();
    let (satellite, chaser, end) = (&truth["satellite"], &truth["chaser"], &truth["end"]);
    let vector = |value: &Value| Vector3::from_fn(|i, _| value[i].as_f64().unwrap());
    let attitude = |q: &Value| {
        format!(
            "{{ w = {}, x = {}, y = {}, z = {} }}",
            q[0], q[1], q[2], q[3]
        )
    };
    let text = format!(
        "title = \"Rendezvous\"\n[run]\nduration = {}\nsteps = {}\n\
         integrator = {{ name = \"lgvi\", rotor = \"exact\" }}\n[gravity.central]\ngm = {}\n\
         [[bodies]]\nname = \"envisat\"\nmass = 7828.9\ninertia = {}\nposition = {}\nvelocity = {}\n\
         attitude = {}\nangular_velocity = {}\n\
         [[bodies]]\nname = \"chaser\"\nmass = {}\ninertia = [900, 900, 900]\nposition = {}\nvelocity = {}\n\
         attitude = {{ w = 1, x = 0, y = 0, z = 0 }}\nangular_velocity = [0, 0, 0]\n\
         [maneuver]\nbody = \"chaser\"\nmotion = \"translation\"\n[maneuver.target]\n\
         relative_to = {{ body = \"envisat\", axes = \"body\" }}\nposition = [0, 0, 30]\nvelocity = [0, 0, 0]\n",
        truth["T"],
        truth["N"],
        truth["gm"],
        truth["inertia"],
        satellite["position"],
        satellite["velocity"],
        attitude(&satellite["attitude"]),
        satellite["rate"],
        truth["mass"],
        chaser["position"],
        chaser["velocity"],
    );
    let scene = Scene::parse("test", &text).unwrap_or_else(|error| panic!("{text}: {error}"));
    let plan = plan(&scene);
    let arrival = *flown(&scene, &plan).last().unwrap();
    let chaser = &scene.bodies[1].body;
    let far = (arrival.position - vector(&end["position"])).norm();
    let fast = (arrival.velocity(chaser) - vector(&end["velocity"])).norm();
    let dearer = plan.cost / truth["cost"].as_f64().unwrap() - 1.0;
    assert!(far < 1e-6 && fast < 1e-8, "{far:e} m, {fast:e} m/s");
    assert!(dearer.abs() < 1e-7, "{dearer:e}");
}

/// With the published height, 0.6 of the mass is left; steps of 0.8 s differ by 5e-5.
#[test]
fn goddards_rocket_arrives_with_the_mass_that_is_published() {
    let scene = shipped("goddard");
    let plan = plan(&scene);
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    for control in &plan.controls {
        let rest = simulation.command(0, *control);
        simulation.advance(&[rest]).unwrap();
    }
    let left = simulation.system().bodies()[0].mass();
    assert!((left - 0.6).abs() < 1e-4, "{left}");
    assert!((1.0 - left - plan.cost).abs() < 1e-12);
    let end = simulation.states()[0].position;
    assert!((end.x - 1.01283).abs() < 1e-9, "{end}");
}

/// The scene's simulation makes of the plan the states and the mass of the plan, which costs the propellant that is missing then.
#[test]
fn the_chaser_loses_the_mass_that_its_plan_costs() {
    let scene = shipped("propellant_transfer");
    let transfer = scene.transfer().unwrap().unwrap();
    let plan = plan(&scene);
    let masses = plan.masses(&transfer);
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let loads = vec![Load::default(); scene.bodies.len()];
    for (k, command) in plan.commands.iter().enumerate() {
        let body = &simulation.system().bodies()[1];
        assert!((body.mass() - masses[k]).abs() < 1e-10, "step {k}");
        let thrust: Vec<_> = command.iter().take(12).copied().collect();
        simulation.set_thruster_commands(1, &thrust);
        simulation.advance(&loads).unwrap();
    }
    let body = &simulation.system().bodies()[1];
    let used = 150.0 - body.mass();
    assert!(
        used > 12.0 && (used / plan.cost - 1.0).abs() < 1e-6,
        "{used}"
    );
    let miss = scene
        .miss_among(
            simulation.system().bodies(),
            simulation.states(),
            &simulation.states()[1],
        )
        .unwrap();
    let [position, attitude] = [0, 6].map(|row| miss.fixed_rows::<3>(row).norm());
    assert!(
        position < 1e-2 && attitude < 1e-5,
        "{position:e} {attitude:e}"
    );
    let switching = plan.certificate.switching.unwrap();
    assert!(switching.contradiction < 1e-3, "{switching}");
    // It brakes with less than it has sped up with.
    let impulse = |steps: std::ops::Range<usize>| -> f64 {
        plan.commands[steps].iter().map(|w| w.sum()).sum()
    };
    assert!(impulse(0..75) > 1.04 * impulse(75..150));
}

/// The wheels whose torques the plan commands fly it, each within its limits.
#[test]
fn the_satellite_is_turned_to_its_target_by_its_wheels() {
    let scene = shipped("wheel_slew_plan");
    let plan = plan(&scene);
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let (limit, fastest) = (9e-4, 220.0);
    let mut at_limit = [0; 2];
    for (command, state) in plan.commands.iter().zip(&plan.states) {
        let apart = miss(&simulation.states()[0], state);
        let [orbit, turn] = [0, 6].map(|row| apart.rows(row, 6).amax());
        assert!(orbit < 1e-6 && turn < 1e-13, "{orbit:e}, {turn:e}");
        assert!(command.amax() < limit * (1.0 + 1e-7), "{command}");
        at_limit[0] += command.iter().filter(|u| u.abs() > 0.999 * limit).count();
        simulation.set_wheel_commands(0, &command.as_slice()[..4]);
        simulation.advance(&[Load::default()]).unwrap();
        let wheels = simulation.system().bodies()[0].wheels().unwrap();
        for (wheel, torque) in wheels.states().iter().zip(command.iter()) {
            assert!((wheel.torque - torque).abs() < 1e-7 * limit);
        }
        let rate = simulation.states()[0].angular_velocity(&simulation.system().bodies()[0]);
        let speeds = (0..4).map(|wheel| wheels.speed(wheel, &rate).abs());
        let speed = speeds.fold(0.0, f64::max);
        assert!(speed < fastest * (1.0 + 1e-5), "{speed}");
        at_limit[1] += usize::from(speed > fastest * (1.0 - 1e-5));
    }
    let miss = scene.miss(&simulation.states()[0]).unwrap();
    assert!(miss.norm() < 1e-9, "{miss}");
    assert!(at_limit[0] > 100 && at_limit[1] > 0, "{at_limit:?}");
    let text = include_str!("../../../../scenes/wheel_slew_plan.toml");
    let with = |limit: &str| {
        let scene = Scene::parse("other", &text.replace("max_speed = 220.0", limit)).unwrap();
        let transfer = scene.transfer().unwrap().unwrap();
        solve(&transfer, Start::Cold, &NewtonSettings::default(), |_| true)
    };
    let free = with("max_speed = 600.0").unwrap();
    assert!(plan.cost > 1.001 * free.cost, "{} {}", plan.cost, free.cost);
}

#[test]
fn the_chaser_stays_in_the_corridor_within_the_force_of_its_thrusters() {
    let scene = shipped("docking_corridor");
    let plan = plan(&scene);
    let states = flown(&scene, &plan);
    let miss = scene.miss(states.last().unwrap()).unwrap();
    assert!(miss.norm() < 1e-9, "{miss}");
    let constraints = &scene.maneuver.as_ref().unwrap().constraints;
    let corridor: &Corridor = constraints[0].downcast_ref().expect("a corridor");
    let [apex, axis] = [corridor.apex(), corridor.axis()];
    let thrusters: &NormLimit = constraints[1].downcast_ref().expect("a limit");
    let limit = thrusters.limit();
    let angles = states
        .iter()
        .map(|state| axis.angle(&(state.position - apex)));
    let widest = angles.fold(0.0, f64::max);
    assert!((widest - corridor.half_angle()).abs() < 1e-4, "{widest}");
    let largest = plan
        .controls
        .iter()
        .map(|u| u.force.norm())
        .fold(0.0, f64::max);
    assert!((largest - limit).abs() < 1e-6, "{largest}");
    assert!(plan.controls.iter().all(|u| u.moment.norm() == 0.0));
}

/// Seen from the satellite, the chaser stays in the corridor at the end of every step, and ends at rest before the port.
#[test]
fn the_chaser_follows_the_corridor_of_the_tumbling_satellite() {
    let scene = shipped("tumbling_target");
    let plan = plan(&scene);
    let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
    let turn = |states: &[BodyState]| {
        let [satellite, chaser] = states else {
            panic!("two bodies")
        };
        let seen = satellite
            .attitude
            .tr_mul(&(chaser.position - satellite.position));
        let attitude = satellite.attitude.tr_mul(&chaser.attitude);
        (seen, attitude)
    };
    let first = simulation.states()[0].attitude;
    let mut poses = Vec::new();
    for control in &plan.controls {
        simulation.advance(&[Load::default(), *control]).unwrap();
        poses.push(turn(simulation.states()));
    }
    // A good part of a turn.
    let tumbled = lgvi_lie::log(&first.tr_mul(&simulation.states()[0].attitude));
    assert!(tumbled.norm() > 1.5, "{tumbled}");
    let angles = poses
        .iter()
        .map(|(seen, _)| Vector3::x().angle(&(seen - 0.5 * Vector3::x())));
    let widest = angles.fold(0.0, f64::max).to_degrees();
    assert!((widest - 12.0).abs() < 1e-2, "{widest}");
    assert!(widest < 12.0 + 1e-6, "{widest}");
    let largest = plan.controls.iter().map(|u| u.force.norm());
    assert!(largest.fold(0.0, f64::max) < 25.0 + 1e-6);

    let [(before, _), (end, attitude)] = poses[poses.len() - 2..] else {
        panic!("two poses")
    };
    assert!((end - Vector3::new(3.0, 0.0, 0.0)).norm() < 1e-6, "{end}");
    let opposite = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
    assert!((attitude - opposite).norm() < 1e-9, "{attitude}");
    // At rest in the axes: in the last step it comes to the end with the acceleration of the thrust.
    assert!(
        (end - before).norm() < 0.5 * 25.0 / 800.0 + 1e-3,
        "{before}"
    );
    let [satellite, chaser] = simulation.states() else {
        panic!("two bodies")
    };
    let [one, other] = [&scene.bodies[0].body, &scene.bodies[1].body];
    let rate = satellite.attitude * satellite.angular_velocity(one);
    let arm = chaser.position - satellite.position;
    let slip = chaser.velocity(other) - satellite.velocity(one) - rate.cross(&arm);
    assert!(slip.norm() < 1e-6, "{slip}");
    let twist = chaser.attitude * chaser.angular_velocity(other) - rate;
    assert!(twist.norm() < 1e-9, "{twist}");

    // The rest of it, planned anew on the way, is the rest of the plan.
    let step = 60;
    let rest = scene
        .transfer_from(plan.states[step], 240 - step)
        .unwrap()
        .unwrap();
    let rest = solve(&rest, Start::Cold, &NewtonSettings::default(), |_| true).unwrap();
    for (one, other) in plan.states[step..].iter().zip(&rest.states) {
        assert!((one.position - other.position).norm() < 1e-3);
    }
}

/// The share of the ensemble's flights along a plan and its feedback that are inside a sphere at the end of each step.
fn inside(scene: &Scene, plan: &Plan, radius: f64) -> Vec<f64> {
    let ensemble = scene.ensemble.as_ref().unwrap();
    let body = scene.maneuver.as_ref().unwrap().body;
    let mut counts = vec![0_u64; plan.controls.len()];
    for index in 0..ensemble.samples {
        let sample = ensemble.sample(index);
        let (system, states) = sample.system(scene).unwrap();
        let bodies = system.bodies().to_vec();
        let scheme = scene.scheme().unwrap();
        let mut flight = scene.simulation_of(bodies, states, scheme).unwrap();
        let mut loads = vec![Load::default(); scene.bodies.len()];
        for (k, count) in counts.iter_mut().enumerate() {
            let bodies = [&flight.system().bodies()[body], &scene.bodies[body].body];
            let off = miss(&plan.states[k], &flight.states()[body].of_other(bodies));
            let change = plan.feedback[k] * off;
            let control = plan.controls[k];
            let load = Load {
                force: control.force - change.fixed_rows::<3>(0),
                moment: control.moment - change.fixed_rows::<3>(3),
            };
            loads[body] = sample.actuators.apply(&load);
            flight.advance(&loads).unwrap();
            *count += u64::from(flight.states()[body].position.norm() < radius);
        }
    }
    let share = |count: &u64| *count as f64 / ensemble.samples as f64;
    counts.iter().map(share).collect()
}

/// Every hard limit of the inspection holds along whole steps, and only the Sun in the camera has a price.
#[test]
fn the_inspector_pays_for_the_sun_in_its_camera() {
    let scene = shipped("inspection");
    let plan = plan(&scene);
    let certificate = &plan.certificate;
    assert!(certificate.sufficient && certificate.inequality < 1e-7);
    assert!(
        (0.06..0.08).contains(&certificate.priced),
        "{certificate:?}"
    );
    let price = scene.maneuver.as_ref().unwrap().constraints[5].price();
    // At most the largest violation, in each of the 51 steps in which there is one.
    let most = 51.0 * plan.h * price.unwrap() * certificate.priced;
    assert!((0.3 * most..most).contains(&plan.paid), "{}", plan.paid);
    let dearer = changed("inspection", "price = 0.0005", "price = 0.002").unwrap();
    let dearer = self::plan(&dearer);
    assert!(dearer.certificate.priced < 0.5 * certificate.priced);
    assert!(dearer.cost > plan.cost);
}

/// Ten thousand flights of the ensemble violate the constraint as rarely as its confidence promises, and nearly as often.
#[test]
fn the_chaser_keeps_the_distance_that_its_deviations_need() {
    let line = "position = 1.0 ";
    let heavier = format!("mass = 0.03\ninertia = 0.03\n{line}");
    for scene in [
        shipped("uncertain_flyaround"),
        changed("uncertain_flyaround", line, &heavier).unwrap(),
    ] {
        let rates = inside(&scene, &plan(&scene), 30.0);
        let largest = rates.iter().copied().fold(0.0, f64::max);
        let error = 3.0 * (0.01_f64 * 0.99 / 1e4).sqrt();
        assert!(largest <= 0.01 + error, "{largest}");
        assert!(largest >= 0.005, "{largest}");
    }
    let blind = "feedback = false\n";
    let nominal = changed(
        "uncertain_flyaround",
        "feedback = true\nconfidence = 0.99\n",
        blind,
    );
    let nominal = nominal.unwrap();
    let open_loop = Plan {
        feedback: vec![nalgebra::SMatrix::zeros(); nominal.steps as usize],
        ..plan(&nominal)
    };
    let rates = inside(&nominal, &open_loop, 30.0);
    let largest = rates.iter().copied().fold(0.0, f64::max);
    assert!(largest > 0.3, "{largest}: the constraint is idle");
}

#[test]
fn confidences_that_cannot_be_kept_are_refused_with_their_key() {
    for (line, instead, expected) in [
        ("confidence = 0.99", "confidence = 1.0", "a probability"),
        ("confidence = 0.99", "confidence = 0.3", "a probability"),
        (
            "motion = \"translation\"\nfeedback = true\nconfidence = 0.99\n",
            "motion = \"translation\"\nconfidence = 0.9\nfinal_time = { min = 100.0, minimize = \"time\" }\n\
             [[maneuver.constraints]]\nkind = \"force_norm\"\nlimit = 5.0\n",
            "beside a `final_time` that minimizes the time",
        ),
        (
            "confidence = 0.99",
            "confidence = 0.9\nreplan = { every = 10, deadline = 1.0 }",
            "beside `replan`",
        ),
        (
            "kind = \"keep_out_sphere\"\ncenter = [0.0, 0.0, 0.0]\nradius = 30.0",
            "kind = \"force_norm\"\nlimit = 5",
            "a constraint on states",
        ),
    ] {
        let refused = changed("uncertain_flyaround", line, instead).expect_err(instead);
        assert!(refused.contains(expected), "{instead}: {refused}");
    }
    let replan = "replan = { every = 18, deadline = 4.0 }";
    let refused = changed("tumbling_replan", replan, "confidence = 0.9").expect_err("deviates");
    assert!(
        refused.contains("that `disturbance` leaves alone"),
        "{refused}"
    );
    let refused = changed(
        "docking_corridor",
        "[maneuver]",
        "[maneuver]\nconfidence = 0.9",
    );
    assert!(
        refused
            .expect_err("no deviations")
            .contains("`ensemble` or `disturbance`")
    );
}
