//! The node as a managed node: each time that it is active it makes a bag.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use lgvi_bag::{BagWriter, Rest, WriteError};
use lgvi_common::Event;
use lgvi_middleware::node::{Managed, Node, NodeError, Stopped};
use lgvi_middleware::ros::Diagnosed;
use lgvi_middleware::shm::ShmNode;
use lgvi_middleware::sync::lock;
use lgvi_middleware::{ParameterSpec, Shutdown};
use tracing::info;

use crate::account::Account;
use crate::config::{self, Config};
use crate::elsewhere::Elsewhere;
use crate::log_time::{LogTimes, StateTime};
use crate::outlet::Outlet;
use crate::queue::Queue;
use crate::services::Services;
use crate::sink::Sink;
use crate::states::States;
use crate::topics::Topics;

/// How often it is looked for whether to stop.
const LOOK: Duration = Duration::from_millis(20);

/// How often it is looked for what topics have lost: what one subscription lacks another may bring soon.
const LOSSES: Duration = Duration::from_secs(1);

/// A recorder, and the bag that it fills.
pub(crate) struct Recorder {
    shm: ShmNode,
    /// While the node is active.
    opened: Option<Opened>,
    services: Services,
    /// The account of the last recording.
    account: Arc<Mutex<Arc<Account>>>,
    _diagnosed: Diagnosed,
}

/// What a recording needs.
struct Opened {
    config: Config,
    writer: BagWriter,
    states: States,
    topics: Topics,
    account: Arc<Account>,
}

impl Managed for Recorder {
    const NAME: &'static str = "lgvi_recorder";

    fn parameters() -> Vec<ParameterSpec> {
        config::specifications()
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        let config = Config::read(&node.parameters)?;
        let services = Services::serve(&node.ros)?;
        services
            .paused
            .store(config.start_paused, Ordering::Relaxed);
        let account = Arc::<Mutex<Arc<Account>>>::default();
        let (told, paused) = (Arc::clone(&account), Arc::clone(&services.paused));
        let status = move || lock(&told).status(paused.load(Ordering::Relaxed));
        Ok(Self {
            shm: node.shm()?,
            opened: None,
            services,
            account,
            _diagnosed: node.diagnostics.add("recording", status),
        })
    }

    fn activate(&mut self, node: &Node) -> Result<(), NodeError> {
        let config = Config::read(&node.parameters)?;
        let opened = Opened::new(node, config, &self.shm, &self.services)?;
        *lock(&self.account) = Arc::clone(&opened.account);
        self.opened = Some(opened);
        Ok(())
    }

    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        if let Some(opened) = self.opened.take() {
            opened.record(node, &self.services)?;
        }
        Ok(Stopped::Interrupted)
    }

    fn clean_up(self, _: &Node) -> Result<(), NodeError> {
        // A bag that nothing was recorded into is closed too.
        let Some(Opened {
            writer, account, ..
        }) = self.opened
        else {
            return Ok(());
        };
        writer
            .finish(account.metadata())
            .map(drop)
            .map_err(NodeError::runtime)
    }
}

impl Opened {
    fn new(
        node: &Node,
        config: Config,
        shm: &ShmNode,
        services: &Services,
    ) -> Result<Self, NodeError> {
        let names = config.states(|topic| node.args.resolve(topic))?;
        let time = Arc::<StateTime>::default();
        let account = Arc::<Account>::default();
        let clock = &node.clock;
        let paused = || Arc::clone(&services.paused);
        let states = States::open(
            &config,
            &names,
            shm,
            clock.clone(),
            Arc::clone(&time),
            paused(),
            &account,
        )?;
        let times = LogTimes::new(config.log_time, config.await_stamp, clock.clone(), time);
        let ros = node.ros.clone();
        let elsewhere = Elsewhere::new(states.tracks());
        let told = Arc::clone(&account);
        let parameters = &node.parameters;
        let topics = Topics::open(&config, parameters, ros, elsewhere, times, paused(), told)?;
        let writer = BagWriter::create(&config.output, config.options);
        Ok(Self {
            // Last, so that no bag is left where the others fail.
            writer: writer.map_err(NodeError::input)?,
            states,
            topics,
            account,
            config,
        })
    }

    /// Records until the node is to stop, and closes the bag.
    fn record(self, node: &Node, services: &Services) -> Result<(), NodeError> {
        let Self {
            config,
            writer,
            states,
            topics,
            account,
        } = self;
        let queue = Queue::new(config.cache, Arc::clone(&account));
        let outlets = [Outlet::new(&queue), Outlet::new(&queue)];
        let sink = {
            let (events, told) = (Arc::clone(&node.events), Arc::clone(&account));
            let tell = move || {
                let (waits, waited) = told.waits();
                events.progress(Event::Recording {
                    messages: told.written(),
                    lost: told.lost().values().sum(),
                    waits,
                    waited,
                });
            };
            Sink::start(writer, &queue, &account, tell).map_err(NodeError::runtime)?
        };
        let attached = services.attach(&queue);
        let received = receive(node, &sink, states, topics, outlets, &account);
        drop(attached);

        let written = sink
            .finish()
            .ok_or_else(|| NodeError::runtime("the writing thread has panicked"))?;
        let (messages, written) = match written {
            Ok(summary) => (summary.messages, Ok(())),
            Err(error) => {
                let closed = closed(&error);
                let error = NodeError::runtime(&error);
                match closed {
                    Some(messages) => (messages, Err(error)),
                    None => return Err(error),
                }
            }
        };
        let total: u64 = messages.values().sum();
        let lost: u64 = account.lost().values().sum();
        let bag = config.output;
        info!(
            "recorded {total} messages in {}, {lost} lost",
            bag.display()
        );
        let (waits, waited) = account.waits();
        node.report(Event::Recorded {
            bag,
            messages,
            lost,
            waits,
            waited,
        });
        written.and(received)
    }
}

/// What is in a bag that has been closed after an error, by topic.
fn closed(error: &WriteError) -> Option<BTreeMap<String, u64>> {
    match error {
        WriteError::Failed {
            rest: Rest::Closed { messages, .. },
            ..
        } => Some(messages.clone()),
        _ => None,
    }
}

/// Receives on both ways until the node is to stop, or writing has failed.
fn receive(
    node: &Node,
    sink: &Sink,
    states: States,
    topics: Topics,
    [to_states, to_topics]: [Outlet; 2],
    account: &Account,
) -> Result<(), NodeError> {
    let stop = Shutdown::new();
    thread::scope(|scope| {
        let from_dds = scope.spawn(|| topics.run(to_topics, &stop));
        let from_shm = scope.spawn(|| states.run(to_states, &stop));
        let mut looked = Instant::now();
        while !node.interrupted()
            && !sink.failed()
            && !from_dds.is_finished()
            && !from_shm.is_finished()
        {
            thread::sleep(LOOK);
            if looked.elapsed() >= LOSSES {
                account.complain();
                looked = Instant::now();
            }
        }
        stop.request();
        from_dds.thread().unpark();
        from_shm.thread().unpark();
        let panicked = |_| NodeError::runtime("a receiving thread has panicked");
        let outcomes = [
            from_dds.join().map_err(panicked),
            from_shm.join().map_err(panicked),
        ];
        account.complain();
        outcomes
            .into_iter()
            .try_for_each(|outcome| outcome.and_then(|received| received))
    })
}
