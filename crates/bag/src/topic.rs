use crate::Qos;

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Fully qualified name, as `/lgvi_propagator/state`.
    pub name: String,
    /// Message type in the ROS 2 form, `pkg/msg/Type`.
    pub type_name: String,
    /// REP-2011 type hash, `RIHS01_…`; empty if the bag does not tell.
    pub type_hash: String,
    /// Text of the message's `.msg` file followed by those of all messages it needs.
    pub definition: String,
    /// Quality of service that the publisher offered.
    pub qos: Qos,
}
