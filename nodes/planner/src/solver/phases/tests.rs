use serde_json::Value;

use lgvi_scene::Scene;

use super::super::{End, Initial, Task, solve};
use super::*;

fn reference() -> Value {
    let text = include_str!("../../../../../tests/truth/phases.json");
    let mut all: Value = serde_json::from_str(text).unwrap();
    all["search"].take()
}

/// The problem of the reference, with these durations of its phases.
fn scene(durations: [&str; 3]) -> Scene {
    with(durations, "", "")
}

/// With further keys of the maneuver, and further tables.
fn with(durations: [&str; 3], keys: &str, tables: &str) -> Scene {
    let case = reference();
    let [start, end, phases] = ["start", "end", "phases"].map(|key| &case[key]);
    let ball = &phases[1]["keep_in_sphere"];
    let of = |key: &str| case[key].as_f64().unwrap();
    let (duration, steps) = (of("T"), of("N"));
    let mass = of("mass");
    let speed = phases[2]["speed"].as_f64().unwrap();
    let [first, second, third] = durations;
    let text = format!(
        r#"
        title = "Approach, hold, dock"
        [run]
        duration = {duration:?}
        steps = {steps}
        integrator = "lgvi"
        [[bodies]]
        name = "craft"
        mass = {mass:?}
        inertia = [1, 1, 1]
        position = {}
        velocity = {}
        attitude = {{ w = 1, x = 0, y = 0, z = 0 }}
        angular_velocity = [0, 0, 0]
        [maneuver]
        body = "craft"
        motion = "translation"
        {keys}
        actuators = [{{ force = [1, 0, 0] }}, {{ force = [0, 1, 0] }}, {{ force = [0, 0, 1] }}]
        [maneuver.target]
        position = {}
        velocity = {}
        [[maneuver.phases]]
        name = "approach"
        {first}
        [[maneuver.phases]]
        name = "hold"
        {second}
        constraints = [{{ kind = "keep_in_sphere", center = {}, radius = {} }}]
        [[maneuver.phases]]
        name = "dock"
        {third}
        off = [2]
        constraints = [{{ kind = "speed", limit = {speed:?} }}]
        {tables}
        "#,
        start[0], start[1], end[0], end[1], ball[0], ball[1]
    );
    Scene::parse("test", &text).unwrap()
}

/// The ranges of the reference.
fn free() -> Scene {
    let case = reference();
    let h = case["T"].as_f64().unwrap() / case["N"].as_f64().unwrap();
    let ranges = [0, 1, 2].map(|phase| {
        let range = &case["phases"][phase]["range"];
        let [min, max] = [0, 1].map(|end| h * range[end].as_f64().unwrap());
        format!("duration = {{ min = {min:?}, max = {max:?} }}")
    });
    scene([&ranges[0], &ranges[1], &ranges[2]])
}

fn task(scene: &Scene, switches: Option<Vec<u64>>) -> Task {
    Task {
        first_step: 0,
        initial: Initial::State(scene.bodies[scene.maneuver.as_ref().unwrap().body].state),
        end: End::After(scene.steps as usize),
        guess: None,
        switches,
    }
}

fn planned(scene: &Scene, switches: Option<Vec<u64>>) -> Result<Solved, Unsolved> {
    solve(scene, &task(scene, switches), &mut |_| true)
}

/// IPOPT has solved the problem for all schedules, with constraints at the ends of steps only. Between them it is dearer by a few
/// thousandths.
#[test]
fn the_search_finds_the_best_of_all_schedules() {
    let scene = free();
    let case = reference();
    let all = case["costs"].as_array().unwrap();
    let number = |value: &Value| value.as_u64().unwrap();
    let mut found = Vec::new();
    for row in all {
        let switches = vec![number(&row[0]), number(&row[1])];
        let planned = planned(&scene, Some(switches.clone()));
        match row[2].as_f64() {
            Some(cost) => {
                let own = planned.unwrap().plan.cost;
                let dearer = own / cost - 1.0;
                assert!(
                    (-1e-6..0.02).contains(&dearer),
                    "{switches:?}: {own} for {cost}"
                );
                found.push((own, switches));
            }
            None => assert!(planned.is_err(), "{switches:?}"),
        }
    }
    let least = found.iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    let by_ipopt = all.iter().filter(|row| row[2].is_f64());
    let by_ipopt = by_ipopt
        .min_by(|a, b| a[2].as_f64().unwrap().total_cmp(&b[2].as_f64().unwrap()))
        .unwrap();
    assert_eq!(least.1, [0, 1].map(|at| number(&by_ipopt[at])));
    let solved = planned(&scene, None).unwrap();
    println!("{}", solved.remark);
    assert_eq!(solved.phased.switches, least.1);
    assert!((solved.plan.cost / least.0 - 1.0).abs() < 1e-6);
    assert!(solved.phased.schedules < all.len() as u32);
    assert!(
        solved.remark.contains("`hold` lasts from step 11 to 15"),
        "{}",
        solved.remark
    );
    let again = planned(&scene, None).unwrap();
    assert!(again.plan.commands == solved.plan.commands && again.phased == solved.phased);
}

/// Phases that move a bound of their neighbors only, and several at once where one between has a fixed length.
#[test]
fn neighbors_keep_to_their_ranges() {
    let scene = scene(["duration = { min = 1.25, max = 4.0 }", "duration = 1.0", ""]);
    let maneuver = scene.maneuver.as_ref().unwrap();
    let of = |at: [u64; 2], stride| neighbors(maneuver, 24, &at, stride);
    assert_eq!(of([10, 14], 2), [[12, 16], [8, 12]]);
    assert_eq!(of([5, 9], 2), [[7, 11]]);
    assert_eq!(of([15, 19], 4), [[16, 20], [11, 15]]);
    let all = free();
    let maneuver = all.maneuver.as_ref().unwrap();
    let all = neighbors(maneuver, 24, &[8, 12], 1);
    assert_eq!(all, [[7, 12], [9, 13], [7, 11], [8, 13]]);
}

