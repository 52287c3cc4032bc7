use std::io;
use std::sync::Arc;

use signal_hook::consts::SIGXFSZ;
use signal_hook::flag;

/// Has a write beyond the limit on the size of files (`ulimit -f`) fail, as on a full disk: the signal that comes with it
/// does not end the process from here on, nor has it any other effect. Programs that are started are not concerned.
///
/// # Errors
/// The handler cannot be installed.
pub fn let_long_files_fail() -> io::Result<()> {
    flag::register(SIGXFSZ, Arc::default()).map(drop)
}
