//! Planning in flight and on demand.

use std::time::{Duration, Instant};

use lgvi_middleware::ros::{ActionClient, GoalId, GoalOutcome, GoalState, Qos};
use lgvi_msgs::action::{PlanManeuver, PlanManeuverGoal, PlanManeuverResult};
use lgvi_msgs::msg::{ControlSequence, SystemState};
use lgvi_tests::{
    Process, Recording, Signal, Summary, World, edited, eventually, optimal_cost, scene,
};

const ACTION: &str = "/lgvi_planner/plan_maneuver";

/// How long the planner has to answer.
const ANSWER: Duration = Duration::from_secs(20);

/// How long it has to end what nobody wants any more, on a machine that has much else to do; the plan would take longer.
const AT_ONCE: Duration = Duration::from_secs(10);

/// A flight of 3.6 s in real time.
const SHORT: (&str, &str) = ("time = \"10 s\"", "time = \"4 s\"");

/// Without planning anew, which leaves the feedback.
const ONCE: (&str, &str) = ("replan = {", "# replan = {");

fn miss(summary: &Summary) -> f64 {
    summary.flight.as_ref().unwrap().miss.as_ref().unwrap().norm
}

#[test]
fn a_disturbed_flight_planned_anew_arrives_nearer_than_in_open_loop() {
    let world = World::new();
    let replanned = edited(&world, "inclination_replan", &[SHORT]);
    let (corrected, bag) = world.fly(&replanned, "corrected");
    let plans = corrected.replanned.as_ref().unwrap();
    assert!(plans.published >= 1, "{plans:?}");
    assert_eq!(plans.replans.len() as u64, plans.published + plans.kept);
    for plan in &plans.replans {
        let ahead = plan.step < plan.first_step && plan.seconds > 0.0;
        assert!(ahead, "{plan:?}");
    }
    let verdict = world.verify(&bag, 0);
    assert_eq!(verdict.difference.map(|difference| difference.step), None);
    assert_eq!(
        (verdict.states, verdict.sequences as u64),
        (501, plans.published + 1)
    );

    let open = [ONCE, ("feedback = true", "feedback = false")];
    let (open, _) = world.fly(&edited(&world, "inclination_replan", &open), "open");
    assert!(open.replanned.is_none());
    // Measured: 8.9e-4 against 4.8e-2.
    assert!(
        miss(&corrected) < 0.1 * miss(&open),
        "{} with correction, {} without",
        miss(&corrected),
        miss(&open)
    );
}

#[test]
fn without_a_plan_in_time_the_old_one_is_flown() {
    let world = World::new();
    let (once, _) = world.fly(
        &edited(&world, "inclination_replan", &[SHORT, ONCE]),
        "once",
    );
    let hasty = [SHORT, ("deadline = 0.2", "deadline = 1e-6")];
    let hasty = edited(&world, "inclination_replan", &hasty);
    let (late, bag) = world.fly(&hasty, "late");
    let plans = late.replanned.as_ref().unwrap();
    assert!(plans.published == 0 && plans.kept >= 1, "{plans:?}");
    assert_eq!(plans.replans.len() as u64, plans.kept);
    assert!(
        plans.replans.iter().all(|plan| plan.kept.is_some()),
        "{plans:?}"
    );
    assert_eq!(miss(&late), miss(&once));
    let verdict = world.verify(&bag, 0);
    assert!(verdict.difference.is_none(), "{verdict:?}");
    assert_eq!(
        (verdict.states, verdict.sequences),
        (501, 1),
        "the old plan alone is flown"
    );
}

/// A planner that waits for goals, and a client of it.
fn planner(world: &World, scene: &std::path::Path) -> (Process, ActionClient<PlanManeuver>) {
    let scene = format!("scene:={}", scene.display());
    let planner = world.node("planner", &[&scene, "plan_at_start:=false"]);
    planner.await_ready();
    (planner, client(world))
}

fn client(world: &World) -> ActionClient<PlanManeuver> {
    let client = world
        .ros_node("client")
        .action_client::<PlanManeuver>(ACTION)
        .unwrap();
    assert!(client.wait_for_server(ANSWER), "no action server");
    client
}

fn send(client: &ActionClient<PlanManeuver>, goal: PlanManeuverGoal) -> GoalId {
    client.send_goal(goal, ANSWER).unwrap()
}

#[track_caller]
fn ends(
    client: &ActionClient<PlanManeuver>,
    goal: GoalId,
    state: GoalState,
    reason: u8,
) -> PlanManeuverResult {
    let GoalOutcome {
        state: found,
        result,
    } = client.result(goal, ANSWER).unwrap();
    assert_eq!(
        (found, result.reason),
        (state, reason),
        "{}",
        result.message
    );
    assert_eq!(result.success, reason == PlanManeuverResult::NONE);
    assert_eq!(result.message.is_empty(), result.success);
    result
}

