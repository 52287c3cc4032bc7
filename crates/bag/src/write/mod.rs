//! Writing: a bag's files one after the other, each of chunks and an end.

mod catalog;
mod chunk;
mod closing;
mod encode;
mod latched;
mod mcap_writer;
mod options;
mod splitting;
mod summary;
mod writer;

pub use options::{BagOptions, BagSummary, Compression};
pub use writer::{BagWriter, TopicId};
