//! Reading: the messages of a bag's files in one order.

mod check;
mod counts;
mod file;
mod listing;
mod messages;
mod reader;
mod siblings;

pub use file::Chunks;
pub use messages::{Message, Messages};
pub use reader::{BagFile, BagReader};

pub(crate) use {
    file::{MAX_CHUNK_LENGTH, MAX_RECORD_LENGTH, OTHER_STORAGES},
    listing::{mcap_files, natural},
    messages::unpacked,
    siblings::{numbered, siblings},
};
