use std::ffi::OsString;
use std::fmt::Display;
use std::io::Write;
use std::process::ExitCode;

use super::NodeError;

/// Runs `main` with the process's command line without the program's name; one that is no Unicode is refused.
pub fn with_arguments(main: impl FnOnce(Vec<String>) -> ExitCode) -> ExitCode {
    match unicode(std::env::args_os().skip(1)) {
        Ok(arguments) => main(arguments),
        Err(error) => {
            complain(&error);
            error.exit_code()
        }
    }
}

/// Writes a line on standard error. Where nobody can read it, nobody can be told.
pub fn complain(message: &dyn Display) {
    let _ = writeln!(std::io::stderr(), "{message}");
}

fn unicode(arguments: impl Iterator<Item = OsString>) -> Result<Vec<String>, NodeError> {
    arguments
        .map(|argument| {
            argument.into_string().map_err(|argument| {
                NodeError::Input(format!("argument {argument:?}, expected valid Unicode"))
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::os::unix::ffi::OsStringExt;

    use super::*;

    #[test]
    fn an_argument_that_is_no_unicode_is_named() {
        let arguments = [b"--ros-args".to_vec(), b"a\xffb".to_vec()];
        let error = unicode(arguments.into_iter().map(OsString::from_vec)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "argument \"a\\xFFb\", expected valid Unicode"
        );
    }
}