#[test]
fn what_no_schedule_reaches_says_why_and_what_is_stopped_stops() {
    let scene = free();
    let mut seen = 0;
    let stopped = solve(&scene, &task(&scene, None), &mut |_| {
        seen += 1;
        seen < 3
    });
    assert_eq!((stopped.unwrap_err().reason, seen), (Reason::Cancelled, 3));
    let later = Task {
        first_step: 4,
        end: End::After(20),
        ..task(&scene, None)
    };
    let refused = solve(&scene, &later, &mut |_| true).unwrap_err();
    assert_eq!(refused.reason, Reason::Refused);
    assert!(refused.message.contains("keeps those of an earlier one"));
}

/// Two spheres that exclude each other, and a phase without the force that its sphere asks for.
#[test]
fn phases_that_contradict_each_other_are_told_by_name() {
    let fixed = ["duration = 2.5", "duration = 1.0", ""];
    let mut scene = scene(fixed);
    let told = |scene: &Scene| planned(scene, None).unwrap_err();
    let maneuver = scene.maneuver.as_mut().unwrap();
    maneuver.phases[0].off = vec![0, 1];
    let weak = told(&scene);
    assert_eq!(weak.reason, Reason::Infeasible, "{}", weak.message);
    let expected =
        "violates keep_in_sphere of phase `hold` (maneuver.phases[1].constraints[0]) by ";
    assert!(weak.message.contains(expected), "{}", weak.message);
    let maneuver = scene.maneuver.as_mut().unwrap();
    maneuver.phases[1].off = vec![0, 1, 2];
    let weak = told(&scene);
    let expected = "exert 0 of 3 independent forces and moments";
    assert!(weak.message.contains(expected), "{}", weak.message);
}

const FIXED: [&str; 3] = ["duration = 2.75", "duration = 1.0", ""];

/// A search and constraints that hold with a probability go with phases of fixed lengths.
#[test]
fn a_search_and_a_confidence_go_with_phases() {
    let plain = planned(&scene(FIXED), None).unwrap().plan;
    let searched = planned(&with(FIXED, "search = { starts = 4 }", ""), None).unwrap();
    assert!(searched.plan.cost <= plain.cost * (1.0 + 1e-7));
    assert_eq!(searched.phased.switches, [11, 15]);
    let deviations = "[disturbance]\nseed = 1\nposition = 0.02\nvelocity = 0.01";
    let sure = with(FIXED, "confidence = 0.95\nfeedback = true", deviations);
    let sure = planned(&sure, None).unwrap().plan;
    assert!(
        sure.cost > plain.cost * 1.001,
        "{} {}",
        sure.cost,
        plain.cost
    );
    let ball = |plan: &Plan| {
        let center = nalgebra::Vector3::new(-1.2, 0.3, 0.0);
        let out = plan.states[11..=15]
            .iter()
            .map(|state| (state.position - center).norm());
        out.fold(0.0, f64::max)
    };
    // The plan keeps a distance from the sphere's surface that its deviations need.
    assert!(
        ball(&plain) > 0.2499 && ball(&sure) < 0.24,
        "{}",
        ball(&sure)
    );
}

/// The rest of a plan in flight begins its phases as planned, from a state that is a little off.
#[test]
fn a_plan_in_flight_keeps_the_phases() {
    let scene = free();
    let whole = crate::plan(&scene, &mut |_| true).unwrap();
    assert_eq!(whole.switches(), [11, 15]);
    for step in [5, 13, 18] {
        let mut state = whole.solution().states[step];
        state.position.x += 1e-3;
        let rest = crate::plan_rest(&scene, (step as u64, state), Some(&whole), &mut |_| true);
        let rest = rest.unwrap();
        assert_eq!((rest.switches(), rest.arrival()), (whole.switches(), 24));
        let commands = rest
            .solution()
            .commands
            .iter()
            .skip(15_usize.saturating_sub(step));
        assert!(commands.into_iter().all(|command| command[2] == 0.0));
        let apart = rest
            .solution()
            .states
            .iter()
            .zip(&whole.solution().states[step..]);
        let farthest = apart.map(|(one, other)| (one.position - other.position).norm());
        assert!(farthest.fold(0.0, f64::max) < 0.02);
    }
}

/// A wheel that rests in a phase is commanded nothing there, and the others bring the body to its target.
#[test]
fn wheels_rest_in_a_phase() {
    let text = include_str!("../../../../../scenes/wheel_slew_plan.toml");
    let text = text.replace("steps = 600", "steps = 120");
    let text = text.replace("max_speed = 220.0", "max_speed = 600.0").replace(
        "[maneuver.target]",
        "phases = [{ name = \"turn\", duration = 20.0 }, { name = \"rest\", duration = 20.0, off = [\"wheel_2\"] }, { name = \"stop\" }]\n\
         [maneuver.target]",
    );
    let scene = Scene::parse("test", &text).unwrap();
    let solved = planned(&scene, None).unwrap();
    assert_eq!(solved.phased.switches, [40, 80]);
    assert!(solved.plan.certificate.terminal < 1e-9);
    let [rest, others] = [40..80, 0..40].map(|steps| solved.plan.commands[steps].iter());
    assert!(rest.into_iter().all(|command| command[1] == 0.0));
    assert!(others.into_iter().any(|command| command[1] != 0.0));
}
