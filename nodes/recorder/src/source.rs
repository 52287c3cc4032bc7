//! A topic from DDS, and its subscription.

use std::collections::VecDeque;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use lgvi_bag::{ROS2MSG, Topic};
use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{RawSubscription, TopicInfo};
use lgvi_msgs::{RosMessage, cdr, msg};
use tracing::{info, warn};

use crate::account::{Account, Track};
use crate::batch::Head;
use crate::definitions::Definition;
use crate::log_time::Message;
use crate::participants::Participants;
use crate::request::{DEPTH, Request, offered};
use crate::seen::Seen;
use crate::stamp::Stamped;

/// How long a subscription goes on beside the one that takes its place, which has to be matched first.
const HANDOVER: Duration = Duration::from_secs(2);

/// A topic and its subscription; two while a publisher that offers less has another one take its place.
pub(crate) struct Source {
    /// The name to subscribe by; the topic's own once there is a subscription.
    name: String,
    definition: Definition,
    stamped: Stamped,
    subscriptions: VecDeque<Subscribed>,
    /// Subscriptions that there have been, so far.
    count: usize,
    /// A publisher may be matched with two of them.
    seen: Seen,
    place: usize,
    track: Arc<Track>,
}

struct Subscribed {
    request: Request,
    since: Instant,
    subscription: RawSubscription,
}

impl Source {
    /// Subscribes to a topic by its name, which is expanded and remapped.
    pub(crate) fn open(
        name: &str,
        definition: Definition,
        request: Request,
        participants: &mut Participants,
        account: &Account,
    ) -> Result<Self, NodeError> {
        let first = subscribe(name, &definition, request, 0, participants)?;
        let name = first.subscription.topic().to_owned();
        let (place, track) = account.add(&name);
        info!("recording {name}");
        Ok(Self {
            name,
            stamped: Stamped::of(&definition),
            definition,
            subscriptions: VecDeque::from([first]),
            count: 1,
            seen: Seen::default(),
            place,
            track,
        })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn type_name(&self) -> &str {
        &self.definition.type_name
    }

    /// Has a subscription that requests less take the place of the present one, unless that does already.
    pub(crate) fn request(
        &mut self,
        request: Request,
        participants: &mut Participants,
    ) -> Result<(), NodeError> {
        let latest = self.subscriptions.back();
        if latest.is_some_and(|latest| latest.request >= request) {
            return Ok(());
        }
        let next = subscribe(
            &self.name,
            &self.definition,
            request,
            self.count,
            participants,
        )?;
        self.subscriptions.push_back(next);
        self.count += 1;
        Ok(())
    }

    /// Ends the subscription whose place has been taken; what it has received has been taken.
    fn hand_over(&mut self) {
        if let (Some(old), Some(new)) = (self.subscriptions.front(), self.subscriptions.get(1))
            && new.since.elapsed() >= HANDOVER
            && new.subscription.matched_publishers() >= old.subscription.matched_publishers()
        {
            self.subscriptions.pop_front();
        }
    }

    /// Takes what has arrived, and has the task woken when more does; whether that was anything.
    pub(crate) fn receive(
        &mut self,
        context: &mut Context<'_>,
        participants: &Participants,
        account: &Account,
        mut take: impl FnMut(&Track, Message, Option<i64>),
    ) -> bool {
        let mut found = false;
        for Subscribed { subscription, .. } in &self.subscriptions {
            // No more than has room to wait: others are not kept waiting by publishers that are faster than this.
            for _ in 0..DEPTH {
                let sample = match pin!(subscription.recv()).poll(context) {
                    Poll::Ready(Ok(sample)) => sample,
                    Poll::Pending => break,
                    Poll::Ready(Err(error)) => {
                        warn!("{error}");
                        found = true;
                        continue;
                    }
                };
                found = true;
                if !self.seen.insert(sample.info.writer, sample.info.sequence) {
                    continue;
                }
                self.track.topic.get_or_init(|| {
                    let topics = participants.topics();
                    describe(&self.name, &self.definition, &topics)
                });
                if self.definition.type_name == msg::Scene::TYPE_NAME
                    && let Ok(scene) = cdr::decode::<msg::Scene>(&sample.message)
                {
                    account.fly(scene.name);
                }
                let stamp = self.stamped.read(&sample.message);
                let received = sample.info.received_time;
                let head = Head {
                    track: self.place,
                    publisher: u128::from_le_bytes(sample.info.writer.0),
                    log_time: received,
                    publish_time: stamp.or(sample.info.source_time).unwrap_or(received),
                    sequence: sample.info.sequence,
                };
                let cdr = sample.message;
                take(&self.track, Message { head, cdr }, stamp);
            }
        }
        if !found {
            self.hand_over();
        }
        self.track.lost.store(self.lost(), Ordering::Relaxed);
        found
    }

    /// What one subscription has lost another may have received.
    fn lost(&self) -> u64 {
        match self.subscriptions.front() {
            Some(only) if self.count == 1 => only.subscription.lost(),
            _ => self.seen.missing(),
        }
    }
}

fn subscribe(
    name: &str,
    definition: &Definition,
    request: Request,
    count: usize,
    participants: &mut Participants,
) -> Result<Subscribed, NodeError> {
    let subscription =
        participants
            .get(count)?
            .raw_subscription(name, &definition.type_name, &request.qos())?;
    Ok(Subscribed {
        request,
        since: Instant::now(),
        subscription,
    })
}

/// How a topic stands in the bag.
fn describe(name: &str, definition: &Definition, topics: &[TopicInfo]) -> Topic {
    let known = topics
        .iter()
        .find(|topic| topic.name == name && topic.type_name == definition.type_name);
    Topic {
        name: name.to_owned(),
        type_name: definition.type_name.clone(),
        type_hash: definition.hash.clone(),
        definition: definition.text.clone(),
        definition_encoding: ROS2MSG.to_owned(),
        // A publisher that has gone has offered at least what was requested of it.
        qos: known.map(offered).unwrap_or_default(),
    }
}
