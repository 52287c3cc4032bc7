//! A recorder of topics from DDS is killed: the last second at most is lost, whatever its messages are logged at.

use std::thread;
use std::time::{Duration, Instant};

use lgvi_bag::recover;
use lgvi_middleware::ros::Qos;
use lgvi_msgs::std_msgs::String as Text;
use lgvi_tests::{PATIENCE, Recording, Signal, World};

const TOPIC: &str = "/words";
const PERIOD: Duration = Duration::from_millis(20);
const RECORDED: Duration = Duration::from_secs(3);

/// What may be lost.
const LOST: Duration = Duration::from_secs(1);

/// Records numbers, and kills the recorder. A text has no stamp.
fn killed(log_time: &str) {
    let world = World::new();
    let speaker = world.ros_node("speaker");
    let words = speaker.publisher(TOPIC, &Qos::reliable(1000)).unwrap();
    let bag = world.path("bag");
    let output = format!("output:={}", bag.display());
    let topics = format!("topics:=['{TOPIC}=std_msgs/msg/String']");
    let log_time = format!("log_time:={log_time}");
    let recorder = world.node("recorder", &[&output, &topics, &log_time]);
    recorder.await_ready();
    assert!(words.wait_for_subscriptions(1, PATIENCE));
    let mut sent = Vec::new();
    let start = Instant::now();
    while start.elapsed() < RECORDED {
        let data = sent.len().to_string();
        words.publish(&Text { data }).unwrap();
        sent.push(Instant::now());
        thread::sleep(PERIOD);
    }
    let end = Instant::now();
    recorder.signal(Signal::SIGKILL);
    assert_eq!(recorder.finish().code, None);

    let recovered = world.path("recovered");
    recover(&bag, &recovered).unwrap();
    let found = Recording::read(&recovered).messages::<Text>(TOPIC);
    let numbers: Vec<usize> = found
        .iter()
        .map(|text| text.data.parse().unwrap())
        .collect();
    assert_eq!(numbers, (0..numbers.len()).collect::<Vec<_>>());
    let lost = sent.get(numbers.len()).map(|sent| end - *sent);
    assert!(
        lost.is_none_or(|lost| lost <= LOST),
        "{lost:?} of {log_time}"
    );
}

#[test]
fn a_killed_recorder_of_topics_loses_the_last_second_at_most() {
    killed("received");
    killed("stamp");
}
