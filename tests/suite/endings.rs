//! Every node ends within a second of SIGINT or SIGTERM, whatever it is at, and nothing of it is left.

use std::path::{Path, PathBuf};
use std::time::Duration;

use lgvi_common::Event;
use lgvi_msgs::action::{PlanManeuver, PlanManeuverGoal};
use lgvi_msgs::lifecycle_msgs::srv::{ChangeState, ChangeStateRequest};
use lgvi_tests::{
    PATIENCE, Process, Recording, Signal, World, assert_gone, await_node, await_stall, edited,
    scene,
};

/// What is promised.
const LIMIT: Duration = Duration::from_secs(1);

/// A machine that is busy with other things may be slow, but not every time.
const ATTEMPTS: usize = 3;

const PROPAGATOR: &str = "/lgvi_propagator";
const STATE: &str = "/lgvi_propagator/state";

/// A node in the state that it is to be ended in, and who else is there.
struct Scenario {
    node: Process,
    others: Vec<Process>,
    /// The exit code that it ends with.
    code: i32,
}

impl From<Process> for Scenario {
    fn from(node: Process) -> Self {
        Self {
            node,
            others: Vec::new(),
            code: 0,
        }
    }
}

/// Ends a node in a state that `reach` brings about, and looks for what is left of it.
#[track_caller]
fn ends<S: Into<Scenario>>(what: &str, name: &str, reach: impl Fn(&World) -> S) {
    let mut times = Vec::new();
    for (attempt, signal) in [Signal::SIGINT, Signal::SIGTERM]
        .into_iter()
        .cycle()
        .enumerate()
    {
        let world = World::new();
        let observer = world.ros_node("observer");
        let Scenario {
            mut node,
            others,
            code,
        } = reach(&world).into();
        await_node(&observer, name);
        assert!(node.runs(), "{what}");
        let (finished, time) = node.end(signal);
        finished.expect(code);
        assert_gone(&observer, name);
        for other in others {
            other.signal(Signal::SIGCONT);
            // RustDDS 0.15 does not always survive to have been suspended.
            other.stop();
        }
        assert_eq!(world.shared_memory(), Vec::<PathBuf>::new(), "{what}");
        assert_eq!(world.locks(), Vec::<PathBuf>::new(), "{what}");
        times.push(time);
        if time <= LIMIT {
            break;
        }
        assert!(
            attempt + 1 < ATTEMPTS,
            "{what}: took {times:?}, expected {LIMIT:?} at most"
        );
    }
    lgvi_tests::note(&format!("{what}: {times:?}"));
}

fn parameter(name: &str, path: &Path) -> String {
    format!("{name}:={}", path.display())
}

fn propagator(world: &World, scene: &Path, parameters: &[&str]) -> Process {
    let scene = parameter("scene", scene);
    let mut all = vec![scene.as_str()];
    all.extend(parameters);
    let propagator = world.node("propagator", &all);
    propagator.await_ready();
    propagator
}

fn recorder(world: &World) -> Process {
    let recorder = world.node("recorder", &[&parameter("output", &world.path("bag"))]);
    recorder.await_ready();
    recorder
}

/// A flight without a maneuver, of so many steps that it does not end by itself, each published.
fn endless_flight(world: &World) -> PathBuf {
    let changes = [
        ("duration = 100.0", "duration = 1e6"),
        ("steps = 10000", "steps = 100000000"),
        ("ros_every = 100", "ros_every = 1"),
    ];
    edited(world, "free_body", &changes)
}

/// A maneuver so long that its plan takes many seconds.
fn endless_plan(world: &World) -> PathBuf {
    let steps = ("steps = 1000", "steps = 1000000");
    edited(world, "inclination_change", &[steps])
}

fn flies(propagator: &Process, step: u64) {
    propagator.await_event("flying", |event| {
        matches!(event, Event::Flying { step: now } if *now >= step).then_some(())
    });
}