#[test]
fn a_goal_is_planned_with_feedback_and_its_plan_published() {
    let world = World::new();
    let (planner, client) = planner(&world, &scene("inclination_change"));
    let observer = world.ros_node("observer");
    let controls = observer
        .subscription::<ControlSequence>("/lgvi_planner/control_sequence", &Qos::latched(1))
        .unwrap();
    let goal = send(&client, PlanManeuverGoal::default());
    let result = ends(
        &client,
        goal,
        GoalState::Succeeded,
        PlanManeuverResult::NONE,
    );
    let reference = optimal_cost("C_i", 1000);
    assert!(
        (result.cost / reference - 1.0).abs() < 1e-9,
        "{}",
        result.cost
    );
    assert!(result.violation <= 1e-12 && result.sufficient, "{result:?}");
    assert_eq!(result.controls.force.len(), 1000);
    assert!((result.duration - 0.902_976).abs() < 1e-12);
    let published = eventually("the published sequence", || controls.take().unwrap());
    assert_eq!(published.message, result.controls);
    let feedback = client.feedback(goal, ANSWER).unwrap().expect("feedback");
    assert!(!feedback.phase.is_empty() && feedback.violation.is_finite());

    // Nobody flies: there is no state to plan from.
    let later = PlanManeuverGoal {
        first_step: 500,
        ..PlanManeuverGoal::default()
    };
    let refused = send(&client, later);
    let result = ends(
        &client,
        refused,
        GoalState::Aborted,
        PlanManeuverResult::REFUSED,
    );
    assert!(result.message.contains("no state"), "{}", result.message);
    planner.stop().expect(0);
}

/// A maneuver so long that its plan takes many seconds.
fn endless(world: &World) -> std::path::PathBuf {
    edited(
        world,
        "inclination_change",
        &[("steps = 1000", "steps = 1000000")],
    )
}

#[test]
fn goals_that_take_long_are_cancelled_replaced_and_ended_at_once() {
    let world = World::new();
    let (planner, client) = planner(&world, &endless(&world));
    let first = send(&client, PlanManeuverGoal::default());
    assert!(client.feedback(first, ANSWER).unwrap().is_some());
    let start = Instant::now();
    client.cancel(first, ANSWER).unwrap();
    ends(
        &client,
        first,
        GoalState::Canceled,
        PlanManeuverResult::CANCELLED,
    );
    assert!(start.elapsed() < AT_ONCE, "{:?}", start.elapsed());

    let second = send(&client, PlanManeuverGoal::default());
    assert!(client.feedback(second, ANSWER).unwrap().is_some());
    let limited = PlanManeuverGoal {
        deadline: 0.3,
        ..PlanManeuverGoal::default()
    };
    let start = Instant::now();
    let third = send(&client, limited);
    let result = ends(
        &client,
        second,
        GoalState::Aborted,
        PlanManeuverResult::CANCELLED,
    );
    assert!(result.message.contains("newer goal"), "{}", result.message);
    ends(
        &client,
        third,
        GoalState::Aborted,
        PlanManeuverResult::DEADLINE,
    );
    assert!(start.elapsed() < AT_ONCE, "{:?}", start.elapsed());

    send(&client, PlanManeuverGoal::default());
    let start = Instant::now();
    planner.signal(Signal::SIGTERM);
    planner.finish().expect(0);
    assert!(start.elapsed() < AT_ONCE, "{:?}", start.elapsed());
}

#[test]
fn what_cannot_be_reached_fails_with_the_reason() {
    let world = World::new();
    // The wheels are too weak for the slew in its time.
    let weak = edited(
        &world,
        "slew_keep_out",
        &[("limit = 0.5 ", "limit = 0.05 ")],
    );
    let (planner, client) = planner(&world, &weak);
    let goal = send(&client, PlanManeuverGoal::default());
    let result = ends(
        &client,
        goal,
        GoalState::Aborted,
        PlanManeuverResult::INFEASIBLE,
    );
    assert!(
        result.message.contains("no feasible plan was found"),
        "{}",
        result.message
    );
    planner.stop().expect(0);

    let flight = world.start_flight(&weak, "flight", &[]).finish().expect(1);
    flight.says(&["no plan", "no feasible plan was found"]);
}

#[test]
fn a_goal_in_flight_takes_over_at_its_step() {
    let world = World::new();
    let arguments = ["--real-time-factor", "0.2"];
    let flight = world.start_flight(&scene("inclination_change"), "flight", &arguments);
    world.await_step(50);
    let client = client(&world);
    let goal = PlanManeuverGoal {
        first_step: 800,
        warm: true,
        ..PlanManeuverGoal::default()
    };
    let goal = send(&client, goal);
    let result = ends(
        &client,
        goal,
        GoalState::Succeeded,
        PlanManeuverResult::NONE,
    );
    assert_eq!(
        (result.controls.first_step, result.controls.force.len()),
        (800, 200)
    );
    let summary: Summary = flight.finish().expect(0).json();
    assert_eq!(summary.recorded["/lgvi_propagator/flown_control"], 2);
    // From where the first plan leads the second leads to the same end.
    assert!(miss(&summary) < 1e-9, "{}", miss(&summary));
    assert_eq!(world.verify(&world.path("flight"), 0).sequences, 2);
}

