use std::{collections::BTreeMap, path::PathBuf};

use serde::Serialize;

/// Places that are described one by one; further ones are counted only.
const DESCRIBED: usize = 100;

/// What a recovered bag holds, and what was left out of it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Recovery {
    /// The recovered bag.
    pub bag: PathBuf,
    /// Number of messages of each topic, without those repeated at the head of a file.
    pub messages: BTreeMap<String, u64>,
    /// Messages repeated at the heads of files.
    pub repeated: u64,
    /// Messages that the bag had and that were not recovered, each counted once, if anything says how many it had.
    pub missing: Option<u64>,
    /// First and last log time (ns); none in a bag without messages.
    pub times: Option<(u64, u64)>,
    /// Messages that no checksum covers: they are as they were found.
    pub unverified: u64,
    /// Why `metadata.yaml` was made anew; none if what the damaged bag's says was kept.
    pub metadata_rebuilt: Option<String>,
    /// The files of the damaged bag.
    pub files: Vec<RecoveredFile>,
}

/// What became of a file of a damaged bag.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RecoveredFile {
    /// The damaged file.
    pub path: PathBuf,
    /// Its size; none if it is missing.
    pub bytes: Option<u64>,
    /// Messages recovered from it, repeated ones included.
    pub messages: u64,
    /// How many fewer these are than it had, if its own statistics or `metadata.yaml` say how many it had.
    pub missing: Option<u64>,
    /// Whether it had its end; without one the recorder was killed, or the file cut off.
    pub complete: bool,
    /// Whether the recovered bag has this file. One in which there was nothing to recover is dropped.
    pub kept: bool,
    /// Places that were left out, the first of them.
    pub left_out: Vec<LeftOut>,
    /// Number of all places that were left out.
    pub left_out_places: u64,
    /// Bytes of all places that were left out.
    pub left_out_bytes: u64,
}

/// A place of a file that was left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Where it starts.
    pub offset: u64,
    /// Its length.
    pub bytes: u64,
    /// What is wrong with it.
    pub reason: String,
    /// First and last log time (ns) of its messages, if that is known.
    pub times: Option<(u64, u64)>,
}

impl Recovery {
    /// Whether nothing was left out, and nothing is missing: neither messages that the bag is known to have had, nor the
    /// end of a file that others follow.
    pub fn is_whole(&self) -> bool {
        let last = self.files.iter().rposition(|file| file.messages > 0);
        self.missing.unwrap_or(0) == 0
            && self.files.iter().enumerate().all(|(index, file)| {
                let ended = file.complete || last.is_none_or(|last| index >= last);
                file.bytes.is_some() && file.left_out_places == 0 && ended
            })
    }
}

impl RecoveredFile {
    /// Whether it can be read as far as it goes, and that is beyond its magic.
    pub(super) fn is_sound(&self) -> bool {
        self.left_out_places == 0 && self.bytes > Some(mcap::MAGIC.len() as u64)
    }

    pub(super) fn leave_out(&mut self, place: LeftOut) {
        self.left_out_places += 1;
        self.left_out_bytes += place.bytes;
        if self.left_out.len() < DESCRIBED {
            self.left_out.push(place);
        }
    }
}
