//! `lgvi record`: the recorder node with the command line of a tool.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use lgvi_common::Event;
use serde_json::{Value, json};

use crate::chosen::Chosen;
use crate::files::Files;
use crate::node_command::{self, Outcome};
use crate::parameters::{list, number, path, ros_arguments, text};
use crate::values;

/// The command line of `lgvi record`.
#[derive(Args)]
pub(crate) struct Options {
    /// Directory of the new bag (default: `flights/rosbag2_<time>`).
    #[arg(short, long, value_parser = values::path())]
    output: Option<PathBuf>,
    #[command(flatten)]
    chosen: Chosen,
    /// Also record hidden topics, which have a name part that begins with `_`.
    #[arg(long)]
    include_hidden_topics: bool,
    /// State topics to record from shared memory at full rate (default: `/lgvi_propagator/state`).
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    states: Vec<String>,
    /// Inertial frame of the states from shared memory, without prefix (default: inertial).
    #[arg(long)]
    frame: Option<String>,
    /// Prefix of that frame (default: the namespace of the topic's node and a slash, or nothing in the root namespace).
    #[arg(long, value_name = "PREFIX")]
    frame_prefix: Option<String>,
    #[command(flatten)]
    files: Files,
    /// Size of the write queue; when it is full, receiving waits (default: 67108864).
    #[arg(long, value_name = "BYTES", value_parser = values::bytes(1))]
    max_cache_size: Option<i64>,
    /// Log time of a message: when it was received, or its stamp (default: received).
    #[arg(long)]
    log_time: Option<LogTime>,
    /// Hold messages without a time until the first stamp or `/clock` message comes. A kill before that loses them.
    #[arg(long)]
    await_stamp: bool,
    /// Start paused; the service `~/resume` starts the recording.
    #[arg(long)]
    start_paused: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum LogTime {
    Received,
    Stamp,
}

/// Runs the recorder in this process.
pub(crate) fn record(options: &Options) -> ExitCode {
    let output = options.output.clone().unwrap_or_else(|| {
        let time = chrono::Local::now().format("%Y_%m_%d-%H_%M_%S");
        PathBuf::from(format!("flights/rosbag2_{time}"))
    });
    let arguments = options.ros_arguments(&output);
    let recorder = |reports| lgvi_recorder::main_reporting(arguments, reports);
    node_command::run(recorder, &mut Recording(Value::Null), options.json)
}

/// What was recorded; null before the bag is closed.
struct Recording(Value);

impl Outcome for Recording {
    fn hear(&mut self, event: Event) {
        if let Event::Recorded {
            bag,
            messages,
            lost,
            ..
        } = event
        {
            self.0 = json!({"bag": bag, "messages": messages, "lost": lost});
        }
    }

    fn json(&self) -> Value {
        self.0.clone()
    }
}

impl Options {
    /// The recorder's ROS 2 arguments.
    fn ros_arguments(&self, output: &Path) -> Vec<String> {
        let log_time = self.log_time.map(|time| match time {
            LogTime::Received => "received",
            LogTime::Stamp => "stamp",
        });
        let parameters = [
            Some(format!("output:={}", path(output))),
            list("states", &self.states),
            text("frame", self.frame.as_deref()),
            text("frame_prefix", self.frame_prefix.as_deref()),
            number("max_cache_size", self.max_cache_size),
            text("log_time", log_time),
        ];
        let flags = [
            ("include_hidden_topics", self.include_hidden_topics),
            ("await_stamp", self.await_stamp),
            ("start_paused", self.start_paused),
        ];
        let flags = flags.into_iter().filter(|(_, set)| *set);
        ros_arguments(
            parameters
                .into_iter()
                .flatten()
                .chain(self.chosen.parameters())
                .chain(self.files.parameters())
                .chain(flags.map(|(name, _)| format!("{name}:=true"))),
        )
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        options: Options,
    }

    fn parsed(line: &str) -> Result<Line, clap::Error> {
        Line::try_parse_from(std::iter::once("record").chain(line.split_whitespace()))
    }

    fn arguments(line: &str) -> String {
        let options = parsed(line).unwrap().options;
        let output = options.output.clone().unwrap_or("flights/new".into());
        options.ros_arguments(&output).join(" ")
    }

    #[test]
    fn options_are_the_nodes_parameters() {
        assert_eq!(
            arguments(
                "-o bags/a --topics /tf /a=b_msgs/msg/C --exclude-regex it's --states /s --frame icrf --frame-prefix a/ --log-time stamp \
                 --compression lz4 --max-bytes 1000 --max-duration 2 --max-cache-size 5000 --include-hidden-topics \
                 --await-stamp --start-paused"
            ),
            "--ros-args -p output:='bags/a' -p states:=['/s'] -p frame:='icrf' -p frame_prefix:='a/' -p max_cache_size:=5000 \
             -p log_time:='stamp' -p topics:=['/tf', '/a=b_msgs/msg/C'] -p exclude_regex:='it''s' \
             -p compression:='lz4' -p max_bytes:=1000 -p max_duration:=2.0 -p include_hidden_topics:=true \
             -p await_stamp:=true -p start_paused:=true"
        );
        assert_eq!(
            arguments("--max-bag-size 7 --max-bag-duration 1"),
            "--ros-args -p output:='flights/new' -p max_bytes:=7 -p max_duration:=1.0"
        );
        assert_eq!(arguments(""), "--ros-args -p output:='flights/new'");
    }

    #[test]
    fn what_no_recorder_takes_is_refused() {
        for bad in [
            "--max-bytes -1",
            "--max-duration nan",
            "--max-cache-size 0",
            "--compression gzip",
            "--log-time now",
            "a_topic_without_an_option",
        ] {
            assert!(parsed(bad).is_err(), "{bad:?}");
        }
    }
}
