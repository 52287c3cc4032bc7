//! Makes a new bag of what is readable of a damaged one.

mod copy;
mod error;
mod files;
mod head;
mod in_place;
mod new_bag;
mod report;
mod scan;

use std::path::Path;

pub use error::RecoverError;
pub use in_place::recover_in_place;
pub use report::{LeftOut, RecoveredFile, Recovery};

use crate::NewDirectory;

/// Makes a new bag in the directory `output`, which must not exist or be empty, of a bag's directory or MCAP file,
/// however damaged. The damaged bag is only read. The new one is made in `<output>.part` and renamed when it is complete.
///
/// All messages of chunks with a matching checksum are kept, and messages of files without chunks. Everything else is left
/// out, and the result says where it was. Files keep their names, and messages their order, times and sequence numbers. The
/// bag keeps its custom data, to which `recovered: "true"` is added. Attachments and metadata of other recorders are not
/// copied, and messages that rosbag2 has compressed by themselves are stored decompressed.
///
/// Definitions of topics are taken from a file's summary, or from its chunks. Messages of a topic whose definition is lost
/// are left out.
///
/// Latched messages that are repeated at the head of a further file are repeated there again if the new bag has them.
/// Otherwise they take the place of those that were lost.
///
/// [`Recovery::missing`] tells how many messages fewer there are than the bag's `metadata.yaml` or its files' statistics
/// say. The custom data of the new bag has this number under `missing`, if it is not 0.
///
/// # Errors
/// Returns an error if nothing of the bag is readable, if it is of another kind or is being written by this crate, or if
/// the new bag cannot be written. A bag without messages, or without any sign of messages,
/// becomes an empty bag.
///
/// # Assumptions and limitations
/// Memory is bounded by 256 MiB for a chunk as it is in the file, as much for its records, and what the summary needs.
/// Larger chunks are left out, and messages of more than 64 MiB, which the readers of this crate refuse. A chunk that the
/// end of the file cuts off is left out as a whole.
pub fn recover(bag: &Path, output: &Path) -> Result<Recovery, RecoverError> {
    let damaged = files::find(bag)?;
    let directory = NewDirectory::begin(output)?;
    let mut recovery = new_bag::make(bag, damaged, directory.path())?;
    directory.complete()?;
    recovery.bag = output.to_owned();
    Ok(recovery)
}
