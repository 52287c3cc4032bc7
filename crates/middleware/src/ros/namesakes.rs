//! Other nodes of the same name, and which of them has to go.

use std::{net::IpAddr, time::Duration};

/// How long a node has been there when nobody can make it go any more.
const ESTABLISHED: Duration = Duration::from_secs(10);

/// Another participant's node of the same name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Namesake {
    /// The identity of its participant.
    pub participant: String,
    /// Where it says that it is, if it has endpoints.
    pub addresses: Vec<IpAddr>,
    /// Whether the other one was there before, so that this node is the one to end.
    pub elder: bool,
}

/// When a node has announced itself (ns since the UNIX epoch, by its host's clock), and its identity: both sides know
/// these of both.
pub(super) type Birth = (i64, [u8; 16]);

/// Whether a node of the age `age` has to make room for `other`: the one that is older by the clocks stays.
///
/// One that is [`ESTABLISHED`] stays in any case. A newcomer that finds one which by the clocks is born long after itself
/// sees that the clocks disagree, and makes room: the other may have been there for long.
pub(super) fn is_elder(own: Birth, age: Duration, other: Birth) -> bool {
    let established = i64::try_from(ESTABLISHED.as_nanos()).unwrap_or(i64::MAX);
    age < ESTABLISHED && (other < own || other.0.saturating_sub(own.0) > established)
}

/// As others print it: 12 bytes of the participant's prefix.
pub(super) fn identity(participant: [u8; 16]) -> String {
    let bytes = participant[..12].iter().map(|byte| format!("{byte:02x}"));
    bytes.collect::<Vec<_>>().join(".")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;
    const YOUNG: Duration = Duration::from_secs(1);
    const OLD: Duration = Duration::from_secs(3600);

    #[test]
    fn of_two_newcomers_the_later_one_ends_and_of_twins_just_one() {
        let births = [(0, [1; 16]), (1, [0; 16]), (SECOND, [2; 16]), (0, [2; 16])];
        for first in births {
            for second in births.into_iter().filter(|second| *second != first) {
                let ends = [
                    is_elder(first, YOUNG, second),
                    is_elder(second, YOUNG, first),
                ];
                assert_eq!(ends, [second < first, first < second]);
            }
        }
    }

    #[test]
    fn one_that_is_established_stays_and_the_newcomer_ends_whatever_their_clocks_say() {
        for skew in [-1000 * SECOND, -3600 * SECOND, 0, 1000 * SECOND] {
            let (old, young) = ((skew, [1; 16]), (3600 * SECOND, [0; 16]));
            assert!(!is_elder(old, OLD, young));
            assert!(is_elder(young, YOUNG, old), "{skew}");
        }
        // The newcomer's clock is an hour and a half late.
        assert!(is_elder((-1800 * SECOND, [0; 16]), YOUNG, (0, [1; 16])));
    }
}
