//! Logging that reaches other nodes; it is set up once a process, hence one test.

use std::time::Duration;

use crate::common::isolated;
use lgvi_middleware::{
    NodeArgs, log,
    ros::{Qos, RosNode},
};
use lgvi_msgs::rcl_interfaces;

#[test]
fn a_warning_reaches_rosout_and_the_last_one_too() {
    let environment = isolated();
    let (args, _) = NodeArgs::parse("lgvi_talker", []).unwrap();
    let logging = log::init(&args).unwrap();
    assert!(log::init(&args).is_err(), "a second time");

    let listener = crate::common::node("listener", &environment);
    let subscription = listener
        .subscription::<rcl_interfaces::Log>("/rosout", &Qos::reliable(10))
        .unwrap();
    let talker = RosNode::new(&args, &environment).unwrap();
    tracing::warn!(target: "lgvi_test", "before");
    let rosout = logging.attach(&talker).unwrap();
    assert!(subscription.wait_for_publishers(1, Duration::from_secs(20)));
    let next = || {
        let sample = subscription.recv_timeout(Duration::from_secs(20)).unwrap();
        sample.unwrap().message
    };
    let first = next();
    assert_eq!(
        (first.msg.as_str(), first.name.as_str()),
        ("before", "lgvi_talker")
    );
    tracing::error!(target: "lgvi_test", "last words");
    drop(rosout);
    drop(talker);
    assert_eq!(next().msg, "last words");
}
