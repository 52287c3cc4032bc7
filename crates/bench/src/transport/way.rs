//! The ways that samples take, behind one pair of ends.

use std::time::{Duration, Instant};

use clap::ValueEnum;
use lgvi_middleware::Environment;
use serde::Serialize;

use super::ros::{RosReceiver, RosSender};
use super::zenoh::{self, End, environment};
use super::{Look, Place, dds, events, shm};
use crate::error::BenchError;

/// The topic of all of them.
pub(super) const TOPIC: &str = "/lgvi_bench/state";

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub(super) enum Way {
    /// This project's shared memory.
    Shm,
    /// iceoryx2 alone.
    Iceoryx2,
    /// iceoryx2 alone, with an event for each sample.
    Iceoryx2Events,
    /// This project's ROS 2 topics.
    Dds,
    /// ros2-client alone.
    Ros2Client,
    /// This project's ROS 2 topics over Zenoh.
    LgviZenoh,
    /// zenoh alone.
    Zenoh,
}

/// Each way with how its receiver looks.
pub(super) const LOOKS: [(Way, Look); 9] = [
    (Way::Shm, Look::Spinning),
    (Way::Iceoryx2, Look::Spinning),
    (Way::Shm, Look::Polling),
    (Way::Iceoryx2, Look::Polling),
    (Way::Iceoryx2Events, Look::Woken),
    (Way::Dds, Look::Woken),
    (Way::Ros2Client, Look::Woken),
    (Way::LgviZenoh, Look::Woken),
    (Way::Zenoh, Look::Woken),
];

/// A sample's number and when it was sent, in nanoseconds of the monotonic clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stamp {
    pub sequence: u64,
    pub nanoseconds: u64,
}

/// Sends states.
pub(super) trait Sender {
    fn send(&mut self, stamp: Stamp) -> Result<(), BenchError>;
}

/// Receives states.
pub(super) trait Receiver {
    /// The next sample, up to `patience`.
    fn receive(&mut self, patience: Duration) -> Result<Option<Stamp>, BenchError>;
}

impl Way {
    pub(super) fn label(self) -> &'static str {
        match self {
            Self::Shm => "lgvi over iceoryx2",
            Self::Iceoryx2 => "iceoryx2",
            Self::Iceoryx2Events => "iceoryx2 with events",
            Self::Dds => "lgvi over DDS",
            Self::Ros2Client => "ros2-client",
            Self::LgviZenoh => "lgvi over Zenoh",
            Self::Zenoh => "zenoh",
        }
    }

    /// What is below it.
    pub(super) fn bare(self) -> Option<Self> {
        match self {
            Self::Shm => Some(Self::Iceoryx2),
            Self::Dds => Some(Self::Ros2Client),
            Self::LgviZenoh => Some(Self::Zenoh),
            Self::Iceoryx2 | Self::Iceoryx2Events | Self::Ros2Client | Self::Zenoh => None,
        }
    }

    pub(super) fn sender(
        self,
        place: &Place,
        bodies: usize,
    ) -> Result<Box<dyn Sender>, BenchError> {
        Ok(match self {
            Self::Shm => Box::new(shm::OwnSender::new(place, bodies)?),
            Self::Iceoryx2 => Box::new(shm::BareSender::new(place, bodies)?),
            Self::Iceoryx2Events => Box::new(events::EventSender::new(place, bodies)?),
            Self::Dds => Box::new(RosSender::new(
                &Environment::localhost(place.domain),
                bodies,
            )?),
            Self::Ros2Client => Box::new(dds::BareSender::new(place, bodies)?),
            Self::LgviZenoh => Box::new(RosSender::new(&environment(place, End::Near), bodies)?),
            Self::Zenoh => Box::new(zenoh::BareSender::new(place, bodies)?),
        })
    }

    pub(super) fn receiver(
        self,
        place: &Place,
        spin: bool,
    ) -> Result<Box<dyn Receiver>, BenchError> {
        Ok(match self {
            Self::Shm => Box::new(shm::OwnReceiver::new(place, spin)?),
            Self::Iceoryx2 => Box::new(shm::BareReceiver::new(place, spin)?),
            Self::Iceoryx2Events => Box::new(events::EventReceiver::new(place)?),
            Self::Dds => Box::new(RosReceiver::new(&Environment::localhost(place.domain))?),
            Self::Ros2Client => Box::new(dds::BareReceiver::new(place)?),
            Self::LgviZenoh => Box::new(RosReceiver::new(&environment(place, End::Far))?),
            Self::Zenoh => Box::new(zenoh::BareReceiver::new(place)?),
        })
    }
}

/// How often a polling receiver looks.
const POLL: Duration = Duration::from_millis(1);

/// Takes until there is something or `patience` is over.
pub(super) fn look(
    spin: bool,
    patience: Duration,
    mut take: impl FnMut() -> Result<Option<Stamp>, BenchError>,
) -> Result<Option<Stamp>, BenchError> {
    let begun = Instant::now();
    loop {
        match take()? {
            Some(stamp) => return Ok(Some(stamp)),
            None if begun.elapsed() > patience => return Ok(None),
            None if spin => std::hint::spin_loop(),
            None => std::thread::sleep(POLL),
        }
    }
}
