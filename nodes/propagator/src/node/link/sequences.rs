//! The control sequences that come in over shared memory and over ROS 2, each once.

use std::collections::VecDeque;
use std::pin::pin;
use std::task::{Context, Poll};

use lgvi_middleware::node::NodeError;
use lgvi_middleware::ros::{Qos, RosNode, Sample, Subscription};
use lgvi_middleware::shm::{ControlSubscriber, ShmNode};
use lgvi_msgs::cdr;
use lgvi_msgs::msg::ControlSequence;
use lgvi_msgs::shm::ControlHeader;
use tracing::warn;

use super::SEQUENCES;
use crate::ControlError;

/// Sequences whose copy by the other way may still come: more than can be under way from all publishers.
const UNPAIRED: usize = 64;

/// By which way a sequence comes. Each brings a sequence once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    SharedMemory,
    Ros,
}

/// Which sequence it is, and by which way it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Arrival {
    way: Way,
    sequence: ControlHeader,
}

/// Receives the sequences of one topic.
pub(super) struct Sequences {
    shm: ControlSubscriber,
    ros: Subscription<ControlSequence>,
    unpaired: Unpaired,
}

/// What has come by one way only.
#[derive(Default)]
struct Unpaired(VecDeque<Arrival>);

impl Sequences {
    pub(super) fn new(ros: &RosNode, shm: &ShmNode, topic: &str) -> Result<Self, NodeError> {
        let topic = ros.resolve(topic)?;
        Ok(Self {
            ros: ros.subscription(&topic, &Qos::reliable(SEQUENCES))?,
            shm: shm.control_subscriber(&topic)?,
            unpaired: Unpaired::default(),
        })
    }

    /// Publishers in shared memory.
    pub(super) fn publishers(&self) -> usize {
        self.shm.publishers()
    }

    /// The next sequence of each way, if one has come; has the thread woken for those over ROS 2.
    pub(super) fn receive(
        &mut self,
        context: &mut Context<'_>,
    ) -> impl Iterator<Item = Result<(Arrival, ControlSequence), ControlError>> + use<> {
        let shm = match self.shm.receive() {
            Ok(sample) => sample.map(|sample| {
                let arrival = Way::SharedMemory.brings(*sample.header());
                let message = cdr::decode(sample.elements()).map_err(undecodable)?;
                Ok((arrival, message))
            }),
            Err(error) => {
                warn!("{error}");
                None
            }
        };
        let ros = match pin!(self.ros.recv()).poll(context) {
            Poll::Ready(received) => {
                let received = received.map(|Sample { message, info }| {
                    let sequence = ControlHeader {
                        publisher: info.writer.0,
                        number: info.sequence,
                    };
                    (Way::Ros.brings(sequence), message)
                });
                Some(received.map_err(undecodable))
            }
            Poll::Pending => None,
        };
        [shm, ros].into_iter().flatten()
    }

    /// Whether a sequence has come by the other way before.
    pub(super) fn is_copy(&mut self, arrival: Arrival) -> bool {
        self.unpaired.pair(arrival)
    }

    /// Expects the copy of a sequence by the other way.
    pub(super) fn expect_copy(&mut self, arrival: Arrival) {
        self.unpaired.add(arrival);
    }
}

fn undecodable(error: impl ToString) -> ControlError {
    ControlError::Undecodable(error.to_string())
}

impl Way {
    fn brings(self, sequence: ControlHeader) -> Arrival {
        Arrival {
            way: self,
            sequence,
        }
    }
}

impl Unpaired {
    fn pair(&mut self, arrival: Arrival) -> bool {
        let before = self.0.len();
        self.0
            .retain(|other| other.way == arrival.way || other.sequence != arrival.sequence);
        self.0.len() < before
    }

    fn add(&mut self, arrival: Arrival) {
        if arrival.sequence.number == 0 {
            return;
        }
        if self.0.len() == UNPAIRED {
            self.0.pop_front();
        }
        self.0.push_back(arrival);
    }
}

#[cfg(test)]
mod tests {
    use super::Way::{Ros, SharedMemory};
    use super::*;

    fn sequence(publisher: u8, number: u64) -> ControlHeader {
        ControlHeader {
            publisher: [publisher; 16],
            number,
        }
    }

    /// How many count, of sequences that come in this order.
    fn counted(arrivals: &[(Way, u8, u64)]) -> usize {
        let mut unpaired = Unpaired::default();
        let counts = |&(way, publisher, number): &(Way, u8, u64)| {
            let arrival = way.brings(sequence(publisher, number));
            let copy = unpaired.pair(arrival);
            if !copy {
                unpaired.add(arrival);
            }
            usize::from(!copy)
        };
        arrivals.iter().map(counts).sum()
    }

    #[test]
    fn a_sequence_that_comes_both_ways_counts_once() {
        let first = [(SharedMemory, 1, 1), (Ros, 1, 1)];
        assert_eq!(counted(&first), 1);
        let late = [(Ros, 1, 1), (Ros, 1, 2), (SharedMemory, 1, 1), (Ros, 2, 1)];
        assert_eq!(counted(&late), 3);
    }

    #[test]
    fn the_same_number_of_another_publisher_or_by_one_way_is_another_sequence() {
        assert_eq!(counted(&[(SharedMemory, 1, 1), (Ros, 2, 1)]), 2);
        // What is not sent over ROS 2 has no number there: the next has it.
        let unsent = [(SharedMemory, 1, 3), (SharedMemory, 1, 3), (Ros, 1, 3)];
        assert_eq!(counted(&unsent), 2);
        assert_eq!(counted(&[(SharedMemory, 0, 0), (SharedMemory, 0, 0)]), 2);
    }

    #[test]
    fn what_never_pairs_takes_no_more_than_so_much_memory() {
        let mut unpaired = Unpaired::default();
        for number in 1..=1000 {
            unpaired.add(Ros.brings(sequence(1, number)));
        }
        assert_eq!(unpaired.0.len(), UNPAIRED);
        assert!(unpaired.pair(SharedMemory.brings(sequence(1, 1000))));
        assert!(!unpaired.pair(SharedMemory.brings(sequence(1, 1))));
    }
}
