//! What nodes say of themselves on `/diagnostics`, as a stranger's process on Cyclone DDS hears it.

use std::collections::BTreeMap;
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use lgvi_common::Event;
use lgvi_middleware::ros::Qos;
use lgvi_middleware::shm::{ShmNode, ShmOptions};
use lgvi_msgs::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use lgvi_msgs::msg::Invariants;
use lgvi_msgs::stamp;
use lgvi_msgs::std_srvs::srv::{Trigger, TriggerRequest};
use lgvi_tests::{PATIENCE, Process, World, edited, eventually, scene};
use serde::Deserialize;

/// What a stranger hears.
pub(crate) struct Listener(Process);

/// One message, and when it came (s).
#[derive(Debug, Deserialize)]
pub(crate) struct Heard {
    pub(crate) received: f64,
    #[serde(flatten)]
    pub(crate) array: DiagnosticArray,
}

/// How a part of a node is.
#[derive(Debug)]
pub(crate) struct Part {
    pub(crate) level: u8,
    pub(crate) message: String,
    values: BTreeMap<String, String>,
}

impl Listener {
    pub(crate) fn new(world: &World) -> Self {
        let peer = world.python("cyclone_diagnostics_peer.py", &[]);
        peer.await_stderr("matched");
        Self(peer)
    }

    /// What has come so far.
    pub(crate) fn heard(&self) -> Vec<Heard> {
        let text = self.0.stdout();
        let complete = text.rsplit_once('\n').map_or("", |(lines, _)| lines);
        complete
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }

    /// How a part has been, in messages one after the other.
    pub(crate) fn of(&self, part: &str) -> Vec<Part> {
        self.heard()
            .iter()
            .filter_map(|heard| heard.part(part))
            .collect()
    }

    /// Waits until a part is as wanted.
    #[track_caller]
    pub(crate) fn await_part(&self, part: &str, wanted: impl Fn(&Part) -> bool) -> Part {
        eventually(part, || self.of(part).into_iter().rfind(&wanted))
    }
}

impl Heard {
    pub(crate) fn part(&self, name: &str) -> Option<Part> {
        let mut parts = self.array.status.iter();
        let found = parts.find(|status| status.name == name)?;
        assert!(parts.all(|status| status.name != name), "{name} twice");
        Some(Part {
            level: found.level,
            message: found.message.clone(),
            values: found
                .values
                .iter()
                .map(|value| (value.key.clone(), value.value.clone()))
                .collect(),
        })
    }

    fn stamp(&self) -> i64 {
        stamp::from_message(&self.array.header.stamp).unwrap()
    }
}

impl Part {
    #[track_caller]
    pub(crate) fn number(&self, key: &str) -> f64 {
        let value = self.values.get(key);
        let value = value.unwrap_or_else(|| panic!("{key:?} is not in {self:?}"));
        value.parse().unwrap_or_else(|_| panic!("{key}: {value}"))
    }
}

fn wall() -> i64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    i64::try_from(now.as_nanos()).unwrap()
}

