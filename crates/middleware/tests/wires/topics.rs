//! Topics between nodes of this crate, over the loopback interface, by any wire.

use std::{
    thread,
    time::{Duration, Instant},
};

use crate::common::{isolated, node};
use lgvi_middleware::{
    Environment,
    ros::{PublishError, Publisher, Qos, RosNode, Subscription, TakeError},
};
use lgvi_msgs::{RosMessage, cdr, nav_msgs::Odometry, std_msgs, tf2_msgs::TFMessage};

const PATIENCE: Duration = Duration::from_secs(20);

fn matched<M: RosMessage>(publisher: &Publisher<M>, subscription: &Subscription<M>) {
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    assert!(subscription.wait_for_publishers(1, PATIENCE));
}

fn pair(environment: &Environment) -> (RosNode, RosNode) {
    (node("sender", environment), node("receiver", environment))
}

fn odometry(x: f64) -> Odometry {
    let mut odometry = Odometry::default();
    odometry.header.frame_id = "inertial".into();
    odometry.child_frame_id = "chaser".into();
    odometry.pose.pose.position.x = x;
    odometry
}

fn text(data: impl ToString) -> std_msgs::String {
    std_msgs::String {
        data: data.to_string(),
    }
}

fn texts(node: &RosNode, topic: &str, qos: &Qos) -> Subscription<std_msgs::String> {
    node.subscription(topic, qos).unwrap()
}

fn next<M: RosMessage>(subscription: &Subscription<M>) -> M {
    let sample = subscription.recv_timeout(PATIENCE).unwrap();
    sample.expect("a message in time").message
}

#[test]
fn a_sample_has_the_identity_that_its_publisher_predicted() {
    let (sender, receiver) = pair(&isolated());
    let publisher = sender.publisher("/said", &Qos::latched(5)).unwrap();
    let early = publisher.next_sample();
    publisher.publish(&text("early")).unwrap();
    let subscription = texts(&receiver, "/said", &Qos::latched(5));
    matched(&publisher, &subscription);
    let late = publisher.next_sample();
    assert_eq!((early.sequence, late.sequence), (1, 2));
    publisher.publish(&text("late")).unwrap();
    for expected in [early, late] {
        let info = subscription.recv_timeout(PATIENCE).unwrap().unwrap().info;
        assert_eq!(info.writer, expected.writer);
        assert_eq!(info.sequence, expected.sequence.unsigned_abs());
    }
}

/// 20 000 odometry messages of about 700 bytes at full speed: all arrive, in order.
#[test]
fn a_burst_of_reliable_messages_arrives_complete_and_in_order() {
    const COUNT: u32 = 20_000;
    let (sender, receiver) = pair(&isolated());
    let publisher = sender.publisher("~/odometry", &Qos::reliable(1)).unwrap();
    let subscription = receiver
        .subscription("/sender/odometry", &Qos::reliable(COUNT as usize))
        .unwrap();
    matched(&publisher, &subscription);
    assert!(cdr::encode(&odometry(0.0)).unwrap().len() > 700);

    let start = Instant::now();
    thread::scope(|scope| {
        scope.spawn(|| {
            for index in 0..COUNT {
                publisher
                    .publish_lossless(&odometry(f64::from(index)), PATIENCE)
                    .unwrap();
            }
            publisher.flush(PATIENCE).unwrap();
        });
        for index in 0..COUNT {
            let sample = subscription.recv_timeout(PATIENCE).unwrap().unwrap();
            assert_eq!(sample.message.pose.pose.position.x, f64::from(index));
            assert_eq!(sample.info.sequence, u64::from(index) + 1);
        }
    });
    eprintln!("{COUNT} messages in {:?}", start.elapsed());
    assert_eq!((subscription.lost(), publisher.dropped()), (0, 0));
}

/// The first message right after the publisher's match, before the subscription may know of it.
#[test]
fn the_first_message_after_a_match_is_not_lost() {
    let environment = isolated();
    for (qos, round) in [Qos::latched(1), Qos::reliable(10), Qos::volatile(10)]
        .into_iter()
        .flat_map(|qos| (0..5).map(move |round| (qos, round)))
    {
        let (sender, receiver) = pair(&environment);
        let subscription = texts(&receiver, "/first", &qos);
        let publisher = sender.publisher("/first", &qos).unwrap();
        assert!(publisher.wait_for_subscriptions(1, PATIENCE));
        publisher.publish(&text(round)).unwrap();
        assert_eq!(next(&subscription), text(round));
    }
}

