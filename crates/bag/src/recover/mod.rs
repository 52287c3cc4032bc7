//! Makes a new bag of what is readable of a damaged one.

mod chunk;
mod contents;
mod copy;
mod counts;
mod definition_shape;
mod definition_text;
mod definitions;
mod description;
mod error;
mod files;
mod identities;
mod in_place;
mod losses;
mod new_bag;
mod original;
mod output;
mod plausibility;
mod repeated;
mod report;
mod scan;
mod shape;
mod source;
mod summary;
mod tally;
mod twins;

use std::path::Path;

pub use error::RecoverError;
pub use in_place::recover_in_place;
pub use report::{LeftOut, RecoveredFile, Recovery};

use files::Damaged;
use new_bag::NewBag;

use crate::{
    NewDirectory,
    read::{MAX_CHUNK_LENGTH, MAX_RECORD_LENGTH},
};

/// Longest record that is read.
const LIMIT: usize = MAX_RECORD_LENGTH;

/// Largest chunk that is read as it is in the file: what cannot be compressed grows by less than a part of 64.
const PACKED_LIMIT: usize = MAX_CHUNK_LENGTH / 64 * 65;

/// Makes of a bag's directory or MCAP file, however damaged, a new bag in the directory `output`, which must not exist or
/// be empty. The damaged bag is only read. The new one is made in `<output>.part` and has its name when it is complete.
///
/// Kept are all messages of chunks whose checksum is right, and complete messages outside of chunks; of the last chunk,
/// where the file ends within it, the complete messages that it begins with. Everything else is left out, and the result
/// says where that was. Files keep their names, and messages their order, times and sequence numbers; topics keep what
/// their publishers offered, and the bag the custom data of its `metadata.yaml`, to which `recovered: "true"` is added.
///
/// Definitions of topics that no checksum covers are compared with those of the bag's complete files and of the types that
/// `lgvi_msgs` knows, and taken from there where they are damaged or lost. Messages of a type whose definition is damaged and
/// known from nowhere else are kept without it. All of that is among what the result says was left out.
///
/// Latched messages at the head of a further file are marked as repeated if the new bag has them already. Those that are
/// lost where they stood first are found there as messages of the bag, behind the marked ones.
///
/// Where the bag's `metadata.yaml` or a file's statistics say how many messages there were, [`Recovery::missing`] is how
/// many are not there any more; the custom data has it under `missing`, if there are any.
///
/// # Errors
/// The bag cannot be read at all, is of another kind or is being written by this crate, nothing of it is readable, or the
/// new one cannot be written. A bag that had no messages, or of which no byte says that it had, becomes one without.
///
/// # Assumptions and limitations
/// Memory is bounded by 256 MiB for a chunk as it is in the file, as much for its records, and what the MCAP summary needs.
/// Larger chunks are left out, and messages of more than 64 MiB, which no reader of this crate takes. Bytes written before the place where a file was cut off are taken to be right.
pub fn recover(bag: &Path, output: &Path) -> Result<Recovery, RecoverError> {
    let damaged = files::find(bag)?;
    let directory = NewDirectory::begin(output)?;
    let mut recovery = copy(bag, damaged, directory.path())?;
    directory.complete()?;
    recovery.bag = output.to_owned();
    Ok(recovery)
}

fn copy(bag: &Path, damaged: Damaged, output: &Path) -> Result<Recovery, RecoverError> {
    let twins = twins::read(&damaged.directory, &damaged.files);
    let mut new = NewBag::new(output, damaged.original, damaged.told);
    for name in &damaged.files {
        let twins = twins::bag_of(name).and_then(|bag| twins.get(bag));
        let only = damaged.files.len() == 1;
        new.add(&damaged.directory, name, only, twins)?;
    }
    new.finish(bag)
}
