//! The propagator on one host, planner and recorder on another: only the network joins them, and it fails at times.

use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use lgvi_common::{Event, FlightReport};
use lgvi_middleware::ros::{GoalState, Qos};
use lgvi_msgs::action::{PlanManeuver, PlanManeuverGoal};
use lgvi_msgs::msg::{ControlSequence, SystemState};
use lgvi_tests::{
    Cut, Finished, Host, Hosts, PATIENCE, Process, Recording, Verdict, between_hosts, binary,
    edited, eventually, ros_python, settled, within,
};

const STATE: &str = "/lgvi_propagator/state";
const SCENE: &str = "/lgvi_propagator/scene";
const FLOWN: &str = "/lgvi_propagator/flown_control";
const CONTROL: &str = "/lgvi_planner/control_sequence";

/// Streams of the propagator, with a message each step.
const STREAMS: [&str; 4] = [
    STATE,
    "/lgvi_propagator/odometry/spacecraft",
    "/lgvi_propagator/invariants",
    "/tf",
];

/// Every step is published over DDS.
const EVERY_STEP: (&str, &str) = ("ros_every = 10", "ros_every = 1");

/// How long the cable is cut.
const OUTAGE: Duration = Duration::from_secs(5);

/// How soon both sides must go on when it is mended; measured: 0.02 s.
const SOON: Duration = Duration::from_secs(2);

/// A flight across: the propagator flies on host `a`, planner and recorder are on `b`.
struct Flight {
    propagator: Process,
    planner: Process,
    recorder: Process,
    bag: PathBuf,
}

impl Flight {
    fn start(hosts: &Hosts, changes: &[(&str, &str)], real_time_factor: f64) -> Self {
        let bag = hosts.b.path("bag");
        let recorder = record(&hosts.b, &bag, &[]);
        let start = |host: &Host, kind, parameter: &str, remapping| {
            let scene = edited(host.world(), "inclination_change", changes);
            let scene = format!("scene:={}", scene.display());
            host.node(kind, &["-p", &scene, "-p", parameter, "-r", remapping])
        };
        let factor = format!("real_time_factor:={real_time_factor:?}");
        let remapping = format!("~/control_sequence:={CONTROL}");
        let propagator = start(&hosts.a, "propagator", &factor, &remapping);
        // The flight begins with the first plan: not before the recorder has found the propagator's topics.
        eventually("the scene's record", || {
            (recorded(&recorder, SCENE).0 == 1).then_some(())
        });
        let remapping = format!("~/state:={STATE}");
        let planner = start(&hosts.b, "planner", "plan_at_start:=true", &remapping);
        Self {
            propagator,
            planner,
            recorder,
            bag,
        }
    }

    /// The step that the propagator was at when it last said so.
    fn step(&self) -> u64 {
        let stdout = self.propagator.stdout();
        let mut steps = events(&stdout).filter_map(|event| match event {
            Event::Flying { step } => Some(step),
            _ => None,
        });
        steps.next_back().unwrap_or(0)
    }

    /// How many sequences the propagator has taken up.
    fn taken_up(&self) -> usize {
        let stderr = self.propagator.stderr();
        stderr.matches("flying a control sequence").count()
    }

    /// Flies to the end; what was flown, and how many messages the recorder knows to be missing.
    fn end(self) -> (FlightReport, u64) {
        let report = self.propagator.await_flown();
        self.propagator.stop().expect(0);
        self.planner.stop().expect(0);
        (report, lost(&self.recorder.stop().expect(0)))
    }
}

/// Starts a recorder that takes everything from DDS.
fn record(host: &Host, bag: &Path, arguments: &[&str]) -> Process {
    let output = format!("output:={}", bag.display());
    let arguments = [&["-p", &output, "-p", "states:=[]"], arguments].concat();
    let recorder = host.node("recorder", &arguments);
    recorder.await_ready();
    recorder
}

fn events(stdout: &str) -> impl DoubleEndedIterator<Item = Event> {
    let lines = stdout.lines();
    lines.filter_map(|line| serde_json::from_str(line).ok())
}

/// Messages recorded so far on a topic, and those known to be missing.
fn recorded(recorder: &Process, topic: &str) -> (u64, u64) {
    let stdout = recorder.stdout();
    let mut counts = events(&stdout).filter_map(|event| match event {
        Event::Recording { messages, lost, .. } => {
            Some((messages.get(topic).copied().unwrap_or(0), lost))
        }
        _ => None,
    });
    counts.next_back().unwrap_or_default()
}