#[test]
fn a_late_subscription_gets_what_is_latched() {
    let (sender, receiver) = pair(&isolated());
    let publisher = sender.publisher("/scene", &Qos::latched(1)).unwrap();
    publisher.publish(&text("scene")).unwrap();
    let subscription = texts(&receiver, "/scene", &Qos::latched(1));
    assert_eq!(next(&subscription), text("scene"));
}

/// The propagator's of control sequences, which matches volatile publishers too.
#[test]
fn a_late_subscription_that_requests_volatile_gets_what_is_latched_in_this_suite() {
    let (sender, receiver) = pair(&isolated());
    let publisher = sender.publisher("/plan", &Qos::latched(1)).unwrap();
    publisher.publish(&text("plan")).unwrap();
    let subscription = texts(&receiver, "/plan", &Qos::reliable(16));
    assert_eq!(next(&subscription), text("plan"));
}

#[test]
fn a_late_subscription_hears_nothing_of_the_past_of_a_volatile_publisher() {
    let environment = isolated();
    let (sender, receiver) = pair(&environment);
    let publisher = sender.publisher("/clock", &Qos::volatile(1)).unwrap();
    let early = texts(&receiver, "/clock", &Qos::reliable(101));
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    for index in 0..100 {
        publisher.publish(&text(index)).unwrap();
        assert_eq!(next(&early), text(index));
    }
    let late = texts(&node("late", &environment), "/clock", &Qos::reliable(100));
    assert!(publisher.wait_for_subscriptions(2, PATIENCE));
    publisher.publish(&text(100)).unwrap();
    assert_eq!(next(&late), text(100));
    assert_eq!(next(&early), text(100));
}

#[test]
fn what_was_acknowledged_is_received_though_the_publisher_has_left() {
    let (sender, receiver) = pair(&isolated());
    let subscription = texts(&receiver, "/last", &Qos::reliable(1000));
    let publisher = sender.publisher("/last", &Qos::reliable(1000)).unwrap();
    matched(&publisher, &subscription);
    for index in 0..1000 {
        publisher.publish_lossless(&text(index), PATIENCE).unwrap();
    }
    publisher.flush(PATIENCE).unwrap();
    drop((publisher, sender));
    let start = Instant::now();
    while subscription.matched_publishers() > 0 {
        assert!(start.elapsed() < PATIENCE);
        thread::sleep(Duration::from_millis(1));
    }
    for index in 0..1000 {
        assert_eq!(next(&subscription), text(index));
    }
}

