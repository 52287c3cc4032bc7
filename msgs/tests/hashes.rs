//! Type hashes against an independent implementation.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use lgvi_msgs::message_types;

#[test]
fn every_hash_is_the_one_rosbags_computes() {
    let expected: BTreeMap<&str, &str> =
        serde_json::from_str(include_str!("expected_hashes.json")).unwrap();
    let ours: BTreeMap<&str, &str> = message_types()
        .iter()
        .map(|message_type| (message_type.name, message_type.hash))
        .collect();
    assert_eq!(ours, expected);
}