/// Messages that a recorder which has ended knows to be missing.
fn lost(recorder: &Finished) -> u64 {
    let mut reports = events(&recorder.stdout).filter_map(|event| match event {
        Event::Recorded { lost, .. } => Some(lost),
        _ => None,
    });
    reports.next_back().expect("the recorder's report")
}

fn verify(host: &Host, bag: &Path) -> Finished {
    let mut command = host.command(&binary("lgvi"));
    command.arg("verify").arg(bag).arg("--json");
    host.world().start("verify", command).finish()
}

/// Repeats the flight of a bag on the host where it is; states that agree.
#[track_caller]
fn verified(host: &Host, bag: &Path) -> u64 {
    let verdict: Verdict = verify(host, bag).expect(0).json();
    assert!(verdict.difference.is_none(), "{verdict:?}");
    verdict.states
}

#[test]
fn the_inclination_change_is_flown_across() {
    between_hosts(
        "two_hosts::the_inclination_change_is_flown_across",
        |hosts| {
            let flight = Flight::start(hosts, &[EVERY_STEP], 0.1);
            let bag = flight.bag.clone();
            let (report, lost) = flight.end();
            assert_eq!(report.steps, 1000);
            assert!(report.miss.unwrap().norm <= 1e-12);
            assert_eq!(lost, 0, "messages lost");

            let recording = Recording::read(&bag);
            let counts = recording.counts();
            for topic in STREAMS {
                assert_eq!(counts[topic], 1001, "{topic}");
            }
            assert_eq!((counts[CONTROL], counts[FLOWN]), (1, 1));
            assert_eq!(verified(&hosts.b, &bag), 1001);
        },
    );
}

#[test]
fn an_outage_costs_nothing_that_can_be_kept() {
    between_hosts(
        "two_hosts::an_outage_costs_nothing_that_can_be_kept",
        |hosts| {
            let replan = (
                "[maneuver.target]",
                "[maneuver.replan]\nevery = 50\ndeadline = 0.5\n\n[maneuver.target]",
            );
            let flight = Flight::start(hosts, &[EVERY_STEP, replan], 0.05);
            let observer = hosts.b.ros_node("observer");
            let states = observer
                .subscription::<SystemState>(STATE, &Qos::sensor(1))
                .unwrap();
            let client = hosts
                .a
                .ros_node("client")
                .action_client::<PlanManeuver>("/lgvi_planner/plan_maneuver")
                .unwrap();
            assert!(client.wait_for_server(PATIENCE), "no action server");
            for cut in [Cut::Unplugged, Cut::Silent] {
                // It goes well, with plans made anew.
                let plans = flight.taken_up() + 1;
                eventually("another plan", || (flight.taken_up() > plans).then_some(()));

                hosts.cut(cut);
                let (plans, messages) =
                    settled(|| (flight.taken_up(), recorded(&flight.recorder, STATE)));
                let step = flight.step();
                thread::sleep(OUTAGE);
                eventually("a flight that goes on", || {
                    (flight.step() >= step + 200).then_some(())
                });
                assert_eq!(flight.taken_up(), plans, "plans got across");
                assert_eq!(
                    recorded(&flight.recorder, STATE),
                    messages,
                    "states got across"
                );
                while states.take().unwrap().is_some() {}

                hosts.mend(cut);
                let mended = Instant::now();
                within(SOON, "a state", || states.take().unwrap());
                let state = mended.elapsed();
                within(SOON, "a plan", || (flight.taken_up() > plans).then_some(()));
                let plan = mended.elapsed();
                within(SOON, "what could not be recorded", || {
                    (recorded(&flight.recorder, STATE).0 >= messages.0 + 250).then_some(())
                });
                let record = mended.elapsed();
                eprintln!(
                    "{cut:?}: a state after {state:?}, a plan after {plan:?}, the record after {record:?}"
                );
            }

            let first_step = flight.step() + 50;
            let goal = PlanManeuverGoal {
                first_step,
                deadline: 1.0,
                warm: true,
            };
            let goal = client.send_goal(goal, PATIENCE).unwrap();
            let outcome = client.result(goal, PATIENCE).unwrap();
            assert_eq!(
                outcome.state,
                GoalState::Succeeded,
                "{}",
                outcome.result.message
            );

            let bag = flight.bag.clone();
            let (report, lost) = flight.end();
            assert_eq!(report.steps, 1000);
            assert_eq!(lost, 0, "messages lost");
            let recording = Recording::read(&bag);
            let counts = recording.counts();
            for topic in STREAMS {
                assert_eq!(counts[topic], 1001, "{topic}");
            }
            let flown = recording.messages::<ControlSequence>(FLOWN);
            // A plan is not flown if a newer one begins no later.
            let made = recording.messages::<ControlSequence>(CONTROL);
            for (index, plan) in made.iter().enumerate() {
                let newer = &made[index + 1..];
                assert!(
                    flown
                        .iter()
                        .any(|flown| flown.first_step == plan.first_step)
                        || newer
                            .iter()
                            .any(|newer| newer.first_step <= plan.first_step),
                    "the plan from step {} was made and not flown",
                    plan.first_step
                );
            }
            assert!(
                flown
                    .iter()
                    .any(|sequence| sequence.first_step == first_step)
            );
            assert_eq!(verified(&hosts.b, &bag), 1001);
        },
    );
}

