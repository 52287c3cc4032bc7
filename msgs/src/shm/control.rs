#[cfg(feature = "iceoryx2")]
use iceoryx2::prelude::ZeroCopySend;

/// Which sample over ROS 2 a control sequence in shared memory is; user header of a slice of bytes, the CDR of a
/// [`ControlSequence`](crate::msg::ControlSequence) behind its encapsulation header.
///
/// A sequence that is sent both ways counts once: publisher and number tell.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "iceoryx2", derive(ZeroCopySend))]
#[cfg_attr(feature = "iceoryx2", type_name("lgvi/ControlHeader"))]
pub struct ControlHeader {
    /// The publisher over ROS 2: its GUID over DDS, its gid over Zenoh.
    pub publisher: [u8; 16],
    /// Counts the publisher's samples from 1; 0 for a sequence that is sent over shared memory only.
    pub number: u64,
}
