//! What a node says of its endpoints.

use std::{
    net::{IpAddr, Ipv4Addr},
    thread,
    time::{Duration, Instant},
};

use lgvi_middleware::ros::Qos;
use lgvi_msgs::tf2_msgs::TFMessage;
use ros2_client::{builtin_topics::ros_discovery, entities_info::ParticipantEntitiesInfo};
use rustdds::{DomainParticipantBuilder, QosPolicies, TopicKind};

use crate::common::{isolated, node};

const PATIENCE: Duration = Duration::from_secs(20);

/// An announcement has all endpoints of a node: one for each of many endpoints would be work for the square of their number.
#[test]
fn endpoints_that_are_made_together_are_announced_together() {
    const COUNT: usize = 50;
    let environment = isolated();
    let observer = DomainParticipantBuilder::new(environment.domain_id)
        .with_only_networks(vec![IpAddr::from(Ipv4Addr::LOCALHOST)])
        .build()
        .unwrap();
    let subscriber = observer
        .create_subscriber(&QosPolicies::qos_none())
        .unwrap();
    let (name, kind) = (ros_discovery::TOPIC_NAME, ros_discovery::TYPE_NAME);
    let qos = &ros_discovery::QOS_SUB;
    let topic = observer.create_topic(name.into(), kind.into(), qos, TopicKind::NoKey);
    let mut reader = subscriber
        .create_datareader_no_key_cdr::<ParticipantEntitiesInfo>(&topic.unwrap(), None)
        .unwrap();
    let sender = node("sender", &environment);

    // How many publishers each announcement has.
    let mut heard = Vec::new();
    let mut hear = |enough: &dyn Fn(&[usize]) -> bool| {
        let start = Instant::now();
        while !enough(&heard) {
            assert!(start.elapsed() < PATIENCE, "{heard:?}");
            while let Some(sample) = reader.take_next_sample().unwrap() {
                let node = serde_json::to_value(&sample.value().nodes()[0]).unwrap();
                heard.push(node["writer_gid_seq"].as_array().unwrap().len());
            }
            thread::sleep(Duration::from_millis(1));
        }
        heard.clone()
    };
    let before = *hear(&|heard| !heard.is_empty()).last().unwrap();
    let publisher =
        |index| sender.publisher::<TFMessage>(&format!("/topic_{index}"), &Qos::reliable(1));
    let publishers: Vec<_> = sender.announce_together(|| (0..COUNT).map(publisher).collect());
    assert!(publishers.iter().all(Result::is_ok));
    let mut heard = hear(&|heard| heard.last() == Some(&(before + COUNT)));
    heard.dedup();
    assert_eq!(heard, [before, before + COUNT]);
}