#[test]
fn a_propagator_that_nobody_has_configured_or_activated() {
    let unmanaged = |world: &World| {
        let scene = parameter("scene", &scene("free_body"));
        world.node("propagator", &[&scene, "autostart:=false"])
    };
    ends("propagator, unconfigured", PROPAGATOR, |world| {
        let propagator = unmanaged(world);
        await_node(&world.ros_node("other"), PROPAGATOR);
        propagator
    });
    ends("propagator, inactive", PROPAGATOR, |world| {
        let propagator = unmanaged(world);
        let manager = world.ros_node("manager");
        let client = manager
            .service_client::<ChangeState>("/lgvi_propagator/change_state")
            .unwrap();
        let mut configure = ChangeStateRequest::default();
        configure.transition.id = 1;
        assert!(client.call(&configure, PATIENCE).unwrap().success);
        propagator
    });
}

#[test]
fn a_propagator_on_its_way_to_a_large_scene() {
    ends("propagator, configuring 1024 bodies", PROPAGATOR, |world| {
        let text = std::fs::read_to_string(scene("free_body")).unwrap();
        let (head, body) = text.split_at(text.find("[[bodies]]").unwrap());
        let bodies: String = (0..1024)
            .map(|index| body.replace("\"body\"", &format!("\"body{index}\"")))
            .collect();
        let path = world.path("large.toml");
        std::fs::write(&path, format!("{head}{bodies}")).unwrap();
        world.node("propagator", &[&parameter("scene", &path)])
    });
}

/// Fast DDS would list the endpoints until the lease has run out, 50 s later.
#[test]
fn real_ros_2_sees_the_node_and_its_endpoints_go() {
    let world = World::new();
    let propagator = propagator(&world, &scene("free_body"), &["await_subscribers:=9"]);
    let peer = world.ros_python("ros2_peer.py", &["departure", PROPAGATOR]);
    peer.await_stderr("matched");
    propagator.stop().expect(0);
    let listed: f64 = peer.finish().expect(0).stdout.trim().parse().unwrap();
    assert!(listed < LIMIT.as_secs_f64(), "{listed} s");
}

#[test]
fn a_propagator_that_waits() {
    let maneuver = scene("inclination_change");
    ends("propagator, waiting for a control", PROPAGATOR, |world| {
        propagator(world, &maneuver, &[])
    });
    ends("propagator, waiting for subscribers", PROPAGATOR, |world| {
        propagator(world, &maneuver, &["await_subscribers:=9"])
    });
}

#[test]
fn a_propagator_in_flight_and_after_it() {
    ends("propagator, flying in real time", PROPAGATOR, |world| {
        let propagator = propagator(world, &endless_flight(world), &[]);
        flies(&propagator, 10);
        propagator
    });
    ends("propagator, after the end", PROPAGATOR, |world| {
        let propagator = propagator(world, &scene("free_body"), &["real_time_factor:=0.0"]);
        propagator.await_flown();
        propagator
    });
}

/// Both over DDS and over shared memory. As fast as possible the flight waits for the subscriber.
fn with_a_suspended_subscriber(world: &World, factor: &str, waits: bool) -> Scenario {
    let recorder = recorder(world);
    let node = propagator(
        world,
        &endless_flight(world),
        &["await_subscribers:=1", factor],
    );
    flies(&node, 100);
    recorder.suspend();
    if waits {
        await_stall(world, STATE);
    } else {
        flies(&node, 200);
    }
    let others = vec![recorder];
    Scenario {
        node,
        others,
        code: 0,
    }
}

#[test]
fn a_propagator_whose_subscriber_is_suspended() {
    for (factor, waits) in [
        ("real_time_factor:=0.0", true),
        ("real_time_factor:=1.0", false),
    ] {
        let what = format!("propagator, {factor}, with a suspended subscriber");
        ends(&what, PROPAGATOR, |world| {
            with_a_suspended_subscriber(world, factor, waits)
        });
    }
}

