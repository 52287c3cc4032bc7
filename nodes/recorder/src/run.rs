use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use lgvi_node::{Event, Node, NodeError};
use tracing::info;

use crate::config::Config;
use crate::log_time::StateTime;
use crate::sink::{self, Sink};
use crate::states::States;
use crate::topics::Topics;

/// The node's work, from parameters to the closed bag.
pub(crate) fn run(node: &mut Node) -> Result<(), NodeError> {
    let config = Config::take(std::mem::take(&mut node.parameters))?;
    let writer = sink::create(&config).map_err(NodeError::input)?;
    let resolve = |topic: &str| node.args.resolve(topic).map_err(NodeError::input);
    let elsewhere = config
        .states
        .iter()
        .map(|topic| resolve(topic))
        .collect::<Result<_, _>>()?;
    let shm = node.shm()?;
    let time = Arc::<StateTime>::default();
    let states = States::open(&config, &shm, Arc::clone(&time), resolve)?;
    let (ros, _rosout) = node.ros()?;
    let topics = Topics::open(&config, ros, elsewhere, time)?;

    let lost = [(); 2].map(|()| Arc::new(AtomicU64::new(0)));
    let missing = {
        let lost = lost.clone();
        move || {
            lost.iter()
                .map(|lost| lost.load(Ordering::Relaxed))
                .sum::<u64>()
        }
    };
    let events = Arc::clone(&node.events);
    let tell = {
        let missing = missing.clone();
        move |counts: &sink::Counts| {
            let _ = events.report(&Event::Recording {
                messages: counts.clone(),
                lost: missing(),
            });
        }
    };
    let sink = Sink::start(writer, tell).map_err(NodeError::runtime)?;
    node.report(&Event::Ready);

    let [states_lost, topics_lost] = &lost;
    let shutdown = &node.shutdown;
    let received = std::thread::scope(|scope| {
        let queue = sink.queue.clone();
        let from_dds = scope.spawn(move || topics.run(&queue, topics_lost, shutdown));
        let queue = sink.queue.clone();
        let from_shm = scope.spawn(move || states.run(&queue, states_lost, shutdown));
        while !shutdown.wait_timeout(std::time::Duration::from_millis(50)) {
            if sink.failed() || from_dds.is_finished() || from_shm.is_finished() {
                shutdown.request();
            }
        }
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
        lost: missing(),
    });
    received
}
