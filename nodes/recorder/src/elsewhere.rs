//! Topics that are taken from shared memory, and whether they come there.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use lgvi_middleware::ros::TopicInfo;
use tracing::warn;

use crate::account::{Account, Track};

/// How long a topic may be on DDS alone: its publisher may be on its way to shared memory.
const PATIENCE: Duration = Duration::from_secs(2);

/// Topics that are taken from shared memory.
pub(crate) struct Elsewhere(Vec<Watched>);

struct Watched {
    track: Arc<Track>,
    /// Since when there are publishers on DDS and none in shared memory.
    since: Option<Instant>,
}

impl Elsewhere {
    pub(crate) fn new(tracks: impl Iterator<Item = Arc<Track>>) -> Self {
        let watched = |track| Watched { track, since: None };
        Self(tracks.map(watched).collect())
    }

    /// Whether a topic is one of them.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.0.iter().any(|watched| watched.track.name == name)
    }

    /// Says of which of them the messages come over DDS only, and are not recorded.
    pub(crate) fn look(&mut self, topics: &[TopicInfo], now: Instant, account: &Account) {
        for Watched { track, since } in &mut self.0 {
            let name = &track.name;
            let published = |topic: &TopicInfo| topic.name == *name && topic.publishers > 0;
            if track.in_memory.load(Ordering::Relaxed) || !topics.iter().any(published) {
                if since.take().is_some() {
                    account.accept(name);
                }
                continue;
            }
            let since = *since.get_or_insert(now);
            if now.duration_since(since) >= PATIENCE && account.refuse(name) {
                warn!(
                    "{name} is published over DDS only and not recorded: \"states\" takes it from shared memory; \
                     left out there, it is recorded from DDS"
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(name: &str, publishers: usize) -> TopicInfo {
        TopicInfo {
            name: name.to_owned(),
            type_name: "lgvi_msgs/msg/SystemState".to_owned(),
            publishers,
            reliable: true,
            durable: false,
            subscriptions: 0,
        }
    }

    #[test]
    fn a_topic_that_stays_on_dds_alone_is_not_recorded() {
        let account = Account::default();
        let [alone, coming] = ["/alone", "/coming"].map(|name| account.add(name).1);
        let mut elsewhere = Elsewhere::new([&alone, &coming].map(Arc::clone).into_iter());
        assert!(elsewhere.has("/alone") && !elsewhere.has("/other"));
        let refused = || {
            let status = format!("{:?}", account.status(false));
            status.contains("topics are not recorded")
        };
        let start = Instant::now();
        let graph = [topic("/alone", 1), topic("/coming", 1), topic("/other", 1)];
        elsewhere.look(&graph, start, &account);
        coming.in_memory.store(true, Ordering::Relaxed);
        elsewhere.look(&graph, start + PATIENCE / 2, &account);
        assert!(!refused());
        elsewhere.look(&graph, start + PATIENCE, &account);
        assert!(refused());
        assert!(!account.refuse("/alone") && account.refuse("/coming"));
        account.accept("/coming");
        alone.in_memory.store(true, Ordering::Relaxed);
        elsewhere.look(&graph, start + 2 * PATIENCE, &account);
        assert!(!refused());
        // A publisher that goes in time is none.
        alone.in_memory.store(false, Ordering::Relaxed);
        elsewhere.look(&graph, start + 3 * PATIENCE, &account);
        elsewhere.look(&[topic("/alone", 0)], start + 4 * PATIENCE, &account);
        elsewhere.look(&graph, start + 5 * PATIENCE, &account);
        assert!(!refused());
    }
}
