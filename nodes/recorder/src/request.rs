//! What is requested of publishers, and what they offer.

use lgvi_middleware::ros::{Qos, TopicInfo};

/// Depth of a subscription: how many messages wait to be taken. RustDDS 0.15 keeps as many of each topic besides, taken
/// or not, and knows no limit in bytes: a topic takes up to twice this many of its messages. Nothing public releases them, and
/// a depth once asked for in a participant is never made less.
pub(crate) const DEPTH: usize = 8192;

/// What a subscription requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

    /// What must be requested to get from each publisher of a topic the most that it offers.
    pub(crate) fn all(topic: &TopicInfo) -> &'static [Self] {
        use Request::{Latched, Reliable, Sensor};
        let one = topic.publishers == 1;
        match (topic.reliable, topic.durable) {
            (true, true) => &[Latched],
            (true, false) if one => &[Reliable],
            (false, _) if one => &[Sensor],
            // Nobody says which of them offers what.
            (true, false) => &[Latched, Reliable],
            (false, true) => &[Latched, Sensor],
            (false, false) => &[Latched, Reliable, Sensor],
        }
    }
}

/// What all publishers of a topic offer, as it stands in the bag. Discovery tells neither history nor depth.
pub(crate) fn offered(topic: &TopicInfo) -> lgvi_bag::Qos {
    use lgvi_bag::{Durability, History, Reliability};
    lgvi_bag::Qos {
        reliability: if topic.reliable {
            Reliability::Reliable
        } else {
            Reliability::BestEffort
        },
        durability: if topic.durable {
            Durability::TransientLocal
        } else {
            Durability::Volatile
        },
        history: History::Unknown,
        depth: 0,
    }
}

#[cfg(test)]
mod tests {
    use lgvi_bag::{Durability, Reliability};

    use super::*;

    fn topic(publishers: usize, reliable: bool, durable: bool) -> TopicInfo {
        TopicInfo {
            name: "/topic".into(),
            type_name: "rosgraph_msgs/msg/Clock".into(),
            publishers,
            reliable,
            durable,
            subscriptions: 0,
        }
    }

    #[test]
    fn requests_cover_every_publisher() {
        let requests =
            |publishers, reliable, durable| Request::all(&topic(publishers, reliable, durable));
        assert_eq!(requests(1, true, true), [Request::Latched]);
        assert_eq!(requests(1, true, false), [Request::Reliable]);
        assert_eq!(requests(1, false, true), [Request::Sensor]);
        assert_eq!(requests(1, false, false), [Request::Sensor]);
        assert_eq!(requests(3, true, true), [Request::Latched]);
        let several = requests(2, true, false);
        assert_eq!(several, [Request::Latched, Request::Reliable]);
        let several = requests(2, false, false);
        assert_eq!(
            several,
            [Request::Latched, Request::Reliable, Request::Sensor]
        );
    }

    #[test]
    fn what_all_publishers_offer_is_recorded() {
        let offered = |reliable, durable| {
            let qos = offered(&topic(2, reliable, durable));
            (qos.reliability, qos.durability)
        };
        assert_eq!(
            offered(true, true),
            (Reliability::Reliable, Durability::TransientLocal)
        );
        assert_eq!(
            offered(false, false),
            (Reliability::BestEffort, Durability::Volatile)
        );
    }
}