#[test]
fn a_planner_that_plans_or_has_failed() {
    let name = "/lgvi_planner";
    ends("planner, solving", name, |world| {
        let planner = world.node("planner", &[&parameter("scene", &endless_plan(world))]);
        planner.await_event("planning", |event| {
            matches!(event, Event::Planning(_)).then_some(())
        });
        planner
    });
    ends("planner, with a goal under way", name, |world| {
        let scene = parameter("scene", &endless_plan(world));
        let planner = world.node("planner", &[&scene, "plan_at_start:=false"]);
        planner.await_ready();
        let client = world
            .ros_node("client")
            .action_client::<PlanManeuver>("/lgvi_planner/plan_maneuver")
            .unwrap();
        assert!(client.wait_for_server(PATIENCE));
        let goal = client
            .send_goal(PlanManeuverGoal::default(), PATIENCE)
            .unwrap();
        assert!(client.feedback(goal, PATIENCE).unwrap().is_some());
        planner
    });
    ends(
        "planner, waiting for a listener after a failure",
        name,
        |world| {
            let solver = "[maneuver.solver]\nmax_iterations = 1\n\n[maneuver.target]";
            let hasty = [("[maneuver.target]", solver)];
            let scene = parameter("scene", &edited(world, "inclination_change", &hasty));
            let node = world.node("planner", &[&scene]);
            node.await_stderr("no plan; subscribers to the progress");
            Scenario {
                node,
                others: Vec::new(),
                code: 1,
            }
        },
    );
    ends("planner, idle", name, |world| {
        let scene = parameter("scene", &scene("inclination_change"));
        let planner = world.node("planner", &[&scene]);
        planner.await_event("planned", |event| {
            matches!(event, Event::Planned { .. }).then_some(())
        });
        planner
    });
}

/// It writes all that has arrived: the states are those of a flight without a gap.
#[test]
fn a_recorder_under_full_load_closes_the_bag() {
    ends("recorder, under full load", "/lgvi_recorder", |world| {
        let recorder = recorder(world);
        let arguments = ["await_subscribers:=1", "real_time_factor:=0.0"];
        let propagator = propagator(world, &endless_flight(world), &arguments);
        flies(&propagator, 2000);
        let others = vec![propagator];
        Scenario {
            node: recorder,
            others,
            code: 0,
        }
    });
    let world = World::new();
    let recorder = recorder(&world);
    let arguments = ["await_subscribers:=1", "real_time_factor:=0.0"];
    let propagator = propagator(&world, &endless_flight(&world), &arguments);
    flies(&propagator, 2000);
    recorder.stop().expect(0);
    propagator.stop().expect(0);
    let recording = Recording::read(&world.path("bag"));
    let sequences: Vec<u32> = recording.on(STATE).map(|record| record.sequence).collect();
    assert!(sequences.len() >= 2000, "{}", sequences.len());
    let whole: Vec<u32> = (0..).take(sequences.len()).collect();
    assert_eq!(sequences, whole);
}

#[test]
fn a_player_whose_subscriber_is_suspended() {
    let source = World::new();
    // More than is played before the subscriber is suspended.
    let steps = ("steps = 10000", "steps = 100000");
    let (_, bag) = source.fly(&edited(&source, "free_body", &[steps]), "played");
    ends(
        "player, with a suspended subscriber",
        "/lgvi_player",
        |world| {
            let recorder = recorder(world);
            let arguments = [
                &*parameter("bag", &bag),
                "rate:=0.0",
                "await_subscribers:=1",
            ];
            let node = world.node("player", &arguments);
            node.await_ready();
            recorder.await_event("recording", |event| {
                matches!(event, Event::Recording { .. }).then_some(())
            });
            recorder.suspend();
            await_stall(world, STATE);
            let others = vec![recorder];
            Scenario {
                node,
                others,
                code: 0,
            }
        },
    );
}
