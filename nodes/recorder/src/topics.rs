//! What is recorded from DDS.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Context;
use std::time::{Duration, Instant};

use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{RosNode, TopicInfo};
use lgvi_middleware::{Parameters, Shutdown, thread_waker};
use tracing::warn;

use crate::account::Account;
use crate::config::Config;
use crate::definitions::Definitions;
use crate::drain::{Looked, drain};
use crate::elsewhere::Elsewhere;
use crate::log_time::{LogTimes, Message};
use crate::outlet::Outlet;
use crate::participants::Participants;
use crate::request::Request;
use crate::selection::Wanted;
use crate::source::Source;

/// How often the graph is asked for new topics and publishers.
const DISCOVERY: Duration = Duration::from_millis(200);

/// How often it is looked whether messages have waited for their log times for long enough.
const HELD: Duration = Duration::from_millis(20);

/// How long messages may gather while they come: a thread that is woken for each one costs more than the messages.
const GATHER: Duration = Duration::from_millis(1);

/// Topics from DDS.
pub(crate) struct Topics {
    wanted: Wanted,
    definitions: Definitions,
    /// Topics that come from shared memory instead.
    elsewhere: Elsewhere,
    participants: Participants,
    sources: BTreeMap<String, Source>,
    /// Topics of a second type, with that type.
    ambiguous: BTreeSet<(String, String)>,
    times: LogTimes,
    paused: Arc<AtomicBool>,
    account: Arc<Account>,
    /// When the graph was asked last.
    asked: Option<Instant>,
}

impl Topics {
    pub(crate) fn open(
        config: &Config,
        parameters: &Parameters,
        ros: RosNode,
        elsewhere: Elsewhere,
        times: LogTimes,
        paused: Arc<AtomicBool>,
        account: Arc<Account>,
    ) -> Result<Self, NodeError> {
        let resolve = |name: &str| ros.resolve(name);
        let wanted = config.wanted(parameters, &ros.fully_qualified_name(), resolve)?;
        let mut topics = Self {
            wanted,
            definitions: Definitions::installed(),
            elsewhere,
            participants: Participants::new(ros.clone()),
            sources: BTreeMap::new(),
            ambiguous: BTreeSet::new(),
            times,
            paused,
            account,
            asked: None,
        };
        for (name, type_name) in config.typed() {
            let resolved = resolve(name)?;
            if topics.sources.contains_key(&resolved) || !topics.wanted.takes(&resolved) {
                continue;
            }
            let definition = topics.definitions.find(type_name).map_err(|why| {
                NodeError::Input(format!(
                    "parameter \"topics\" has \"{name}={type_name}\", expected a message type that is known: {why}"
                ))
            })?;
            let request = Request::at_first(&resolved);
            let source = Source::open(
                name,
                definition,
                request,
                &mut topics.participants,
                &topics.account,
            )?;
            topics.sources.insert(source.name().to_owned(), source);
        }
        Ok(topics)
    }

    /// Receives until the shutdown.
    pub(crate) fn run(mut self, mut outlet: Outlet, shutdown: &Shutdown) -> Result<(), NodeError> {
        let waker = thread_waker();
        let mut context = Context::from_waker(&waker);
        let drained = drain(shutdown, || {
            self.discover()?;
            let found = self.receive(&mut context, &mut outlet);
            let pause = if found {
                outlet.tick();
                GATHER
            } else {
                outlet.hand_over();
                if self.times.holds() { HELD } else { DISCOVERY }
            };
            let over = outlet.is_over();
            Ok(Looked { found, pause, over })
        });
        self.times.finish(|message| put(&mut outlet, message));
        drained
    }

    fn receive(&mut self, context: &mut Context<'_>, outlet: &mut Outlet) -> bool {
        let mut found = false;
        let (times, paused) = (&mut self.times, &self.paused);
        times.release(|message| put(outlet, message));
        for source in self.sources.values_mut() {
            found |= source.receive(
                context,
                &self.participants,
                &self.account,
                |track, message, stamp| {
                    if paused.load(Ordering::Relaxed) {
                        track.left_out.fetch_add(1, Ordering::Relaxed);
                    } else {
                        track.received.fetch_add(1, Ordering::Relaxed);
                        times.log(message, stamp, |message| put(outlet, message));
                    }
                },
            );
        }
        found
    }

    /// Subscribes to topics that have come up since, and to publishers that offer less than has been requested.
    fn discover(&mut self) -> Result<(), NodeError> {
        if self.asked.is_some_and(|asked| asked.elapsed() < DISCOVERY) {
            return Ok(());
        }
        self.asked = Some(Instant::now());
        let topics = self.participants.topics();
        self.elsewhere.look(&topics, Instant::now(), &self.account);
        for topic in topics {
            let unwanted = topic.publishers == 0
                || self.elsewhere.has(&topic.name)
                || !self.wanted.takes(&topic.name);
            if unwanted {
                continue;
            }
            match self.sources.get_mut(&topic.name) {
                Some(source) if source.type_name() == topic.type_name => {
                    source.request(Request::of(&topic), &mut self.participants)?;
                }
                Some(source) => {
                    let second = (topic.name.clone(), topic.type_name.clone());
                    if self.ambiguous.insert(second) {
                        warn!(
                            "{} is recorded as {}; what is published there as {} is not",
                            topic.name,
                            source.type_name(),
                            topic.type_name
                        );
                    }
                }
                None => self.begin(&topic)?,
            }
        }
        Ok(())
    }

    /// Subscribes to a topic, or says once why it cannot be recorded.
    fn begin(&mut self, topic: &TopicInfo) -> Result<(), NodeError> {
        let definition = match self.definitions.find(&topic.type_name) {
            Ok(definition) => definition,
            Err(why) => {
                if self.account.refuse(&topic.name) {
                    let TopicInfo {
                        name, type_name, ..
                    } = topic;
                    warn!("{name} is not recorded, its type {type_name} is not known: {why}");
                }
                return Ok(());
            }
        };
        let source = Source::open(
            &topic.name,
            definition,
            Request::of(topic),
            &mut self.participants,
            &self.account,
        )?;
        self.sources.insert(topic.name.clone(), source);
        Ok(())
    }
}

fn put(outlet: &mut Outlet, Message { head, cdr }: Message) {
    outlet.put(head, &cdr);
}
