//! ROS names as they appear in DDS, and back.

use super::RosError;

const TOPIC_PREFIX: &str = "rt";
const REQUEST: (&str, &str) = ("rq", "Request");
const REPLY: (&str, &str) = ("rr", "Reply");

/// `/a/b` is `rt/a/b`.
pub(super) fn dds_topic(topic: &str) -> String {
    format!("{TOPIC_PREFIX}{topic}")
}

/// Requests of the service `/a/b` go to `rq/a/bRequest`.
pub(super) fn dds_request(service: &str) -> String {
    format!("{}{service}{}", REQUEST.0, REQUEST.1)
}

/// Replies of the service `/a/b` go to `rr/a/bReply`.
pub(super) fn dds_reply(service: &str) -> String {
    format!("{}{service}{}", REPLY.0, REPLY.1)
}

/// The ROS topic of a DDS topic; `None` for services and DDS's own topics.
pub(super) fn ros_topic(dds_topic: &str) -> Option<&str> {
    dds_topic
        .strip_prefix(TOPIC_PREFIX)
        .filter(|topic| topic.starts_with('/'))
}

/// `package/msg/Type` is `package::msg::dds_::Type_`; `srv` and `action` likewise.
pub(super) fn dds_type(type_name: &str) -> Result<String, RosError> {
    let mut parts = type_name.split('/');
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(package), Some(kind @ ("msg" | "srv" | "action")), Some(name), None)
            if !package.is_empty() && !name.is_empty() =>
        {
            Ok(format!("{package}::{kind}::dds_::{name}_"))
        }
        _ => Err(RosError::TypeName(type_name.into())),
    }
}

/// The ROS message type of a DDS type; `None` if it is none.
pub(super) fn ros_type(dds_type: &str) -> Option<String> {
    let (package, name) = dds_type.strip_suffix('_')?.split_once("::dds_::")?;
    Some(format!("{}/{name}", package.replace("::", "/")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_and_types_go_there_and_back() {
        assert_eq!(dds_topic("/tf"), "rt/tf");
        assert_eq!(dds_request("/a/b"), "rq/a/bRequest");
        assert_eq!(dds_reply("/a/b"), "rr/a/bReply");
        assert_eq!(ros_topic("rt/a/b"), Some("/a/b"));
        assert_eq!(ros_topic("rq/aRequest"), None);
        assert_eq!(ros_topic("ros_discovery_info"), None);
        assert_eq!(ros_topic("rtx"), None);
        let dds = dds_type("nav_msgs/msg/Odometry").unwrap();
        assert_eq!(dds, "nav_msgs::msg::dds_::Odometry_");
        assert_eq!(ros_type(&dds).as_deref(), Some("nav_msgs/msg/Odometry"));
        assert_eq!(ros_type("DCPSTopic"), None);
    }

    #[test]
    fn malformed_types_are_refused() {
        for bad in [
            "",
            "Odometry",
            "nav_msgs/Odometry",
            "a/type/B",
            "a/msg/",
            "a/msg/B/c",
        ] {
            assert!(dds_type(bad).is_err(), "{bad:?} was accepted");
        }
    }
}
