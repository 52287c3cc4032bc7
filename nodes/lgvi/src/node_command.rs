//! A node that runs in this process, as a command of its own: what it reports is heard, and said as JSON where that is asked for.

use std::io::{self, BufReader, PipeWriter};
use std::process::ExitCode;
use std::thread;

use lgvi_common::Event;
use lgvi_middleware::node::complain;
use lgvi_middleware::report::read_reports;
use serde_json::{Value, json};

use crate::output;

/// What a node has come to.
pub(crate) trait Outcome: Send {
    /// Takes note of a report, and shows progress.
    fn hear(&mut self, event: Event);

    /// The result as JSON.
    fn json(&self) -> Value;
}

/// Runs `node`, whose reports go to the pipe that it is given; prints its result with `json`.
pub(crate) fn run(
    node: impl FnOnce(PipeWriter) -> ExitCode,
    outcome: &mut impl Outcome,
    json: bool,
) -> ExitCode {
    let (reader, writer) = match io::pipe() {
        Ok(pipe) => pipe,
        Err(error) => {
            complain(&format_args!("lgvi: {error}"));
            return ExitCode::FAILURE;
        }
    };
    let mut failure = None;
    let code = thread::scope(|scope| {
        scope.spawn(|| {
            for event in read_reports(BufReader::new(reader)).flatten() {
                match event {
                    Event::Failed { message } => failure = Some(message),
                    event => outcome.hear(event),
                }
            }
        });
        node(writer)
    });
    if !json {
        return code;
    }
    let said = match failure {
        None => outcome.json(),
        Some(message) => {
            let known = [1, 2]
                .into_iter()
                .find(|known| ExitCode::from(*known) == code);
            json!({"failure": {"message": message, "exit_code": known}})
        }
    };
    if let Err(error) = output::say(&said) {
        complain(&format_args!("lgvi: {error}"));
        return ExitCode::FAILURE;
    }
    code
}
