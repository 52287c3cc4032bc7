//! Writing: a bag's files one after the other, each of chunks and an end.

mod closing;
mod latched;
mod mcap_writer;
mod options;
mod sink;
mod splitting;
mod writer;

pub use options::{BagOptions, BagSummary, Compression};
pub use writer::{BagWriter, TopicId};
