use crate::Qos;

/// Types of which a message tells how things are at its time: earlier ones are of no use to whoever comes later.
const STREAMS: [&str; 8] = [
    "diagnostic_msgs/msg/DiagnosticArray",
    "lgvi_msgs/msg/Invariants",
    "lgvi_msgs/msg/SystemState",
    "lifecycle_msgs/msg/TransitionEvent",
    "nav_msgs/msg/Odometry",
    "rcl_interfaces/msg/Log",
    "rcl_interfaces/msg/ParameterEvent",
    "rosgraph_msgs/msg/Clock",
];

/// Type of transforms, which are a stream but on topics of this name.
const TRANSFORMS: (&str, &str) = ("tf2_msgs/msg/TFMessage", "tf_static");

/// A topic of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Fully qualified name, as `/lgvi_propagator/state`.
    pub name: String,
    /// Message type in the ROS 2 form, `pkg/msg/Type`.
    pub type_name: String,
    /// REP-2011 type hash, `RIHS01_…`; empty if the bag does not tell.
    pub type_hash: String,
    /// Text of the message's `.msg` file followed by those of all messages it needs, as `ros2msg` has it.
    pub definition: String,
    /// Encoding of the definition: [`ROS2MSG`](crate::ROS2MSG) as a rule; a definition in another one is opaque.
    pub definition_encoding: String,
    /// Quality of service that the publisher offered.
    pub qos: Qos,
}

impl Topic {
    /// Whether late joiners need its earlier messages: those of a publisher that keeps them, and whose type is no stream.
    /// Publishers keep streams too where that lets a lost sample be sent again, as those of lgvi do.
    pub fn is_latched(&self) -> bool {
        let (transforms, fixed) = TRANSFORMS;
        let is_stream = STREAMS.contains(&&*self.type_name)
            || (self.type_name == transforms && !self.name.ends_with(fixed));
        self.qos.durable && !is_stream
    }
}

/// A topic of a bag whose messages are not given out, nor counted.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LeftOutTopic {
    /// Its name.
    pub name: String,
    /// Message type as the file has it; empty if it does not tell.
    pub type_name: String,
    /// Why its messages are of no use.
    pub reason: String,
}
