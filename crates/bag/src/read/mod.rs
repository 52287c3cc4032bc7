//! Reading: the messages of a bag's files in one order.

mod file;
mod listing;
mod messages;
mod reader;

pub use file::Chunks;
pub use messages::{Message, Messages};
pub use reader::{BagFile, BagReader};

pub(crate) use {
    file::{
        Contents, MAX_CHUNK_LENGTH, MAX_RECORD_LENGTH, Source, footer, schema, told, topic, unpack,
        unpacked,
    },
    listing::{Listing, sort},
};
