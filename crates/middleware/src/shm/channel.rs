//! The kinds of channels: what they carry and how much of it.

use std::fmt::Debug;

use iceoryx2::prelude::{AllocationStrategy, ZeroCopySend};
use lgvi_msgs::shm::{BodySample, ControlHeader, StateHeader};

/// A kind of channel. All ports of a service must agree on it.
pub trait Channel: Debug + Send + Sync + 'static {
    /// What stands before the elements.
    type Header: Debug + Default + Copy + Send + ZeroCopySend + 'static;
    /// What a sample is a list of.
    type Element: Debug + Copy + Send + ZeroCopySend + 'static;
    /// The most publishers at a time.
    const PUBLISHERS: usize;
    /// The most subscribers at a time.
    const SUBSCRIBERS: usize = 8;
    /// The most samples that wait for one subscriber.
    const BUFFER: usize;
    /// The fewest samples that a publisher has memory for, however large they are.
    const FEWEST: usize;
    /// How many samples a subscriber gets that comes later.
    const HISTORY: usize = 1;
    /// The most elements of a sample.
    const MAX_ELEMENTS: usize;
    /// Whether a publisher's memory grows with its samples.
    const GROWTH: AllocationStrategy;

    /// The number of a sample in its run, by which gaps are found.
    fn sequence(header: &Self::Header) -> Option<u64>;
}

/// States of all bodies, of one publisher. It is made for a number of bodies and does not allocate later.
#[derive(Debug)]
pub enum State {}

/// Control sequences, of up to eight publishers: the CDR of their messages, up to 100 MB.
#[derive(Debug)]
pub enum Control {}

impl Channel for State {
    type Header = StateHeader;
    type Element = BodySample;
    const PUBLISHERS: usize = 1;
    const BUFFER: usize = 8192;
    const FEWEST: usize = 2048;
    const MAX_ELEMENTS: usize = 4096;
    const GROWTH: AllocationStrategy = AllocationStrategy::Static;

    fn sequence(header: &StateHeader) -> Option<u64> {
        Some(header.sequence)
    }
}

impl Channel for Control {
    type Header = ControlHeader;
    type Element = u8;
    const PUBLISHERS: usize = 8;
    const BUFFER: usize = 4;
    const FEWEST: usize = 8;
    const MAX_ELEMENTS: usize = 100_000_000;
    const GROWTH: AllocationStrategy = AllocationStrategy::BestFit;

    fn sequence(_: &ControlHeader) -> Option<u64> {
        None
    }
}
