//! The stamp of a message, read from its CDR without decoding the rest.

use lgvi_msgs::builtin_interfaces::Time;
use lgvi_msgs::diagnostic_msgs::DiagnosticArray;
use lgvi_msgs::{RosMessage, tf2_msgs, visualization_msgs};

use crate::definitions::Definition;

/// The encapsulation header that precedes the message.
const ENCAPSULATION: usize = 4;

/// Where a message type keeps its first stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stamped {
    /// In a header at the front.
    Header,
    /// In the header of its first transform or marker.
    FirstElement,
    /// Nowhere.
    No,
}

impl Stamped {
    pub(crate) fn of(definition: &Definition) -> Self {
        fn uncommented(line: &str) -> &str {
            line.split('#').next().unwrap_or_default().trim()
        }
        // Constants, which have a '=', are no fields.
        let first_field = definition
            .text
            .lines()
            .map(uncommented)
            .find(|line| !line.is_empty() && !line.contains('='));
        let lists = [
            tf2_msgs::TFMessage::TYPE_NAME,
            visualization_msgs::MarkerArray::TYPE_NAME,
        ];
        if lists.contains(&&*definition.type_name) {
            Self::FirstElement
        } else if definition.type_name == DiagnosticArray::TYPE_NAME {
            // That of the wall, as a rule, in a flight of another time.
            Self::No
        } else if first_field.is_some_and(|field| {
            field.starts_with("std_msgs/Header ") || field.starts_with("std_msgs/msg/Header ")
        }) {
            Self::Header
        } else {
            Self::No
        }
    }

    /// The stamp (ns since the UNIX epoch) of a message in little-endian CDR; `None` where there is none.
    pub(crate) fn read(self, cdr: &[u8]) -> Option<i64> {
        let word = |at: usize| -> Option<[u8; 4]> {
            cdr.get(ENCAPSULATION + at..ENCAPSULATION + at + 4)?
                .try_into()
                .ok()
        };
        let at = match self {
            Self::Header => 0,
            Self::FirstElement if u32::from_le_bytes(word(0)?) > 0 => 4,
            _ => return None,
        };
        let little_endian = cdr.get(1) == Some(&1);
        let sec = i32::from_le_bytes(word(at)?);
        let nanosec = u32::from_le_bytes(word(at + 4)?);
        if little_endian {
            lgvi_msgs::stamp::from_message(&Time { sec, nanosec }).ok()
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use lgvi_msgs::cdr::encode;
    use lgvi_msgs::geometry_msgs::TransformStamped;
    use lgvi_msgs::msg::PlanProgress;
    use lgvi_msgs::nav_msgs::Odometry;
    use lgvi_msgs::rosgraph_msgs::Clock;
    use lgvi_msgs::tf2_msgs::TFMessage;
    use lgvi_msgs::visualization_msgs::{Marker, MarkerArray};

    use super::*;
    use crate::definitions::Definitions;

    fn stamped<M: RosMessage>() -> Stamped {
        Stamped::of(&Definitions::installed().find(M::TYPE_NAME).unwrap())
    }

    #[test]
    fn stamps_are_found_in_headers_and_in_first_transforms_and_markers() {
        let stamp = Time {
            sec: 12,
            nanosec: 345,
        };
        let mut odometry = Odometry::default();
        odometry.header.stamp = stamp.clone();
        let found = stamped::<Odometry>();
        assert_eq!(
            found.read(&encode(&odometry).unwrap()),
            Some(12_000_000_345)
        );
        assert_eq!(found.read(&[0, 1, 0, 0, 1]), None);

        let mut transform = TransformStamped::default();
        transform.header.stamp = stamp.clone();
        let found = stamped::<TFMessage>();
        let tf = TFMessage {
            transforms: vec![transform],
        };
        assert_eq!(found.read(&encode(&tf).unwrap()), Some(12_000_000_345));
        assert_eq!(found.read(&encode(&TFMessage::default()).unwrap()), None);

        let mut marker = Marker::default();
        marker.header.stamp = stamp;
        let markers = MarkerArray {
            markers: vec![marker],
        };
        let found = stamped::<MarkerArray>();
        assert_eq!(found.read(&encode(&markers).unwrap()), Some(12_000_000_345));

        let after_constants = stamped::<PlanProgress>();
        assert_eq!(after_constants, Stamped::Header);
        assert_eq!(stamped::<Clock>(), Stamped::No);
        assert_eq!(stamped::<DiagnosticArray>(), Stamped::No);
    }
}