#[test]
fn once_a_second_a_flight_says_how_it_is() {
    const FLIGHT: &str = "lgvi_propagator: flight";
    let world = World::new();
    let scene = edited(
        &world,
        "two_dumbbells",
        &[("ros_every = 50", "ros_every = 1")],
    );
    let observer = world.ros_node("observer");
    let invariants = "/lgvi_propagator/invariants";
    let invariants = observer
        .subscription::<Invariants>(invariants, &Qos::reliable(100_000))
        .unwrap();
    let began = wall();
    let scene = format!("scene:={}", scene.display());
    let propagator = world.node("propagator", &[&scene]);
    propagator.await_ready();
    assert!(invariants.wait_for_publishers(1, PATIENCE));
    eventually("invariants", || invariants.take().unwrap());
    // From step 0 on, which is heard of now.
    let reset = observer
        .service_client::<Trigger>("/lgvi_propagator/reset")
        .unwrap();
    assert!(
        reset
            .call(&TriggerRequest::default(), PATIENCE)
            .unwrap()
            .success
    );
    let listener = Listener::new(&world);
    let heard = eventually("six messages", || {
        Some(listener.heard()).filter(|heard| heard.len() >= 6)
    });
    let ended = wall();
    propagator.stop().expect(0);

    let mut intervals: Vec<f64> = heard
        .windows(2)
        .map(|pair| pair[1].received - pair[0].received)
        .collect();
    intervals.sort_by(f64::total_cmp);
    assert!((intervals[2] - 1.0).abs() < 0.1, "{intervals:?}");
    assert!(
        heard
            .iter()
            .all(|heard| (began..ended).contains(&heard.stamp()))
    );

    let published: BTreeMap<u64, Invariants> = std::iter::from_fn(|| invariants.take().unwrap())
        .map(|sample| (sample.message.step, sample.message))
        .collect();
    let first = &published[&0];
    let h = step_size(&published);
    let mut compared = 0;
    for pair in heard.windows(2) {
        let [before, now] = [&pair[0], &pair[1]].map(|heard| heard.part(FLIGHT).unwrap());
        let grown = |key| now.number(key) - before.number(key);
        let (steps, seconds) = (
            grown("step"),
            (pair[1].stamp() - pair[0].stamp()) as f64 * 1e-9,
        );
        assert!(steps > 0.0);
        let factor = now.number("real-time factor");
        assert!((factor - steps * h / seconds).abs() < 0.05, "{factor}");
        let mean = now.number("step time, mean (us)");
        assert!(mean > 0.0 && mean <= now.number("step time, longest (us)"));
        let troubles = [
            "overruns",
            "samples refused over shared memory",
            "states and measurements not converted for DDS",
        ];
        let troubled = troubles.iter().any(|key| grown(key) > 0.0);
        let level = if troubled {
            DiagnosticStatus::WARN
        } else {
            DiagnosticStatus::OK
        };
        assert_eq!(now.level, level, "{now:?}");

        let step = now.number("invariants of step") as u64;
        let age = now.number("step") as u64 - step;
        assert!(age as f64 * h < 2.5, "{age} steps old");
        if let Some(there) = published.get(&step) {
            compared += 1;
            near(
                now.number("energy, change (J)"),
                there.energy - first.energy,
                first.energy,
            );
            let change = |a: &[f64; 3], b: &[f64; 3]| {
                a.iter()
                    .zip(b)
                    .map(|(a, b)| (a - b).powi(2))
                    .sum::<f64>()
                    .sqrt()
            };
            let key = "linear momentum, change (kg m/s)";
            let size = change(&there.angular_momentum, &[0.0; 3]);
            near(
                now.number(key),
                change(&there.linear_momentum, &first.linear_momentum),
                size,
            );
            let key = "angular momentum, change (kg m^2/s)";
            near(
                now.number(key),
                change(&there.angular_momentum, &first.angular_momentum),
                size,
            );
            near(
                now.number("orthogonality error"),
                there.orthogonality_error,
                1.0,
            );
        }
    }
    assert!(compared >= 3, "{compared}");
}

/// Step size (s), from the stamps of two steps.
fn step_size(published: &BTreeMap<u64, Invariants>) -> f64 {
    let time = |message: &Invariants| stamp::from_message(&message.header.stamp).unwrap();
    let (first, first_message) = published.first_key_value().unwrap();
    let (last, last_message) = published.last_key_value().unwrap();
    (time(last_message) - time(first_message)) as f64 * 1e-9 / (last - first) as f64
}

/// Equal but for the rounding of quantities of a size.
#[track_caller]
fn near(found: f64, expected: f64, size: f64) {
    let bound = 8.0 * f64::EPSILON * size.abs().max(expected.abs());
    assert!(
        (found - expected).abs() <= bound,
        "{found:e}, expected {expected:e}"
    );
}

#[test]
fn a_rate_that_cannot_be_kept_and_a_subscriber_that_does_not_take_are_warned_of() {
    const FLIGHT: &str = "lgvi_propagator: flight";
    let world = World::new();
    let longer = [
        ("duration = 100.0", "duration = 1000000.0"),
        ("steps = 10000", "steps = 100000000"),
    ];
    let scene = edited(&world, "free_body", &longer);
    let scene = format!("scene:={}", scene.display());
    let propagator = world.node("propagator", &[&scene, "real_time_factor:=1e6"]);
    propagator.await_ready();
    let listener = Listener::new(&world);
    let late = listener.await_part(FLIGHT, |part| {
        part.number("overruns") > 0.0 && part.number("step") > 0.0
    });
    assert_eq!(late.level, DiagnosticStatus::WARN);
    assert_eq!(late.message, "steps came late");
    let late = listener.await_part(FLIGHT, |part| part.number("real-time factor") > 0.0);
    assert!(late.number("real-time factor") < 1e6);
    assert_eq!(late.number("samples refused over shared memory"), 0.0);

    let options = ShmOptions {
        domain_id: world.environment().domain_id,
        root: Some(world.path("shm")),
    };
    let shm = ShmNode::new("/idler", &options).unwrap();
    let idler = shm.state_subscriber("/lgvi_propagator/state", 16).unwrap();
    let refused = "samples refused over shared memory";
    let lost = listener.await_part(FLIGHT, |part| part.number(refused) > 0.0);
    assert_eq!(lost.level, DiagnosticStatus::WARN);
    drop(idler);
    propagator.stop().expect(0);
}

