//! Nanoseconds since the UNIX epoch and `builtin_interfaces/Time`.

use thiserror::Error;

use crate::builtin_interfaces::Time;

const NANOSECONDS_PER_SECOND: i64 = 1_000_000_000;

/// A time that the other representation cannot hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum StampError {
    /// `builtin_interfaces/Time` counts seconds as an `int32`; lgvi uses none before 1970.
    #[error(
        "{nanoseconds} ns since the UNIX epoch is not within 0 s and {max} s",
        max = i32::MAX
    )]
    OutOfRange {
        /// The time that does not fit.
        nanoseconds: i64,
    },
    /// A message whose time is before 1970 or whose nanoseconds exceed one second.
    #[error("time {sec} s + {nanosec} ns: sec must not be negative, nanosec below 1000000000")]
    Invalid {
        /// The message's seconds.
        sec: i32,
        /// The message's nanoseconds.
        nanosec: u32,
    },
}

/// Converts nanoseconds since the UNIX epoch to a message.
///
/// # Errors
/// A time before 1970 or after 2038-01-19T03:14:07 (`sec` is an `int32`).
pub fn to_message(nanoseconds: i64) -> Result<Time, StampError> {
    let out_of_range = StampError::OutOfRange { nanoseconds };
    let sec =
        i32::try_from(nanoseconds.div_euclid(NANOSECONDS_PER_SECOND)).map_err(|_| out_of_range)?;
    let nanosec =
        u32::try_from(nanoseconds.rem_euclid(NANOSECONDS_PER_SECOND)).map_err(|_| out_of_range)?;
    if sec < 0 {
        Err(out_of_range)
    } else {
        Ok(Time { sec, nanosec })
    }
}

/// Converts a message to nanoseconds since the UNIX epoch.
///
/// # Errors
/// A time before 1970, or `nanosec` of one second or more.
pub fn from_message(time: &Time) -> Result<i64, StampError> {
    let Time { sec, nanosec } = *time;
    if sec < 0 || i64::from(nanosec) >= NANOSECONDS_PER_SECOND {
        return Err(StampError::Invalid { sec, nanosec });
    }
    Ok(i64::from(sec) * NANOSECONDS_PER_SECOND + i64::from(nanosec))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trips_at_the_ends_of_the_range() {
        let last = i64::from(i32::MAX) * NANOSECONDS_PER_SECOND + NANOSECONDS_PER_SECOND - 1;
        for nanoseconds in [
            0,
            1,
            999_999_999,
            1_000_000_000,
            1_700_000_000_123_456_789,
            last,
        ] {
            assert_eq!(
                from_message(&to_message(nanoseconds).unwrap()),
                Ok(nanoseconds)
            );
        }
        for nanoseconds in [-1, i64::MIN, last + 1, i64::MAX] {
            assert_eq!(
                to_message(nanoseconds),
                Err(StampError::OutOfRange { nanoseconds })
            );
        }
    }

    #[test]
    fn refuses_messages_out_of_range() {
        for (sec, nanosec) in [(-1, 0), (0, 1_000_000_000), (i32::MIN, u32::MAX)] {
            assert_eq!(
                from_message(&Time { sec, nanosec }),
                Err(StampError::Invalid { sec, nanosec })
            );
        }
    }
}
