//! Topics of other nodes.

use std::collections::BTreeMap;

/// A topic of which other participants have announced endpoints.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicInfo {
    /// The absolute name.
    pub name: String,
    /// `package/msg/Type`.
    pub type_name: String,
    /// Publishers of other participants.
    pub publishers: usize,
    /// Whether all of them are reliable.
    pub reliable: bool,
    /// Whether all of them keep samples for late joiners.
    pub durable: bool,
    /// Subscriptions of other participants.
    pub subscriptions: usize,
}

/// The topics of endpoints, each by the name and type of its topic and, of a publisher, whether it is reliable and durable;
/// ordered by name and type.
pub(super) fn collect(
    endpoints: impl Iterator<Item = (String, String, Option<(bool, bool)>)>,
) -> Vec<TopicInfo> {
    let mut topics = BTreeMap::new();
    for (name, type_name, offer) in endpoints {
        let key = (name.clone(), type_name.clone());
        let topic = topics.entry(key).or_insert_with(|| TopicInfo {
            name,
            type_name,
            publishers: 0,
            reliable: true,
            durable: true,
            subscriptions: 0,
        });
        match offer {
            Some((reliable, durable)) => {
                topic.publishers += 1;
                topic.reliable &= reliable;
                topic.durable &= durable;
            }
            None => topic.subscriptions += 1,
        }
    }
    topics.into_values().collect()
}
