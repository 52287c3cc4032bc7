//! One function for each kind of input.

mod arguments;
mod bags;
mod messages;
mod recovery;
mod scenes;
mod tables;

pub use arguments::{params_file, ros_args};
pub use bags::{bag_metadata, bag_reader, bag_records, file_of_records};
pub use messages::{cdr, key};
pub use recovery::bag_recover;
pub use scenes::scene;
pub use tables::tables;

/// Bytes that a bag may take at a time, of which 256 MiB are a chunk's: more is a finding.
pub const MOST_MEMORY: usize = 512 << 20;

/// Bytes that a text or a message may take at a time, which is at most 16 KiB long here: more is a finding.
pub const LITTLE_MEMORY: usize = 32 << 20;

/// A directory for what an input comes as, made anew for each.
fn scratch() -> tempfile::TempDir {
    match tempfile::tempdir() {
        Ok(directory) => directory,
        Err(error) => panic!("no temporary directory: {error}"),
    }
}