#[test]
fn who_does_not_keep_up_over_shared_memory_is_warned_of_until_it_has_gone() {
    const FLIGHT: &str = "lgvi_propagator: flight";
    let world = World::new();
    let scene = format!("scene:={}", scene("free_body").display());
    let propagator = world.node("propagator", &[&scene]);
    propagator.await_ready();
    let listener = Listener::new(&world);
    listener.await_part(FLIGHT, |part| part.level == DiagnosticStatus::OK);
    let options = ShmOptions {
        domain_id: world.environment().domain_id,
        root: Some(world.path("shm")),
    };
    let shm = ShmNode::new("/idler", &options).unwrap();
    let idler = shm.state_subscriber("/lgvi_propagator/state", 16).unwrap();
    let refused = |part: &Part| part.number("samples refused over shared memory");
    let lost = listener.await_part(FLIGHT, |part| refused(part) > 0.0);
    assert_eq!(lost.level, DiagnosticStatus::WARN);
    drop(idler);
    let over = listener.await_part(FLIGHT, |part| {
        refused(part) > 0.0 && part.level == DiagnosticStatus::OK
    });
    assert!(refused(&over) >= refused(&lost));
    propagator.stop().expect(0);
}

#[test]
fn planner_and_recorder_say_how_they_are() {
    let world = World::new();
    let scene = format!("scene:={}", scene("inclination_change").display());
    let output = format!("output:={}", world.path("bag").display());
    let recorder = world.node(
        "recorder",
        &[
            &output,
            "topics:=[/lgvi_planner/progress=lgvi_msgs/msg/PlanProgress]",
        ],
    );
    recorder.await_ready();
    let planner = world.node("planner", &[&scene]);
    let (plan, seconds) = planner.await_event("planned", |event| match event {
        Event::Planned { plan, seconds } => Some((plan.clone(), *seconds)),
        _ => None,
    });
    let listener = Listener::new(&world);
    let planning = listener.await_part("lgvi_planner: planning", |_| true);
    assert_eq!(planning.level, DiagnosticStatus::OK);
    assert_eq!(
        planning.message,
        format!("planned in {} iterations", plan.iterations)
    );
    assert_eq!(
        planning.number("Newton iterations"),
        f64::from(plan.iterations)
    );
    assert_eq!(planning.number("trials"), f64::from(plan.trials));
    assert_eq!(planning.number("violation"), plan.violation);
    assert_eq!(planning.number("plans"), 1.0);
    assert!((planning.number("time (ms)") * 1e-3 - seconds).abs() < 0.1 * seconds);

    // Each iteration and the outcome.
    let written = f64::from(plan.iterations) + 1.0;
    let count = |part: &Part| part.number("messages written");
    let recording = listener.await_part("lgvi_recorder: recording", |part| count(part) >= written);
    assert_eq!(recording.level, DiagnosticStatus::OK);
    assert_eq!(recording.number("messages lost"), 0.0);
    planner.stop().expect(0);
    recorder.stop().expect(0);
    let bag = lgvi_tests::Recording::read(&world.path("bag"));
    assert_eq!(count(&recording), bag.records.len() as f64);
}

#[test]
fn diagnostics_follow_the_nodes_clock_and_nothing_is_sent_to_nobody() {
    let world = World::new();
    let scene = format!("scene:={}", scene("free_body").display());
    let mut command = world.command(&lgvi_tests::binary("lgvi_propagator"));
    command.args([
        "--supervised",
        "--ros-args",
        "-p",
        &scene,
        "-p",
        "use_sim_time:=true",
    ]);
    let propagator = world.start("follower", command);
    propagator.await_ready();
    let mut time = world.python("cyclone_clock_peer.py", &[]);
    time.await_stderr("matched");
    const SECOND: i64 = 1_000_000_000;
    // Long enough for two messages, had anybody listened.
    time.tell(&SECOND.to_string());
    thread::sleep(Duration::from_millis(2200));
    time.tell(&(2 * SECOND).to_string());
    let listener = Listener::new(&world);
    let first = eventually("a message", || listener.heard().into_iter().next());
    assert_eq!(first.stamp(), 2 * SECOND, "sent before anybody listened");
    let clock = first.part("lgvi_propagator: clock").unwrap();
    assert_eq!(
        (clock.level, clock.number("time (s)")),
        (DiagnosticStatus::OK, 2.0)
    );
    time.tell(&SECOND.to_string());
    let back = listener.await_part("lgvi_propagator: clock", |part| {
        part.number("time (s)") == 1.0
    });
    assert_eq!(
        (back.level, back.number("times gone back")),
        (DiagnosticStatus::WARN, 1.0)
    );
    let latest = listener.heard();
    assert_eq!(latest.last().unwrap().stamp(), SECOND);
    propagator.stop().expect(0);
}
