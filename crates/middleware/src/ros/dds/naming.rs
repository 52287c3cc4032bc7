//! ROS topics and services as DDS topics, and back.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_go_there_and_back() {
        assert_eq!(dds_topic("/tf"), "rt/tf");
        assert_eq!(dds_request("/a/b"), "rq/a/bRequest");
        assert_eq!(dds_reply("/a/b"), "rr/a/bReply");
        assert_eq!(ros_topic("rt/a/b"), Some("/a/b"));
        assert_eq!(ros_topic("rq/aRequest"), None);
        assert_eq!(ros_topic("ros_discovery_info"), None);
        assert_eq!(ros_topic("rtx"), None);
    }
}
