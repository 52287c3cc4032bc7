//! Which topics are played or recorded.

use clap::Args;

use crate::parameters::{list, text};

/// Selection of topics, by the rules of `ros2 bag`.
#[derive(Args)]
pub(crate) struct Chosen {
    /// Take only these topics.
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    topics: Vec<String>,
    /// Take topics whose names match this regular expression, in addition to `--topics`.
    #[arg(long)]
    regex: Option<String>,
    /// Leave out these topics.
    #[arg(long, value_name = "TOPIC", num_args = 1..)]
    exclude_topics: Vec<String>,
    /// Leave out topics whose names match this regular expression.
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