#[test]
fn what_is_more_than_the_depth_is_lost_and_not_in_silence() {
    const TEST: &str = "two_hosts::what_is_more_than_the_depth_is_lost_and_not_in_silence";
    between_hosts(TEST, |hosts| {
        let bag = hosts.b.path("bag");
        let topics =
            format!("topics:=['{STATE}=lgvi_msgs/msg/SystemState', '{SCENE}=lgvi_msgs/msg/Scene']");
        let recorder = record(&hosts.b, &bag, &["-p", &topics]);
        let every_step = ("ros_every = 100", "ros_every = 1");
        let scene = edited(hosts.a.world(), "free_body", &[every_step]);
        let scene = format!("scene:={}", scene.display());
        // 800 states a second; a reliable topic keeps 1000 or a few more.
        let arguments = ["-p", &scene, "-p", "real_time_factor:=8.0"];
        let propagator = hosts.a.node("propagator", &arguments);
        let recorded = || recorded(&recorder, STATE).0;
        eventually("states", || (recorded() >= 100).then_some(()));

        hosts.cut(Cut::Silent);
        thread::sleep(OUTAGE);
        let before = recorded();
        hosts.mend(Cut::Silent);
        within(SOON, "what was kept and more", || {
            (recorded() >= before + 1500).then_some(())
        });
        let propagator = propagator.stop().expect(0);
        let known = lost(&recorder.stop().expect(0));

        let states = Recording::read(&bag).messages::<SystemState>(STATE);
        let sequences = || states.iter().map(|state| state.sequence);
        assert!(sequences().is_sorted(), "out of order");
        let missing = sequences().next_back().unwrap() + 1 - states.len() as u64;
        eprintln!("{missing} states are missing, the recorder knows of {known}");
        assert!(missing > 0, "everything was kept");
        // Either the recorder counts what was overwritten, or the propagator says what it has dropped.
        assert!(known == missing || propagator.stderr.contains("dropped a message"));
        let verdict = verify(&hosts.b, &bag).expect(0);
        let told = format!("\"missing\":{missing},");
        assert!(verdict.stdout.contains(&told), "{}", verdict.stdout);
    });
}

#[test]
fn a_real_ros_node_on_the_other_host_misses_nothing_of_an_outage() {
    const TEST: &str = "two_hosts::a_real_ros_node_on_the_other_host_misses_nothing_of_an_outage";
    // There is no network inside to make it from.
    ros_python();
    between_hosts(TEST, |hosts| {
        let every_step = ("ros_every = 100", "ros_every = 1");
        let scene = edited(hosts.a.world(), "free_body", &[every_step]);
        let scene = format!("scene:={}", scene.display());
        // 50 messages a second.
        let arguments = ["-p", &scene, "-p", "real_time_factor:=0.5"];
        let propagator = hosts.a.node("propagator", &arguments);
        propagator.await_ready();
        let arguments = ["/lgvi_propagator/odometry/body", "--count", "350"];
        let listener = hosts.b.ros_python("ros2_listener.py", &arguments);
        eventually("a message", || {
            listener.stdout().contains("hears").then_some(())
        });

        hosts.cut(Cut::Silent);
        thread::sleep(OUTAGE);
        hosts.mend(Cut::Silent);
        let listener = listener.finish().expect(0);
        let heard: serde_json::Value =
            serde_json::from_str(listener.stdout.lines().last().unwrap()).unwrap();
        assert_eq!(heard["steps"], serde_json::json!([10_000_000]));
        let nodes = serde_json::json!(["/lgvi_propagator", "/listener"]);
        assert_eq!(heard["nodes"], nodes);
        propagator.stop().expect(0);
    });
}
