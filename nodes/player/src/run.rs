//! The node as a managed node.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use lgvi_bag::BagReader;
use lgvi_common::Event;
use lgvi_middleware::ParameterSpec;
use lgvi_middleware::node::{Managed, Node, NodeError, Stopped};
use lgvi_middleware::ros::{Diagnosed, Running, Status};
use tracing::info;

use crate::channels::Channels;
use crate::clock::{self, RecordedClock};
use crate::config::{self, Config};
use crate::latched::Latched;
use crate::range::Range;
use crate::reel::{Place, Reel};
use crate::remote::Remote;
use crate::replay::Replay;
use crate::services;

/// How often waiting looks whether it is over.
const WAIT: Duration = Duration::from_millis(1);

/// A replay, and all that it needs.
pub(crate) struct Player {
    _services: Running,
    _diagnosed: Diagnosed,
    bag: BagReader,
    range: Range,
    channels: Channels,
    wanted: Vec<bool>,
    clock: Option<RecordedClock>,
    latched: Latched,
    await_subscribers: usize,
    remote: Remote,
    /// Where it was interrupted, and at which recorded time (ns).
    interrupted: Option<(Place, u64)>,
    played: Arc<AtomicU64>,
}

impl Managed for Player {
    const NAME: &'static str = "lgvi_player";

    fn parameters() -> Vec<ParameterSpec> {
        config::specifications()
    }

    fn configure(node: &Node) -> Result<Self, NodeError> {
        let config = Config::read(&node.parameters)?;
        let rate = config::rate(&node.parameters)?;
        let bag = BagReader::open(&config.bag).map_err(NodeError::input)?;
        let range = Range::read(&node.parameters, &bag)?;
        let channels = Channels::open(&bag, node, &config, rate)?;
        let clock = config
            .clock
            .map(|frequency| RecordedClock::new(&node.ros, frequency))
            .transpose()?;
        let wanted = channels.opened();
        if clock.is_some() {
            clock::check(&bag, &wanted, range)?;
        }
        let remote = Remote::new(rate, config.start_paused);
        let played = Arc::<AtomicU64>::default();
        Ok(Self {
            _services: services::serve(node, &remote)?,
            _diagnosed: diagnose(node, &played, &remote, range),
            latched: Latched::new(&bag, &wanted, channels.depths()),
            bag,
            range,
            channels,
            wanted,
            clock,
            await_subscribers: config.await_subscribers,
            remote,
            interrupted: None,
            played,
        })
    }

    /// Goes on where it was interrupted.
    fn run(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        self.remote.wait();
        let stopped = match self.wait(node) {
            Ok(None) => self.play(node),
            Ok(Some(stopped)) => Ok(stopped),
            Err(error) => Err(error),
        };
        self.remote.end();
        if stopped? == Stopped::Interrupted {
            return Ok(Stopped::Interrupted);
        }
        self.channels.settle();
        let messages = self.played.load(Ordering::Relaxed);
        info!("played {messages} messages");
        node.report(Event::Played { messages });
        Ok(Stopped::Done)
    }
}

impl Player {
    /// Waits for the subscribers; why nothing is to be played then.
    fn wait(&mut self, node: &Node) -> Result<Option<Stopped>, NodeError> {
        while !self.channels.have_subscribers(self.await_subscribers)? {
            if node.interrupted() {
                return Ok(Some(Stopped::Interrupted));
            }
            if self.remote.is_stopped() {
                return Ok(Some(Stopped::Done));
            }
            std::thread::sleep(WAIT);
        }
        Ok(None)
    }

    fn play(&mut self, node: &Node) -> Result<Stopped, NodeError> {
        let begun = self.interrupted.is_some();
        let start = (Place::at(self.range.start), self.range.start);
        let (place, time) = self.interrupted.unwrap_or(start);
        self.remote.begin(time);
        let mut replay = Replay {
            node,
            bag: &self.bag,
            range: self.range,
            channels: &mut self.channels,
            clock: self.clock.as_mut(),
            latched: &mut self.latched,
            remote: &self.remote,
            reel: Reel::new(&self.bag, &self.wanted, self.range.end, place)?,
            wanted: &self.wanted,
            played: &self.played,
            told: Instant::now(),
        };
        let stopped = replay.play(!begun);
        self.interrupted = Some((replay.place(), self.remote.recorded()));
        stopped
    }
}

fn diagnose(node: &Node, played: &Arc<AtomicU64>, remote: &Remote, range: Range) -> Diagnosed {
    let (played, remote) = (Arc::clone(played), remote.clone());
    node.diagnostics.add("replay", move || {
        let said = if remote.is_paused() {
            "paused"
        } else {
            "playing"
        };
        let time = Duration::from_nanos(remote.recorded().saturating_sub(range.start));
        Status::ok(said)
            .value("messages", played.load(Ordering::Relaxed))
            .value("time (s)", time.as_secs_f64())
    })
}
