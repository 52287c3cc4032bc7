//! Who is there, by liveliness tokens, who cannot understand whom, and what peers that are no nodes send.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use crate::common::{isolated, node};
use ::zenoh::{Session, Wait};
use lgvi_middleware::{
    Environment,
    ros::{CallError, Qos},
};
use lgvi_msgs::{
    RosMessage, Service, cdr, std_msgs,
    std_srvs::srv::{Trigger, TriggerRequest},
    tf2_msgs::TFMessage,
};

const PATIENCE: Duration = Duration::from_secs(20);

fn eventually(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "{what}");
        std::thread::yield_now();
    }
}

#[test]
fn nodes_are_there_as_long_as_they_live() {
    let environment = isolated();
    let one = node("one", &environment);
    let other = node("other", &environment);
    eventually("the other is not seen", || one.other_nodes() == ["/other"]);
    eventually("the one is not seen", || other.other_nodes() == ["/one"]);
    drop(other);
    eventually("it is still there", || one.other_nodes().is_empty());
}

#[test]
fn of_two_nodes_of_one_name_the_later_one_is_to_go() {
    let environment = isolated();
    let elder = node("same", &environment);
    let younger = node("same", &environment);
    eventually("they do not see each other", || {
        elder.namesakes().len() == 1 && younger.namesakes().len() == 1
    });
    assert!(younger.namesakes()[0].elder);
    assert!(!elder.namesakes()[0].elder);
}

#[test]
fn another_type_on_a_topic_is_counted_and_not_heard() {
    let environment = isolated();
    let (sender, receiver) = (node("sender", &environment), node("receiver", &environment));
    let publisher = sender
        .publisher::<std_msgs::String>("/x", &Qos::reliable(1))
        .unwrap();
    let subscription = receiver
        .subscription::<TFMessage>("/x", &Qos::reliable(1))
        .unwrap();
    eventually("it is not counted", || {
        publisher.incompatible() == 1 && subscription.incompatible() == 1
    });
    publisher.publish(&std_msgs::String::default()).unwrap();
    assert_eq!(publisher.matched_subscriptions(), 0);
    assert_eq!(subscription.received(), 0);
}

/// A session that is no node, beside the nodes of an environment.
fn stranger(environment: &Environment) -> Session {
    let settings = environment.zenoh.overrides.clone().unwrap();
    let mut config = ::zenoh::Config::default();
    config
        .insert_json5("scouting/multicast/enabled", "false")
        .unwrap();
    for pair in settings.split(';').filter(|pair| !pair.is_empty()) {
        let (key, value) = pair.split_once('=').unwrap();
        config.insert_json5(key, value).unwrap();
    }
    ::zenoh::open(config).wait().unwrap()
}

/// What `rmw_zenoh_cpp` attaches to a sample.
fn attachment(sequence: i64) -> Vec<u8> {
    let mut attachment = sequence.to_le_bytes().to_vec();
    attachment.extend((1_700_000_000_000_000_000_i64 + sequence - 5).to_le_bytes());
    attachment.push(16);
    attachment.extend([9; 16]);
    attachment
}

/// The forms are those of rmw_zenoh's design document, read and written here by Zenoh alone.
#[test]
fn a_session_that_is_no_node_reads_tokens_and_samples_and_writes_them() {
    let environment = isolated();
    let domain = environment.domain_id;
    let receiver = node("receiver", &environment);
    let session = stranger(&environment);
    let hash = std_msgs::String::TYPE_HASH;
    let key = format!("{domain}/chatter/std_msgs::msg::dds_::String_/{hash}");
    let text = std_msgs::String {
        data: "hello".into(),
    };

    // A publisher as rmw_zenoh announces it, and a sample with its attachment.
    let zid = session.zid();
    let token = format!(
        "@ros2_lv/{domain}/{zid}/0/1/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{hash}/::,10:,:,:,,"
    );
    let subscription = receiver
        .subscription::<std_msgs::String>("/chatter", &Qos::reliable(10))
        .unwrap();
    let token = session.liveliness().declare_token(token).wait().unwrap();
    assert!(subscription.wait_for_publishers(1, PATIENCE));
    let talker = session.declare_publisher(&key).wait().unwrap();
    eventually("there is no route", || {
        talker.matching_status().wait().unwrap().matching()
    });
    let put = talker.put(cdr::encode(&text).unwrap());
    put.attachment(attachment(5)).wait().unwrap();
    let sample = subscription.recv_timeout(PATIENCE).unwrap().unwrap();
    assert_eq!((sample.message, sample.info.sequence), (text.clone(), 5));
    assert_eq!(sample.info.writer.0, [9; 16]);
    assert_eq!(sample.info.source_time, Some(1_700_000_000_000_000_000));
    drop(token);
    eventually("it is still there", || {
        subscription.matched_publishers() == 0
    });

    // Ours, as others see it.
    let samples = session.declare_subscriber(&key).wait().unwrap();
    let publisher = receiver
        .publisher::<std_msgs::String>("/chatter", &Qos::volatile(10))
        .unwrap();
    let mut tokens = Vec::new();
    eventually("there is no token", || {
        let pattern = format!("@ros2_lv/{domain}/*/*/*/MP/**");
        let found = session.liveliness().get(pattern).wait().unwrap();
        tokens = found
            .into_iter()
            .filter_map(|reply| Some(reply.into_result().ok()?.key_expr().to_string()))
            .collect();
        tokens.iter().any(|token| token.contains("%chatter"))
    });
    let ours = tokens
        .iter()
        .find(|token| token.contains("%chatter"))
        .unwrap();
    let expected =
        format!("/MP/%/%/receiver/%chatter/std_msgs::msg::dds_::String_/{hash}/::,10:,:,:,,");
    assert!(ours.ends_with(&expected), "{ours}");
    publisher.publish(&text).unwrap();
    let sample = samples.recv_timeout(PATIENCE).unwrap().unwrap();
    assert_eq!(sample.payload().to_bytes(), cdr::encode(&text).unwrap());
    let attachment = sample.attachment().unwrap().to_bytes();
    assert_eq!(
        (attachment.len(), &attachment[..8]),
        (33, &1_i64.to_le_bytes()[..])
    );
}

