//! Makes a new bag of what is readable of a damaged one.

mod copy;
mod in_place;
mod new_bag;
mod report;
mod scan;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

pub use in_place::recover_in_place;
pub use report::{LeftOut, RecoveredFile, Recovery};

use crate::{
    BagError, NewDirectory, RecoverError, WriteError,
    metadata::Metadata,
    read::{Listing, Source, sort},
    times::sum,
};
use new_bag::NewBag;

/// Entry of the custom data of every recovered bag.
const RECOVERED: &str = "recovered";

/// Entry of the custom data with the number of missing messages, to which further recoveries add.
const MISSING: &str = "missing";

/// Makes a new bag in the directory `output`, which must not exist or be empty, of a bag's directory or MCAP file,
/// however damaged. The damaged bag is only read. The new one is made in `<output>.part` and renamed when it is complete.
///
/// All messages of chunks with a matching checksum are kept, and messages of files without chunks up to the first damaged
/// place. Everything else is left out, and the result says where it was. Files keep their names, and messages their order,
/// times and sequence numbers. The bag keeps its custom data, to which `recovered: "true"` is added. Attachments and
/// metadata of other recorders are not copied, and messages that rosbag2 has compressed by themselves are stored
/// decompressed.
///
/// Definitions of topics are taken from a file's summary, or from its chunks. Messages of a topic whose definition is lost
/// are left out.
///
/// Latched messages at the head of a further file take the place of those that were lost. The files of the new bag repeat
/// the others as those of any bag do.
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
    let damaged = Damaged::find(bag)?;
    let directory = NewDirectory::begin(output)?;
    let (mut recovery, _) = damaged.copy(bag, directory.path())?;
    directory.complete()?;
    recovery.bag = output.to_owned();
    Ok(recovery)
}

/// A damaged bag.
struct Damaged {
    directory: PathBuf,
    /// Its MCAP files in their order, relative to the directory.
    files: Vec<PathBuf>,
    /// `metadata.yaml`, or the reason why it cannot be used.
    metadata: Result<Metadata, String>,
}

impl Damaged {
    /// Finds the files of a bag's directory, or takes a single file. No file of it may be open in a writer of this crate.
    fn find(bag: &Path) -> Result<Self, RecoverError> {
        let listing = Listing::read(bag, false)?;
        let gaps = listing.gaps();
        let metadata = match listing.metadata {
            Some(Err(error @ (BagError::Storage { .. } | BagError::Compressed { .. }))) => {
                Err(error)?
            }
            Some(metadata) => metadata.map_err(|error| error.to_string()),
            None => Err("there was none".to_owned()),
        };
        let is_single = bag.is_file();
        let mut others = listing.others;
        others.retain(|file| is_single || file.extension().is_some_and(|it| it == "mcap"));
        if listing.files.is_empty() {
            others.extend(gaps);
            sort(&mut others);
        }
        // Files that `metadata.yaml` does not list were begun after it was written.
        let files = [listing.files, others].concat();
        let directory = listing.directory;
        // A bag that is being recorded is refused before anything is made.
        let mut paths: Vec<_> = files.iter().map(|file| directory.join(file)).collect();
        paths.retain(|path| path.exists());
        for path in &paths {
            open(path)?.refuse_other()?;
        }
        if paths.is_empty() {
            let reason = "no .mcap file, expected those of a bag";
            return Err(BagError::invalid(bag, reason).into());
        }
        Ok(Self {
            directory,
            files,
            metadata,
        })
    }

    /// Hash of each topic's type by name and type, if `metadata.yaml` tells it.
    fn type_hashes(&self) -> BTreeMap<(String, String), String> {
        let metadata = self.metadata.iter();
        let hashes = metadata.flat_map(Metadata::type_hashes);
        hashes
            .map(|((name, kind), hash)| ((name.to_owned(), kind.to_owned()), hash.to_owned()))
            .collect()
    }

    /// Makes a bag of it in the directory `output`; the files of that.
    fn copy(self, bag: &Path, output: &Path) -> Result<(Recovery, Vec<PathBuf>), RecoverError> {
        let mut new = NewBag {
            directory: output.to_owned(),
            hashes: self.type_hashes(),
            ..NewBag::default()
        };
        let metadata = self.metadata.as_ref().ok();
        let told = metadata.map(Metadata::file_counts).unwrap_or_default();
        let mut files = Vec::new();
        let mut is_counted = false;
        for name in &self.files {
            let path = self.directory.join(name);
            let mut file = if path.exists() {
                copy::copy(&open(&path)?, name, &mut new)?
            } else {
                RecoveredFile {
                    path,
                    ..RecoveredFile::default()
                }
            };
            let claimed = file.missing.max(told.get(name).copied());
            is_counted |= claimed.is_some();
            file.missing = claimed.map(|claimed| claimed.saturating_sub(file.messages));
            files.push(file);
        }
        let lost = sum(files.iter().filter_map(|file| file.missing));
        let found = sum(files.iter().map(|file| file.messages));
        let total = metadata.map(|metadata| metadata.message_count.saturating_sub(found));
        let missing = Some(lost).filter(|_| is_counted).max(total);
        let had_none = match missing {
            Some(missing) => missing == 0,
            None => files.iter().all(RecoveredFile::is_sound),
        };
        if found == 0 && !had_none {
            return Err(nothing(bag, &files, missing));
        }
        if found == 0
            && let Some(first) = self.files.first()
        {
            // A bag has at least one file.
            new.begin(first)?;
        }
        let Some(mut writer) = new.writer else {
            return Ok((Recovery::default(), Vec::new()));
        };
        for topic in &new.silent {
            match writer.add_topic(topic) {
                // The bag has it under another type.
                Ok(_) | Err(WriteError::Refused(_)) => {}
                Err(error) => return Err(error.into()),
            }
        }
        let metadata_rebuilt = self.metadata.as_ref().err().cloned();
        let mut custom = self.metadata.map_or(new.custom, Metadata::into_custom);
        custom.insert(RECOVERED.to_owned(), "true".to_owned());
        if let Some(missing @ 1..) = missing {
            let before = custom.get(MISSING).and_then(|count| count.parse().ok());
            let all = missing.saturating_add(before.unwrap_or(0));
            custom.insert(MISSING.to_owned(), all.to_string());
        }
        let summary = writer.finish(custom)?;
        let recovery = Recovery {
            bag: output.to_owned(),
            messages: summary.messages,
            repeated: summary.repeated,
            missing,
            times: summary.times,
            unverified: new.unverified,
            metadata_rebuilt,
            files,
        };
        Ok((recovery, summary.files))
    }
}

/// Opens a file that no writer of this crate has open.
fn open(path: &Path) -> Result<Source, RecoverError> {
    let source = Source::open_damaged(path)?;
    match source.is_being_written() {
        false => Ok(source),
        true => Err(RecoverError::BeingWritten(path.to_owned())),
    }
}

/// For a bag of which no messages are left, though it had some.
fn nothing(bag: &Path, files: &[RecoveredFile], missing: Option<u64>) -> RecoverError {
    let mut left_out = files.iter().flat_map(|file| &file.left_out);
    let reason = left_out.next().map(|place| format!(": {}", place.reason));
    let missing = missing.map(|missing| format!("; {missing} messages are missing"));
    RecoverError::Nothing {
        bag: bag.to_owned(),
        bytes: sum(files.iter().filter_map(|file| file.bytes)),
        what: reason.unwrap_or_default() + &missing.unwrap_or_default(),
    }
}