#[test]
fn scenes_of_other_classes_fly_as_planned() {
    let world = World::new();
    for (name, states) in [("slew_keep_out", 301), ("docking_corridor", 301)] {
        let (summary, bag) = world.fly(&scene(name), name);
        assert!(miss(&summary) < 1e-9, "{name}: {}", miss(&summary));
        let plan = summary.plan.unwrap().cost;
        let flown = summary.flight.unwrap().cost.unwrap();
        assert!(
            (flown / plan - 1.0).abs() < 1e-9,
            "{name}: {flown} for {plan}"
        );
        world.verify_agrees(&bag, states);
    }
}

/// A mass of 2 moves by 3.4 with a force of at most 1.5 in `2 √(3.4 · 2/1.5)`, which is no whole number of steps of 0.1.
#[test]
fn the_shortest_time_is_flown_in_steps_of_adjusted_length() {
    let world = World::new();
    let dash = world.path("dash.toml");
    let text = "title = \"A dash\"\n[run]\nduration = 8.0\nsteps = 80\nintegrator = \"lgvi\"\n\
        [[bodies]]\nname = \"craft\"\nmass = 2.0\ninertia = [1, 1, 1]\nposition = [0, 0, 0]\nvelocity = [0, 0, 0]\n\
        attitude = { w = 1, x = 0, y = 0, z = 0 }\nangular_velocity = [0, 0, 0]\n\
        [maneuver]\nbody = \"craft\"\nmotion = \"translation\"\n\
        final_time = { min = 1.0, minimize = \"time\" }\n\
        constraints = [{ kind = \"force_norm\", limit = 1.5 }]\n\
        [maneuver.target]\nposition = [3.4, 0, 0]\nvelocity = [0, 0, 0]\n";
    std::fs::write(&dash, text).unwrap();
    let exact = 2.0 * (3.4 * 2.0 / 1.5_f64).sqrt();
    let mut steps = Vec::new();
    let fitted = "--fit-duration";
    for (arguments, excess) in [
        (&[][..], 0.004..0.03),
        (&[fitted], 0.0..0.002),
        (
            &[fitted, "--set", "maneuver.final_time.max=7.97"],
            0.0..0.002,
        ),
    ] {
        let bag = format!("flight_{}", arguments.len());
        let flight = world.start_flight(&dash, &bag, arguments);
        let summary: Summary = flight.finish().expect(0).json();
        assert!(miss(&summary) < 1e-9, "{}", miss(&summary));
        let recording = Recording::read(&world.path(&bag));
        let flown: Vec<ControlSequence> = recording.messages("/lgvi_propagator/flown_control");
        let time = flown[0].force.len() as f64 * flown[0].step_size;
        assert!(excess.contains(&(time / exact - 1.0)), "{time} for {exact}");
        world.verify_agrees(&world.path(&bag), 81);
        steps.push(flown[0].force.len());
    }
    assert_eq!(steps, [steps[0]; 3]);

    let late = [fitted, "--set", "maneuver.final_time.max=2.0"];
    for (scene, arguments, code, told) in [
        (
            &scene("docking_corridor"),
            &late[..1],
            2,
            "minimizes no time",
        ),
        (&dash, &late[..], 1, "no plan"),
    ] {
        let refused = world.start_flight(scene, "refused", arguments);
        let refused = refused.finish().expect(code);
        assert!(refused.stderr.contains(told), "{}", refused.stderr);
    }
}

/// The run goes on after the arrival, which is what counts.
#[test]
fn a_duration_that_is_found_is_flown_to_its_end() {
    let world = World::new();
    let motion = "motion = \"translation\"";
    let free = format!("{motion}\nfinal_time = {{ min = 150.0, weight = 5.0 }}");
    let changes = [
        (motion, &*free),
        ("limit = 2.5 ", "limit = 25.0 "),
        (
            "position = [0.0, 0.0, 0.0]\nvelocity = [0.0,",
            "position = [0.0, 0.0, 0.0]\nvelocity = [0.01,",
        ),
    ];
    let scene = edited(&world, "docking_corridor", &changes);
    let (summary, bag) = world.fly(&scene, "flight");
    assert!(miss(&summary) < 1e-9, "{}", miss(&summary));
    let recording = Recording::read(&bag);
    let flown: Vec<ControlSequence> = recording.messages("/lgvi_propagator/flown_control");
    let steps = flown[0].force.len();
    assert!((151..300).contains(&steps), "{steps}");
    let last: Vec<SystemState> = recording.messages("/lgvi_propagator/state");
    assert_eq!(last.len(), 301);
    // It leaves the port with the speed that it has there.
    let away = 0.01 * (300 - steps) as f64;
    assert!((last[300].bodies[0].position[0] - away).abs() < 1e-6);
}
