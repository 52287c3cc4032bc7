//! The clock on the wall.

use std::time::{SystemTime, UNIX_EPOCH};

/// Nanoseconds since the UNIX epoch; 0 where the clock says something else.
pub(crate) fn now() -> i64 {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .ok()
        .and_then(|elapsed| elapsed.as_nanos().try_into().ok())
        .unwrap_or_default()
}
