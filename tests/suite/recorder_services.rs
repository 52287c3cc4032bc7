//! What is asked of a recorder while it records, and bags of several files.

use std::path::Path;

use lgvi_bag::BagReader;
use lgvi_common::Event;
use lgvi_middleware::ros::{Publisher, Qos, RosNode, Subscription};
use lgvi_msgs::Service;
use lgvi_msgs::diagnostic_msgs::DiagnosticArray;
use lgvi_msgs::rosbag2_interfaces::srv::{
    IsPaused, IsPausedRequest, Pause, PauseRequest, Resume, ResumeRequest, SplitBagfile,
    SplitBagfileRequest,
};
use lgvi_msgs::std_msgs::String as Text;
use lgvi_tests::{PATIENCE, Process, Recording, World, edited, eventually};

const TOPIC: &str = "/words";

struct Bench {
    world: World,
    observer: RosNode,
    diagnostics: Subscription<DiagnosticArray>,
    words: Publisher<Text>,
    recorder: Process,
}

impl Bench {
    #[track_caller]
    fn new(parameters: &[&str]) -> Self {
        let world = World::new();
        let speaker = world.ros_node("speaker");
        let words = speaker.publisher(TOPIC, &Qos::latched(10)).unwrap();
        let output = format!("output:={}", world.path("bag").display());
        let parameters = [&[&*output, "topics:=['/words']"], parameters].concat();
        let recorder = world.node("recorder", &parameters);
        recorder.await_ready();
        assert!(words.wait_for_subscriptions(1, PATIENCE));
        let observer = world.ros_node("observer");
        let qos = Qos::reliable(10);
        Self {
            diagnostics: observer.subscription("/diagnostics", &qos).unwrap(),
            observer,
            world,
            words,
            recorder,
        }
    }

    fn call<S: Service>(&self, service: &str, request: &S::Request) -> S::Response {
        let name = format!("/lgvi_recorder/{service}");
        let client = self.observer.service_client::<S>(&name).unwrap();
        assert!(client.wait_for_server(PATIENCE));
        client.call(request, PATIENCE).unwrap()
    }

    fn say(&self, word: &str) {
        self.words.publish(&Text { data: word.into() }).unwrap();
    }

    /// Waits until so many words are recorded.
    #[track_caller]
    fn await_words(&self, count: u64) {
        eventually(&format!("{count} words"), || {
            let stdout = self.recorder.stdout();
            let mut lines = stdout.lines().rev();
            lines
                .find_map(|line| match serde_json::from_str(line).ok()? {
                    Event::Recording { messages, .. } => Some(*messages.get(TOPIC)? >= count),
                    _ => None,
                })?
                .then_some(())
        });
    }

    /// Waits until so many messages have been left out.
    #[track_caller]
    fn await_left_out(&self, count: u64) {
        eventually(&format!("{count} messages left out"), || {
            let mut parts = self.diagnostics.take().unwrap()?.message.status.into_iter();
            let part = parts.find(|part| part.name == "lgvi_recorder: recording")?;
            let mut values = part.values.into_iter();
            let left_out = values.find(|value| value.key == "messages left out in pauses");
            (left_out?.value == count.to_string()).then_some(())
        });
    }
}

fn words(bag: &Path) -> Vec<String> {
    let words = Recording::read(bag).messages::<Text>(TOPIC);
    words.into_iter().map(|word| word.data).collect()
}

#[test]
fn what_comes_while_it_is_paused_is_left_out_and_not_lost() {
    let bench = Bench::new(&["start_paused:=true"]);
    let paused = || {
        bench
            .call::<IsPaused>("is_paused", &IsPausedRequest::default())
            .paused
    };
    assert!(paused());
    bench.say("before");
    bench.await_left_out(1);
    bench.call::<Resume>("resume", &ResumeRequest::default());
    assert!(!paused());
    bench.say("one");
    bench.await_words(1);
    bench.call::<Pause>("pause", &PauseRequest::default());
    assert!(paused());
    bench.say("between");
    bench.await_left_out(2);
    bench.call::<Resume>("resume", &ResumeRequest::default());
    bench.say("two");
    bench.await_words(2);
    bench.recorder.stop().expect(0);

    let bag = bench.world.path("bag");
    assert_eq!(words(&bag), ["one", "two"]);
    assert_eq!(BagReader::open(&bag).unwrap().custom()["lost"], "0");
}

#[test]
fn a_file_is_split_on_demand_and_the_next_one_begins_with_what_is_latched() {
    let bench = Bench::new(&[]);
    bench.say("one");
    bench.await_words(1);
    bench.call::<SplitBagfile>("split_bagfile", &SplitBagfileRequest::default());
    let bag = bench.world.path("bag");
    assert!(bag.join("bag_1.mcap").exists(), "it was answered before");
    bench.say("two");
    bench.await_words(2);
    bench.recorder.stop().expect(0);

    assert_eq!(words(&bag), ["one", "two"]);
    assert_eq!(words(&bag.join("bag_0.mcap")), ["one"]);
    assert_eq!(words(&bag.join("bag_1.mcap")), ["one", "two"]);
}

#[test]
fn a_flight_in_several_files_is_a_flight() {
    let world = World::new();
    let changes = [
        ("duration = 100.0", "duration = 20.0"),
        ("steps = 10000", "steps = 2000"),
    ];
    let scene = edited(&world, "free_body", &changes);
    let scene = format!("scene:={}", scene.display());
    let fly = |name: &str, parameters: &[&str]| {
        let bag = world.path(name);
        let output = format!("output:={}", bag.display());
        let stamps = ["log_time:=stamp", "await_stamp:=true"];
        let parameters = [&[&*output], &stamps[..], parameters].concat();
        let recorder = world.node("recorder", &parameters);
        recorder.await_ready();
        let fast = ["real_time_factor:=0.0", "await_subscribers:=1"];
        let propagator = world.node("propagator", &[&scene, fast[0], fast[1]]);
        propagator.await_flown();
        propagator.stop().expect(0);
        recorder.stop().expect(0);
        world.verify_agrees(&bag, 2001);
        let files = std::fs::read_dir(&bag).unwrap().count() - 1;
        (files, bag)
    };
    // Log times of the two ways do not come in order: there may be some more.
    let (files, bag) = fly("by_time", &["max_duration:=5.0", "compression:=none"]);
    assert!((4..=6).contains(&files), "{files} files");
    for file in 0..files {
        let recording = Recording::read(&bag.join(format!("by_time_{file}.mcap")));
        assert_eq!(
            recording.on("/lgvi_propagator/scene").count(),
            1,
            "in {file}"
        );
    }
    let (files, _) = fly("by_size", &["max_bytes:=100000", "compression:=lz4"]);
    assert!(files >= 3, "{files} files");
    let (files, _) = fly("whole", &[]);
    assert_eq!(files, 1);
}
