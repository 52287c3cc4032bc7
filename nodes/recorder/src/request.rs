//! What is requested of publishers, and what they offer.

use lgvi_middleware::ros::{Qos, TopicInfo};

/// Depth of a subscription: how many messages wait to be taken. RustDDS 0.15 keeps as many of each topic besides, taken
/// or not, and knows no limit in bytes: a topic takes up to twice this many of its messages. Nothing public releases them, and
/// a depth once asked for in a participant is never made less.
pub(crate) const DEPTH: usize = 8192;

/// Topics whose publishers keep nothing for late joiners by convention. Those of this suite do, and give it to all.
const VOLATILE: [&str; 4] = ["/clock", "/diagnostics", "/parameter_events", "/tf"];

/// What a subscription requests, from the most to the least: each matches what the one before it matches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Request {
    /// Everything of publishers that keep samples for late joiners, and what they have kept.
    Latched,
    /// Everything of reliable publishers, from the match on.
    Reliable,
    /// What arrives, of every publisher.
    Sensor,
}

impl Request {
    pub(crate) fn qos(self) -> Qos {
        match self {
            Self::Latched => Qos::latched(DEPTH),
            Self::Reliable => Qos::reliable(DEPTH),
            Self::Sensor => Qos::sensor(DEPTH),
        }
    }

    /// Of a topic of which no publisher is known: the most, so that nothing is missed.
    pub(crate) fn at_first(name: &str) -> Self {
        if VOLATILE.contains(&name) {
            Self::Reliable
        } else {
            Self::Latched
        }
    }

    /// The most that every publisher of a topic offers, as `ros2 bag record` requests it.
    pub(crate) fn of(topic: &TopicInfo) -> Self {
        match (topic.reliable, topic.durable) {
            (true, true) => Self::at_first(&topic.name),
            (true, false) => Self::Reliable,
            (false, _) => Self::Sensor,
        }
    }
}

/// What all publishers of a topic offer, as it stands in the bag. Discovery tells neither history nor depth.
pub(crate) fn offered(topic: &TopicInfo) -> lgvi_bag::Qos {
    lgvi_bag::Qos {
        reliable: topic.reliable,
        durable: topic.durable,
        history: lgvi_bag::History::Unknown,
        depth: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(name: &str, reliable: bool, durable: bool) -> TopicInfo {
        TopicInfo {
            name: name.into(),
            type_name: "rosgraph_msgs/msg/Clock".into(),
            publishers: 2,
            reliable,
            durable,
            subscriptions: 0,
        }
    }

    #[test]
    fn a_request_matches_every_publisher() {
        let request = |reliable, durable| Request::of(&topic("/topic", reliable, durable));
        assert_eq!(request(true, true), Request::Latched);
        assert_eq!(request(true, false), Request::Reliable);
        assert_eq!(request(false, true), Request::Sensor);
        assert_eq!(request(false, false), Request::Sensor);
        assert!(Request::Latched < Request::Reliable && Request::Reliable < Request::Sensor);
    }

    #[test]
    fn a_request_matches_publishers_of_the_standard_kind_that_come_later() {
        for name in VOLATILE {
            assert_eq!(Request::of(&topic(name, true, true)), Request::Reliable);
        }
        for name in ["/rosout", "/tf_static"] {
            assert_eq!(Request::of(&topic(name, true, true)), Request::Latched);
        }
    }

    #[test]
    fn what_all_publishers_offer_is_recorded() {
        let offered = |reliable, durable| {
            let qos = offered(&topic("/topic", reliable, durable));
            (qos.reliable, qos.durable)
        };
        assert_eq!(offered(true, true), (true, true));
        assert_eq!(offered(false, false), (false, false));
    }
}
