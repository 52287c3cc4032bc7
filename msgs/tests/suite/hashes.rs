//! Type hashes against those of rosidl and rosbags.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use lgvi_msgs::{
    Action, RosMessage, Service, action::PlanManeuver, endpoint_types, message_types, srv::Step,
};

#[test]
fn every_hash_is_the_one_that_rosidl_computes() {
    let expected: BTreeMap<&str, &str> =
        serde_json::from_str(include_str!("../expected_hashes.json")).unwrap();
    let messages = message_types()
        .iter()
        .map(|message_type| (message_type.name, message_type.hash));
    let ours: BTreeMap<&str, &str> = messages.chain(endpoint_types().iter().copied()).collect();
    assert_eq!(ours, expected);
}

#[test]
fn a_service_and_an_action_know_their_own() {
    let of = |name: &str| {
        endpoint_types()
            .iter()
            .find(|entry| entry.0 == name)
            .unwrap()
            .1
    };
    assert_eq!(Step::TYPE_HASH, of("lgvi_msgs/srv/Step"));
    assert_ne!(Step::TYPE_HASH, <Step as Service>::Request::TYPE_HASH);
    assert_eq!(PlanManeuver::TYPE_HASH, of("lgvi_msgs/action/PlanManeuver"));
    let send_goal = <PlanManeuver as Action>::SendGoal::TYPE_HASH;
    assert_eq!(send_goal, of("lgvi_msgs/action/PlanManeuver_SendGoal"));
}
