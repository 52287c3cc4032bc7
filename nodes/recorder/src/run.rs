//! The node as a managed node: each time that it is active it makes a bag.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use lgvi_bag::BagWriter;
use lgvi_middleware::ros::{Diagnosed, Level, Status};
use lgvi_middleware::shm::ShmNode;
use lgvi_middleware::{ParameterSpec, Shutdown};
use lgvi_node::{Event, Managed, Node, NodeError, Stopped};
use tracing::info;

use crate::config::{self, Config};
use crate::log_time::StateTime;
use crate::sink::{self, Sink};
use crate::states::States;
use crate::topics::Topics;

/// How often it is looked for whether to stop.
const LOOK: Duration = Duration::from_millis(20);

/// A recorder, and the bag that it fills.
pub(crate) struct Recorder {
    shm: ShmNode,
    /// While the node is active.
    opened: Option<Opened>,
    counts: Arc<Counts>,
    _diagnosed: Diagnosed,
}

/// What a recording needs.
struct Opened {
    config: Config,
    writer: BagWriter,
    states: States,
    topics: Topics,
}

/// What `/diagnostics` has of a recording.
#[derive(Default)]
struct Counts {
    written: AtomicU64,
    states_lost: AtomicU64,
    topics_lost: AtomicU64,
}

impl Managed for Recorder {
    const NAME: &'static str = "lgvi_recorder";

    fn parameters() -> Vec<ParameterSpec> {
        config::specifications()
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        Config::read(&node.parameters)?;
        let counts = Arc::<Counts>::default();
        let told = Arc::clone(&counts);
        Ok(Self {
            opened: None,
            shm: node.shm()?,
            counts,
            _diagnosed: node.diagnostics.add("recording", move || told.status()),
        })
    }

    fn activate(&mut self, node: &Node) -> Result<(), NodeError> {
        let config = Config::read(&node.parameters)?;
        self.opened = Some(Opened::new(node, config, &self.shm)?);
        self.counts.reset();
        Ok(())
    }

    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        if let Some(opened) = self.opened.take() {
            opened.record(node, &self.counts)?;
        }
        Ok(Stopped::Interrupted)
    }

    fn clean_up(self, _: &Node) -> Result<(), NodeError> {
        // A bag that nothing was recorded into is closed too.
        let Some(Opened { writer, .. }) = self.opened else {
            return Ok(());
        };
        writer
            .finish(std::collections::BTreeMap::new())
            .map(drop)
            .map_err(NodeError::runtime)
    }
}

impl Opened {
    fn new(node: &Node, config: Config, shm: &ShmNode) -> Result<Self, NodeError> {
        let resolve = |topic: &str| node.args.resolve(topic).map_err(NodeError::input);
        let elsewhere = config
            .states
            .iter()
            .map(|topic| resolve(topic))
            .collect::<Result<_, _>>()?;
        let time = Arc::<StateTime>::default();
        let states = States::open(&config, shm, Arc::clone(&time), resolve)?;
        let topics = Topics::open(&config, node.ros.clone(), elsewhere, time)?;
        Ok(Self {
            // Last, so that no bag is left where the others fail.
            writer: sink::create(&config).map_err(NodeError::input)?,
            states,
            topics,
            config,
        })
    }

    /// Records until the node is to stop, and closes the bag.
    fn record(self, node: &Node, counts: &Arc<Counts>) -> Result<(), NodeError> {
        let Self {
            config,
            writer,
            states,
            topics,
        } = self;
        let sink = {
            let events = Arc::clone(&node.events);
            let counts = Arc::clone(counts);
            let tell = move |written: &sink::Counts| {
                counts
                    .written
                    .store(written.values().sum(), Ordering::Relaxed);
                let _ = events.report(&Event::Recording {
                    messages: written.clone(),
                    lost: counts.lost(),
                });
            };
            Sink::start(writer, tell).map_err(NodeError::runtime)?
        };
        let stop = Shutdown::new();
        let received = std::thread::scope(|scope| {
            let queue = sink.queue.clone();
            let from_dds = scope.spawn(|| {
                let queue = queue;
                topics.run(&queue, &counts.topics_lost, &stop)
            });
            let queue = sink.queue.clone();
            let from_shm = scope.spawn(|| {
                let queue = queue;
                states.run(&queue, &counts.states_lost, &stop)
            });
            while !node.interrupted()
                && !sink.failed()
                && !from_dds.is_finished()
                && !from_shm.is_finished()
            {
                std::thread::sleep(LOOK);
            }
            stop.request();
            let panicked = |_| NodeError::runtime("a receiving thread has panicked");
            let outcomes = [
                from_dds.join().map_err(panicked),
                from_shm.join().map_err(panicked),
            ];
            outcomes
                .into_iter()
                .try_for_each(|outcome| outcome.and_then(|received| received))
        });

        let written = sink
            .finish()
            .ok_or_else(|| NodeError::runtime("the writing thread has panicked"))?;
        let summary = written.map_err(NodeError::runtime)?;
        let messages: u64 = summary.messages.values().sum();
        let bag = config.output;
        info!("recorded {messages} messages in {}", bag.display());
        node.report(&Event::Recorded {
            bag,
            messages: summary.messages,
            lost: counts.lost(),
        });
        received
    }
}

impl Counts {
    /// Messages known to be missing.
    fn lost(&self) -> u64 {
        self.states_lost.load(Ordering::Relaxed) + self.topics_lost.load(Ordering::Relaxed)
    }

    fn reset(&self) {
        for count in [&self.written, &self.states_lost, &self.topics_lost] {
            count.store(0, Ordering::Relaxed);
        }
    }

    fn status(&self) -> Status {
        let written = self.written.load(Ordering::Relaxed);
        let lost = self.lost();
        Status::ok(format!("{written} messages written"))
            .when(lost > 0, Level::Warn, "messages are missing")
            .value("messages written", written)
            .value("messages lost", lost)
    }
}
