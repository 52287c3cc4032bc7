//! Reading: the messages of a bag's files in one order.

mod check;
mod file;
mod listing;
mod messages;
mod reader;

pub use file::Chunks;
pub use messages::{Message, Messages};
pub use reader::{BagFile, BagReader};
