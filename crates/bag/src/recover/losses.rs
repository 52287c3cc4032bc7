//! What is left out of a file.

use super::{
    RecoverError,
    report::{LeftOut, RecoveredFile},
    scan::Place,
    source::Source,
};

/// Length of a message's entry in the index of a chunk.
const ENTRY: u64 = 16;

pub(super) struct Losses {
    pub file: RecoveredFile,
    /// What was left out last, of which the records that follow may tell more.
    last: Option<LeftOut>,
    /// First and last log time of the chunk that was read last, whose indexes may follow.
    read: Option<(u64, u64)>,
}

impl Losses {
    pub fn new(source: &Source) -> Self {
        Self {
            file: RecoveredFile {
                path: source.path.clone(),
                bytes: Some(source.size),
                ..RecoveredFile::default()
            },
            last: None,
            read: None,
        }
    }

    /// Leaves out a place. One of the same kind that follows at once is taken together with it.
    pub fn leave_out(&mut self, place: Place, reason: String) {
        if let Some(last) = &mut self.last
            && last.reason == reason
            && last.offset == place.offset
        {
            last.bytes += place.length;
            return;
        }
        self.settle();
        self.last = Some(LeftOut {
            offset: place.offset,
            bytes: place.length,
            reason,
            messages: None,
            times: None,
        });
    }

    /// A chunk of these log times was read: the indexes that follow are its own.
    pub fn read(&mut self, times: (u64, u64)) {
        self.read = Some(times);
    }

    /// What was left out last is a chunk of these log times, if they can be.
    pub fn of_chunk(&mut self, times: (u64, u64)) {
        self.read = None;
        if let Some(last) = &mut self.last {
            last.times = Some(times).filter(|(first, end)| first <= end);
        }
    }

    /// The index of a chunk's messages tells how many were in the chunk before it, if that was left out.
    pub fn count(&mut self, source: &Source, index: Place) -> Result<(), RecoverError> {
        let Some(last) = &mut self.last else {
            return Ok(());
        };
        // A channel, the list's length, and the first entry's log time.
        let ([_, _, _, _, _, _, time @ ..], known) = source.peek::<{ 6 + 8 }>(index.offset)?;
        let time = u64::from_le_bytes(time);
        let is_read = |(first, last)| (first..=last).contains(&time);
        if known == 6 + 8 && !self.read.is_some_and(is_read) {
            *last.messages.get_or_insert(0) += index.length / ENTRY;
        }
        Ok(())
    }

    /// One message is part of what was left out last.
    pub fn add_message(&mut self, log_time: u64) {
        if let Some(last) = &mut self.last {
            *last.messages.get_or_insert(0) += 1;
            let (first, end) = last.times.unwrap_or((log_time, log_time));
            last.times = Some((first.min(log_time), end.max(log_time)));
        }
    }

    /// No record tells more of what was left out last.
    pub fn settle(&mut self) {
        if let Some(place) = self.last.take() {
            self.file.leave_out(place);
        }
    }
}