#[test]
fn a_subscription_that_is_not_deep_enough_counts_its_losses() {
    let (sender, receiver) = pair(&isolated());
    let subscription = texts(&receiver, "/deep", &Qos::reliable(10));
    let publisher = sender.publisher("/deep", &Qos::reliable(1)).unwrap();
    matched(&publisher, &subscription);
    for index in 0..100 {
        publisher.publish(&text(index)).unwrap();
        // One by one, so that the last ten are those that remain.
        publisher.flush(PATIENCE).unwrap();
    }
    let start = Instant::now();
    while subscription.lost() < 90 && start.elapsed() < PATIENCE {
        thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(subscription.lost(), 90);
    for index in 90..100 {
        assert_eq!(next(&subscription), text(index));
    }
    assert_eq!(subscription.take().unwrap(), None);
}

#[test]
fn raw_bytes_pass_unchanged_with_origin_and_times() {
    let (sender, receiver) = pair(&isolated());
    let type_name = Odometry::TYPE_NAME;
    let publisher = sender
        .raw_publisher("/raw", type_name, &Qos::reliable(1))
        .unwrap();
    let subscription = receiver
        .raw_subscription("/raw", type_name, &Qos::reliable(1))
        .unwrap();
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    let bytes = cdr::encode(&odometry(1.5)).unwrap();
    publisher.publish(bytes.clone()).unwrap();
    let sample = subscription.recv_timeout(PATIENCE).unwrap().unwrap();
    // DDS pads to four bytes.
    assert!(sample.message.starts_with(&bytes) && sample.message.len() < bytes.len() + 4);
    assert_eq!(sample.info.sequence, 1);
    let (sent, received) = (sample.info.source_time.unwrap(), sample.info.received_time);
    assert!(sent > 1_600_000_000_000_000_000);
    assert!(
        received >= sent && received - sent < 5_000_000_000,
        "{sent} {received}"
    );

    for bad in [vec![], vec![0, 1], vec![0, 0, 0, 0, 1]] {
        let error = publisher.publish(bad).unwrap_err();
        assert!(
            matches!(error, PublishError::Encapsulation { .. }),
            "{error}"
        );
    }
}

#[test]
fn a_malformed_sample_is_an_error_and_the_next_is_received() {
    let (sender, receiver) = pair(&isolated());
    let type_name = std_msgs::String::TYPE_NAME;
    let publisher = sender
        .raw_publisher("/bad", type_name, &Qos::reliable(1))
        .unwrap();
    let subscription = texts(&receiver, "/bad", &Qos::reliable(2));
    assert!(publisher.wait_for_subscriptions(1, PATIENCE));
    publisher
        .publish(vec![0, 1, 0, 0, 255, 255, 255, 255])
        .unwrap();
    publisher
        .publish(cdr::encode(&text("good")).unwrap())
        .unwrap();
    let error = subscription.recv_timeout(PATIENCE).unwrap_err();
    assert!(
        matches!(&error, TakeError::Decode { topic, info, .. } if topic == "/bad" && info.sequence == 1),
        "{error}"
    );
    let TakeError::Decode { source, .. } = &error else {
        unreachable!()
    };
    assert!(error.to_string().ends_with(&source.to_string()), "{error}");
    assert_eq!(next(&subscription), text("good"));
}

#[test]
fn topics_of_others_are_listed_and_matches_end() {
    let (sender, receiver) = pair(&isolated());
    let publisher = sender
        .publisher::<TFMessage>("/tf", &Qos::reliable(1))
        .unwrap();
    let subscription = receiver
        .subscription::<TFMessage>("/tf", &Qos::sensor(1))
        .unwrap();
    matched(&publisher, &subscription);
    let topics = receiver.topics();
    let [topic] = topics.as_slice() else {
        panic!("{topics:?}");
    };
    assert_eq!(
        (topic.name.as_str(), topic.type_name.as_str()),
        ("/tf", "tf2_msgs/msg/TFMessage")
    );
    assert_eq!((topic.publishers, topic.subscriptions), (1, 0));
    assert_eq!(sender.topics()[0].subscriptions, 1);
    drop(subscription);
    let start = Instant::now();
    while publisher.matched_subscriptions() > 0 {
        assert!(start.elapsed() < PATIENCE);
        thread::sleep(Duration::from_millis(1));
    }
    assert!(!publisher.wait_for_subscriptions(1, Duration::from_millis(1)));
}

#[test]
fn messages_can_be_awaited() {
    let (sender, receiver) = pair(&isolated());
    let publisher = sender.publisher("/async", &Qos::latched(3)).unwrap();
    let subscription = texts(&receiver, "/async", &Qos::latched(3));
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .build()
        .unwrap();
    runtime.block_on(async {
        let cancelled = tokio::time::timeout(Duration::from_millis(1), subscription.recv()).await;
        assert!(cancelled.is_err());
        for index in 0..3 {
            publisher.publish(&text(index)).unwrap();
        }
        for index in 0..3 {
            assert_eq!(subscription.recv().await.unwrap().message, text(index));
        }
    });
}

#[test]
fn a_node_leaves_promptly() {
    let (sender, receiver) = pair(&isolated());
    let publisher = sender.publisher("/leave", &Qos::reliable(1)).unwrap();
    let subscription = texts(&receiver, "/leave", &Qos::reliable(1));
    matched(&publisher, &subscription);
    publisher.publish(&text("bye")).unwrap();
    let start = Instant::now();
    drop((publisher, sender));
    let left = start.elapsed();
    drop((subscription, receiver));
    eprintln!("left in {left:?}, both in {:?}", start.elapsed());
    assert!(start.elapsed() < Duration::from_secs(1));
}