#[test]
fn samples_missing_before_a_gap_come_from_the_cache_of_their_publisher() {
    let environment = isolated();
    let domain = environment.domain_id;
    let receiver = node("receiver", &environment);
    let session = stranger(&environment);
    let hash = std_msgs::String::TYPE_HASH;
    let key = format!("{domain}/gaps/std_msgs::msg::dds_::String_/{hash}");
    let text = |sequence: i64| {
        cdr::encode(&std_msgs::String {
            data: sequence.to_string(),
        })
        .unwrap()
    };
    let asked = Arc::new(AtomicU64::new(0));
    let count = Arc::clone(&asked);
    let kept = key.clone();
    let _cache = session
        .declare_queryable(format!("{key}/@adv/pub/cache"))
        .callback(move |query| {
            count.fetch_add(1, Ordering::Relaxed);
            assert_eq!(query.parameters().get("_max"), Some("10"));
            for sequence in [1, 2] {
                let reply = query.reply(&kept, text(sequence));
                reply.attachment(attachment(sequence)).wait().unwrap();
            }
        })
        .wait()
        .unwrap();
    let subscription = receiver
        .subscription::<std_msgs::String>("/gaps", &Qos::reliable(10))
        .unwrap();
    let publisher = session.declare_publisher(&key).wait().unwrap();
    eventually("there is no route", || {
        publisher.matching_status().wait().unwrap().matching()
    });
    for sequence in [3, 4, 7, 7, 8] {
        let put = publisher.put(text(sequence));
        put.attachment(attachment(sequence)).wait().unwrap();
    }
    for sequence in [1, 2, 3, 4, 7, 8] {
        let sample = subscription.recv_timeout(PATIENCE).unwrap().unwrap();
        assert_eq!(sample.message.data, sequence.to_string());
    }
    assert_eq!(subscription.lost(), 2);
    assert!((1..=2).contains(&asked.load(Ordering::Relaxed)));

    publisher.put(text(0)).wait().unwrap();
    let sample = subscription.recv_timeout(PATIENCE).unwrap().unwrap();
    assert_eq!(
        (sample.message.data.as_str(), sample.info.sequence),
        ("0", 1)
    );
}

/// As one does that has just begun or is about to end.
#[test]
fn a_server_that_drops_requests_is_not_asked_without_a_pause() {
    let environment = isolated();
    let domain = environment.domain_id;
    let caller = node("caller", &environment);
    let session = stranger(&environment);
    let (zid, hash) = (session.zid(), Trigger::TYPE_HASH);
    let type_name = "std_srvs::srv::dds_::Trigger_";
    let asked = Arc::new(AtomicU64::new(0));
    let count = Arc::clone(&asked);
    let _dropping = session
        .declare_queryable(format!("{domain}/x/{type_name}/{hash}"))
        .complete(true)
        .callback(move |_| {
            count.fetch_add(1, Ordering::Relaxed);
        })
        .wait()
        .unwrap();
    let token =
        format!("@ros2_lv/{domain}/{zid}/0/1/SS/%/%/server/%x/{type_name}/{hash}/::,10:,:,:,,");
    let _token = session.liveliness().declare_token(token).wait().unwrap();
    let client = caller.service_client::<Trigger>("/x").unwrap();
    assert!(client.wait_for_server(PATIENCE));
    let waited = Duration::from_millis(500);
    let error = client.call(&TriggerRequest::default(), waited).unwrap_err();
    assert!(matches!(error, CallError::NoReply { .. }), "{error}");
    let asked = asked.load(Ordering::Relaxed);
    assert!((1..=51).contains(&asked), "{asked} requests");
}
