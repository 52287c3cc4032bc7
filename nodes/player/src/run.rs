//! The node as a managed node.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use lgvi_bag::BagReader;
use lgvi_middleware::ParameterSpec;
use lgvi_middleware::ros::{Diagnosed, Status};
use lgvi_node::{Event, Managed, Node, NodeError, Stopped};
use tracing::info;

use crate::channels::Channels;
use crate::clock::RecordedClock;
use crate::config::{self, Config};

/// How often waiting looks whether it is over.
const WAIT: Duration = Duration::from_millis(1);

/// How long a message may be waited for at a stretch.
const SLICE: Duration = Duration::from_millis(10);

/// A replay, and all that it needs.
pub(crate) struct Player {
    bag: BagReader,
    channels: Channels,
    clock: Option<RecordedClock>,
    await_subscribers: usize,
    /// Messages played.
    played: u64,
    count: Arc<AtomicU64>,
    _diagnosed: Diagnosed,
}

impl Managed for Player {
    const NAME: &'static str = "lgvi_player";

    fn parameters() -> Vec<ParameterSpec> {
        config::specifications()
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        let config = Config::read(&node.parameters)?;
        let lossless = config::rate(&node.parameters)? == 0.0;
        let bag = BagReader::open(&config.bag).map_err(NodeError::input)?;
        let channels = Channels::open(&bag, node, lossless)?;
        let clock = config
            .clock
            .then(|| RecordedClock::new(&node.ros))
            .transpose()?;
        let count = Arc::<AtomicU64>::default();
        let played = Arc::clone(&count);
        let diagnosed = node.diagnostics.add("replay", move || {
            let played = played.load(Ordering::Relaxed);
            Status::ok("playing").value("messages", played)
        });
        Ok(Self {
            bag,
            channels,
            clock,
            await_subscribers: config.await_subscribers,
            played: 0,
            count,
            _diagnosed: diagnosed,
        })
    }

    /// Goes on where it was interrupted.
    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        while !node.interrupted() && !self.channels.have_subscribers(self.await_subscribers)? {
            std::thread::sleep(WAIT);
        }
        let mut pace = Pace::new(config::rate(&node.parameters)?);
        let mut generation = node.parameters.generation();
        let skipped = usize::try_from(self.played).map_err(NodeError::runtime)?;
        let mut last = 0;
        for message in self.bag.messages().skip(skipped) {
            let message = message.map_err(NodeError::input)?;
            while !node.interrupted() && !pace.wait(message.log_time) {
                if node.parameters.generation() != generation {
                    generation = node.parameters.generation();
                    pace = Pace::new(config::rate(&node.parameters)?);
                }
            }
            if node.interrupted() {
                return Ok(Stopped::Interrupted);
            }
            if let Some(clock) = &mut self.clock {
                clock.tell(message.log_time)?;
            }
            last = message.log_time;
            self.channels.publish(message)?;
            self.played += 1;
            self.count.store(self.played, Ordering::Relaxed);
        }
        if let Some(clock) = &mut self.clock {
            clock.tell_last(last)?;
        }
        self.channels.settle();
        let messages = self.played;
        info!("played {messages} messages");
        node.report(&Event::Played { messages });
        Ok(Stopped::Done)
    }

    fn clean_up(self, _: &Node) -> Result<(), NodeError> {
        Ok(())
    }
}

/// When recorded messages are due.
struct Pace {
    rate: f64,
    /// When the first message came, and when it was logged (ns).
    first: Option<(Instant, u64)>,
}

impl Pace {
    fn new(rate: f64) -> Self {
        Self { rate, first: None }
    }

    /// Waits for the time of a message, for a while at most; whether it has come.
    fn wait(&mut self, log_time: u64) -> bool {
        if self.rate == 0.0 {
            return true;
        }
        let (start, first) = *self.first.get_or_insert_with(|| (Instant::now(), log_time));
        let recorded = Duration::from_nanos(log_time.saturating_sub(first));
        let due = Duration::try_from_secs_f64(recorded.as_secs_f64() / self.rate)
            .unwrap_or(Duration::MAX);
        let left = due.saturating_sub(start.elapsed());
        std::thread::sleep(left.min(SLICE));
        left <= SLICE
    }
}
