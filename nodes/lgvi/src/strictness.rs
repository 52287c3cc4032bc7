//! What warnings do to the exit code.

use std::process::ExitCode;

use clap::Args;
use lgvi_common::Warning;

/// The exit code if there are only warnings, and `--strict` was given.
const WARNED: u8 = 3;

/// Whether warnings count.
#[derive(Args)]
pub(crate) struct Strictness {
    /// Exit with code 3 if there are warnings.
    #[arg(long)]
    strict: bool,
}

impl Strictness {
    /// The exit code of a success with these warnings.
    pub(crate) fn exit_code(&self, warnings: &[Warning]) -> ExitCode {
        if self.strict && !warnings.is_empty() {
            ExitCode::from(WARNED)
        } else {
            ExitCode::SUCCESS
        }
    }
}

#[cfg(test)]
mod tests {
    use lgvi_common::WarningCode;

    use super::*;

    #[test]
    fn warnings_count_where_that_is_asked_for() {
        let warnings = [Warning::new(WarningCode::LongTurn, "a body turns")];
        for (strict, warnings, code) in [
            (false, &warnings[..], 0),
            (true, &warnings[..], WARNED),
            (true, &[], 0),
        ] {
            assert_eq!(
                Strictness { strict }.exit_code(warnings),
                ExitCode::from(code)
            );
        }
    }
}
