//! ROS 2 interfaces of lgvi and the standard ones it uses, generated from the `.msg`, `.srv` and `.action` files beside
//! this crate.
//!
//! - One module per ROS package ([`geometry_msgs`], [`nav_msgs`], …), services in a module `srv` of theirs; our own are
//!   in [`msg`] and [`action`].
//! - [`RosMessage`] and [`lookup`] give type names, hashes and definitions, as bags and peers need them.
//! - [`cdr`] encodes messages as they lie in bags and on the wire.
//! - [`shm`] holds the plain samples that cross shared memory and their conversion to messages.
//! - [`stamp`] converts times.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod cdr;
mod excerpt;
pub mod shm;
pub mod stamp;

use builtin_interfaces::Time;
pub use excerpt::excerpt;
use serde::{Serialize, de::DeserializeOwned};
use unique_identifier_msgs::UUID;

include!(concat!(env!("OUT_DIR"), "/messages.rs"));

/// A ROS 2 message type.
pub trait RosMessage: Serialize + DeserializeOwned {
    /// Name in the ROS 2 form, `pkg/msg/Type`; `srv` or `action` instead for the parts of a service or an action.
    const TYPE_NAME: &'static str;
    /// REP-2011 type hash, `RIHS01_…`.
    const TYPE_HASH: &'static str;
    /// Text of the `.msg` file followed by those of all messages it needs, as rosbag2 stores it.
    const DEFINITION: &'static str;
}

/// A ROS 2 service type.
pub trait Service: 'static {
    /// Name in the ROS 2 form, `pkg/srv/Type`.
    const TYPE_NAME: &'static str;
    /// REP-2011 type hash of the service, its event message included, `RIHS01_…`.
    const TYPE_HASH: &'static str;
    /// `pkg/srv/Type_Request`
    type Request: RosMessage;
    /// `pkg/srv/Type_Response`
    type Response: RosMessage;
}

/// A ROS 2 action type: what a client and a server say to each other, and the envelopes in which they do.
///
/// Source: <https://design.ros2.org/articles/actions.html>. Envelopes convert from and to the tuple of their fields.
pub trait Action: 'static {
    /// Name in the ROS 2 form, `pkg/action/Type`.
    const TYPE_NAME: &'static str;
    /// REP-2011 type hash of the action, its services included, `RIHS01_…`.
    const TYPE_HASH: &'static str;
    /// What is to be done.
    type Goal: RosMessage + Send;
    /// What has come of it.
    type Result: RosMessage + Default;
    /// How far it is.
    type Feedback: RosMessage;
    /// Identity and goal; whether it is accepted, and when.
    type SendGoal: Service<
            Request: From<(UUID, Self::Goal)> + Into<(UUID, Self::Goal)>,
            Response: From<(bool, Time)> + Into<(bool, Time)>,
        >;
    /// Identity; status (`action_msgs/msg/GoalStatus`) and result.
    type GetResult: Service<
            Request: From<UUID> + Into<UUID>,
            Response: From<(i8, Self::Result)> + Into<(i8, Self::Result)>,
        >;
    /// Identity and feedback.
    type FeedbackMessage: RosMessage + From<(UUID, Self::Feedback)> + Into<(UUID, Self::Feedback)>;
}

/// What is known of a message type at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageType {
    /// [`RosMessage::TYPE_NAME`]
    pub name: &'static str,
    /// [`RosMessage::TYPE_HASH`]
    pub hash: &'static str,
    /// [`RosMessage::DEFINITION`]
    pub definition: &'static str,
}

impl MessageType {
    /// Describes the message type `M`.
    pub const fn of<M: RosMessage>() -> Self {
        Self {
            name: M::TYPE_NAME,
            hash: M::TYPE_HASH,
            definition: M::DEFINITION,
        }
    }
}

/// All message types of this crate, ordered by name.
pub fn message_types() -> &'static [MessageType] {
    MESSAGE_TYPES
}

/// Names and hashes of all services and actions of this crate, those of an action's services included, ordered by name.
pub fn endpoint_types() -> &'static [(&'static str, &'static str)] {
    ENDPOINT_TYPES
}

/// Finds a message type by its name in the ROS 2 form, `pkg/msg/Type`.
pub fn lookup(type_name: &str) -> Option<MessageType> {
    MESSAGE_TYPES
        .binary_search_by_key(&type_name, |message_type| message_type.name)
        .ok()
        .map(|index| MESSAGE_TYPES[index])
}
