//! `lgvi play`: the player node with the command line of a tool.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use indicatif::ProgressBar;
use lgvi_bag::BagReader;
use lgvi_common::Event;
use lgvi_middleware::node::NodeError;
use serde_json::{Value, json};

use crate::chosen::Chosen;
use crate::node_command::{self, Outcome};
use crate::parameters::{number, path, ros_arguments};
use crate::{bars, values};

/// The command line of `lgvi play`.
#[derive(Args)]
pub(crate) struct Options {
    /// Directory of the bag, or one MCAP file.
    #[arg(value_parser = values::path())]
    bag: PathBuf,
    /// Recorded seconds per second; 0 plays as fast as possible, without loss.
    #[arg(long, default_value_t = 1.0, value_parser = values::rate, allow_negative_numbers = true)]
    rate: f64,
    /// Repeat the bag until stopped.
    #[arg(long = "loop")]
    repeat: bool,
    /// Start this long after the bag's first message.
    #[arg(long, value_name = "SECONDS", value_parser = values::seconds, allow_negative_numbers = true)]
    start_offset: Option<f64>,
    /// Play this much recorded time.
    #[arg(long, value_name = "SECONDS", value_parser = values::seconds, allow_negative_numbers = true)]
    duration: Option<f64>,
    /// Stop this long after the bag's first message.
    #[arg(long, value_name = "SECONDS", value_parser = values::seconds, allow_negative_numbers = true)]
    until: Option<f64>,
    #[command(flatten)]
    chosen: Chosen,
    /// Publish a topic under another name; can be repeated.
    #[arg(long, value_name = "OLD:=NEW")]
    remap: Vec<String>,
    /// Start paused; the service `~/resume` starts the replay.
    #[arg(long)]
    start_paused: bool,
    /// Publish the recorded times on `/clock`.
    #[arg(long)]
    clock: bool,
    /// Highest rate of `/clock` in recorded time (default: 100).
    #[arg(long, value_name = "HZ", requires = "clock")]
    clock_frequency: Option<f64>,
    /// Wait until every topic has this many subscribers.
    #[arg(long, value_name = "COUNT")]
    await_subscribers: Option<u16>,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Runs the player in this process, unless it is no bag.
pub(crate) fn play(options: &Options) -> Result<ExitCode, NodeError> {
    BagReader::open(&options.bag).map_err(NodeError::input)?;
    let mut replay = Replay {
        bag: &options.bag,
        bar: bars::told("playing", 0),
        messages: 0,
        complete: false,
    };
    let player = |reports| lgvi_player::main_reporting(options.ros_arguments(), reports);
    Ok(node_command::run(player, &mut replay, options.json))
}

/// A replay under way.
struct Replay<'a> {
    bag: &'a Path,
    bar: ProgressBar,
    messages: u64,
    complete: bool,
}

impl Outcome for Replay<'_> {
    fn hear(&mut self, event: Event) {
        match event {
            Event::Playing {
                messages,
                time,
                duration,
            } => {
                self.messages = messages;
                self.bar.set_length((duration * 1e3) as u64);
                self.bar.set_position((time * 1e3) as u64);
                let message = format!("{time:.1} of {duration:.1} s, {messages} messages");
                self.bar.set_message(message);
            }
            Event::Played { messages } => {
                self.bar.finish_and_clear();
                self.messages = messages;
                self.complete = true;
            }
            _ => {}
        }
    }

    fn json(&self) -> Value {
        json!({
            "bag": self.bag.display().to_string(),
            "messages": self.messages,
            "complete": self.complete,
        })
    }
}

impl Options {
    /// The player's ROS 2 arguments.
    fn ros_arguments(&self) -> Vec<String> {
        let mut parameters = vec![
            format!("bag:={}", path(&self.bag)),
            format!("rate:={:?}", self.rate),
            format!("loop:={}", self.repeat),
            format!("start_paused:={}", self.start_paused),
            format!("clock:={}", self.clock),
        ];
        let numbers = [
            ("start_offset", self.start_offset),
            ("duration", self.duration),
            ("until", self.until),
            ("clock_frequency", self.clock_frequency),
        ];
        for (name, value) in numbers {
            parameters.extend(number(name, value));
        }
        parameters.extend(self.chosen.parameters());
        parameters.extend(number("await_subscribers", self.await_subscribers));
        let mut arguments = ros_arguments(parameters);
        for rule in &self.remap {
            arguments.extend(["-r".to_owned(), rule.clone()]);
        }
        arguments
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

    fn arguments(line: &[&str]) -> Vec<String> {
        let line = std::iter::once("play").chain(line.iter().copied());
        Line::try_parse_from(line).unwrap().options.ros_arguments()
    }

    #[test]
    fn options_are_the_nodes_parameters() {
        let line = [
            "a b/bag",
            "--rate",
            "0",
            "--loop",
            "--duration",
            "1.5",
            "--topics",
            "/tf",
            "/a",
            "--exclude-regex",
            "it's [0-9]",
            "--remap",
            "/tf:=/b",
            "--remap",
            "/a:=/c",
            "--clock",
            "--clock-frequency",
            "50",
        ];
        assert_eq!(
            arguments(&line).join(" "),
            "--ros-args -p bag:='a b/bag' -p rate:=0.0 -p loop:=true -p start_paused:=false -p clock:=true \
             -p duration:=1.5 -p clock_frequency:=50.0 -p topics:=['/tf', '/a'] -p exclude_regex:='it''s [0-9]' \
             -r /tf:=/b -r /a:=/c"
        );
        assert_eq!(
            arguments(&["bag"]).join(" "),
            "--ros-args -p bag:='bag' -p rate:=1.0 -p loop:=false -p start_paused:=false -p clock:=false"
        );
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for bad in [
            ["bag", "--start-offset", "-1"],
            ["bag", "--until", "nan"],
            ["bag", "--clock-frequency", "10"],
        ] {
            let line = std::iter::once("play").chain(bad);
            assert!(Line::try_parse_from(line).is_err(), "{bad:?}");
        }
    }
}
