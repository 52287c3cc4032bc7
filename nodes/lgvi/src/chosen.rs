//! Which topics are played or recorded.

use clap::Args;

use crate::parameters::{list, text};

/// What chooses among topics, by the rules of `ros2 bag`.
#[derive(Args)]
pub(crate) struct Chosen {
    /// Only these topics.
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    topics: Vec<String>,
    /// The topics only, or too where --topics has some, whose names contain this regular expression.
    #[arg(long)]
    regex: Option<String>,
    /// Leave these topics out.
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    exclude_topics: Vec<String>,
    /// Leave the topics out whose names contain this regular expression.
    #[arg(long, value_name = "REGEX")]
    exclude_regex: Option<String>,
}

impl Chosen {
    /// The parameters of player and recorder.
    pub(crate) fn parameters(&self) -> impl Iterator<Item = String> {
        [
            list("topics", &self.topics),
            list("exclude_topics", &self.exclude_topics),
            text("regex", self.regex.as_deref()),
            text("exclude_regex", self.exclude_regex.as_deref()),
        ]
        .into_iter()
        .flatten()
    }
}
