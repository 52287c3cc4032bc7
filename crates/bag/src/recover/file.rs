//! Copies what is readable of a damaged file into a file of the recovered bag.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use mcap::records::{Metadata, Record, op};
use serde::Deserialize;

use super::{
    LIMIT, LeftOut, RecoverError, RecoveredFile,
    definitions::Definitions,
    latched::Latched,
    output::Output,
    scan::{Piece, Scanner},
    source::Source,
};
use crate::{
    CUSTOM_DATA, REPEATED,
    metadata::RECORD,
    read::{McapFile, schema, unpacked},
    record::{self, Records, parse},
    times::sum,
    yaml,
};

/// What became of a file.
pub(super) struct Copied {
    pub file: RecoveredFile,
    /// Number of messages that no checksum covers.
    pub unverified: u64,
    /// The last custom data of the bag that the file holds.
    pub custom: Option<BTreeMap<String, String>>,
    /// True if the file has anything of MCAP.
    pub is_mcap: bool,
}

/// The part of rosbag2's description in a file that is of use.
#[derive(Deserialize)]
struct Described {
    #[serde(default)]
    custom_data: Option<BTreeMap<String, String>>,
}

struct Copy<'a> {
    copied: Copied,
    definitions: Definitions,
    output: Output<'a>,
    /// The chunk left out last, of which the next indexes tell the number of messages.
    last: Option<LeftOut>,
}

/// Copies `path` to `new`. `latched` are the latched messages of the files before it.
pub(super) fn copy(
    path: &Path,
    new: PathBuf,
    latched: &mut Latched,
) -> Result<Copied, RecoverError> {
    let source = Source::open(path)?;
    let has_magic = source.has_magic()?;
    // A summary has all definitions, and says how many messages there were.
    let whole = McapFile::open(path).ok();
    let contents = whole.as_ref().map(|file| &file.contents);
    let claimed = contents.and_then(|contents| contents.counts.as_ref());
    let mut copy = Copy {
        copied: Copied {
            file: RecoveredFile {
                path: path.to_owned(),
                bytes: Some(source.size),
                complete: has_magic && source.has_end()?,
                missing: claimed.map(|counts| sum(counts.values().copied())),
                ..RecoveredFile::default()
            },
            unverified: 0,
            custom: None,
            is_mcap: has_magic,
        },
        definitions: contents.map(Definitions::of_summary).unwrap_or_default(),
        output: Output::new(new, latched),
        last: None,
    };
    drop(whole);
    if !has_magic && source.size > 0 {
        let bytes = source.size.min(mcap::MAGIC.len() as u64);
        copy.leave_out(0, bytes, "the MCAP magic is damaged".to_owned());
    }
    let mut scanner = Scanner::new();
    while let Some(piece) = scanner.next(&source)? {
        copy.copied.is_mcap |= !matches!(piece, Piece::Damage { .. });
        copy.piece(piece)?;
    }
    copy.finish()
}

impl Copy<'_> {
    fn piece(&mut self, piece: Piece) -> Result<(), RecoverError> {
        if let Piece::Index { messages } = piece {
            if let Some(last) = &mut self.last {
                *last.messages.get_or_insert(0) += messages;
            }
            return Ok(());
        }
        self.settle();
        match piece {
            Piece::Chunk {
                offset,
                compression,
                records,
                checked,
            } => {
                self.output.compress(compression);
                self.chunk(&records, offset, checked)
            }
            Piece::Record {
                opcode: op::MESSAGE,
                offset,
                body,
            } => {
                let kept = self.message(&body, offset)?;
                self.copied.unverified += u64::from(kept);
                Ok(())
            }
            Piece::Record {
                opcode,
                offset,
                body,
            } => self.record(opcode, &body, offset, false),
            Piece::Damage {
                offset,
                bytes,
                reason,
                times: None,
            } => {
                self.leave_out(offset, bytes, reason);
                Ok(())
            }
            Piece::Damage {
                offset,
                bytes,
                reason,
                times,
            } => {
                self.last = Some(LeftOut {
                    offset,
                    bytes,
                    reason,
                    messages: None,
                    times,
                });
                Ok(())
            }
            Piece::Index { .. } => Ok(()),
        }
    }

    /// Copies the records of a chunk.
    fn chunk(&mut self, records: &[u8], chunk: u64, checked: bool) -> Result<(), RecoverError> {
        for record in Records::new(records) {
            let Ok((opcode, place)) = record else {
                let reason = "the chunk ends within a record".to_owned();
                self.leave_out(chunk, 0, reason);
                break;
            };
            let body = &records[place];
            match opcode {
                op::MESSAGE => {
                    let kept = self.message(body, chunk)?;
                    self.copied.unverified += u64::from(kept && !checked);
                }
                op::SCHEMA | op::CHANNEL => self.record(opcode, body, chunk, checked)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Copies a record that is not a message.
    fn record(
        &mut self,
        opcode: u8,
        body: &[u8],
        offset: u64,
        checked: bool,
    ) -> Result<(), RecoverError> {
        let known = [op::SCHEMA, op::CHANNEL, op::METADATA, op::ATTACHMENT];
        if !known.contains(&opcode) {
            return Ok(());
        }
        let damage = match parse(opcode, body) {
            Ok(Record::Schema { header, data }) => {
                self.definitions.add_schema(schema(header, data), checked);
                return Ok(());
            }
            Ok(Record::Channel(channel)) => {
                self.definitions.add_channel(channel, checked);
                return Ok(());
            }
            Ok(Record::Metadata(metadata)) => return self.metadata(metadata),
            Ok(record) => match attachment(record, body) {
                Some(attachment) => return self.output.attachment(&attachment),
                None => "an attachment is damaged or has no checksum".to_owned(),
            },
            Err(damage) => damage.to_string(),
        };
        self.leave_out(offset, body.len() as u64, damage);
        Ok(())
    }

    fn metadata(&mut self, Metadata { name, metadata }: Metadata) -> Result<(), RecoverError> {
        let (record, key) = RECORD;
        if name == CUSTOM_DATA {
            self.copied.custom = Some(metadata);
        } else if name == record {
            let described: Option<Described> =
                metadata.get(key).and_then(|text| yaml::read(text).ok());
            let custom = described.and_then(|described| described.custom_data);
            self.copied.custom = custom.or(self.copied.custom.take());
        } else if name == REPEATED {
            let counts = metadata.into_iter();
            let counts = counts.filter_map(|(topic, count)| Some((topic, count.parse().ok()?)));
            if self.copied.file.messages == 0 {
                self.output.begin_head(counts.collect());
            }
        } else {
            return self.output.metadata(Metadata { name, metadata });
        }
        Ok(())
    }

    /// Copies a message. Returns true if it could be kept.
    fn message(&mut self, body: &[u8], offset: u64) -> Result<bool, RecoverError> {
        let parsed = record::message(body);
        let (header, data) = match parsed {
            Ok(parsed) => parsed,
            Err(damage) => {
                self.leave_out(offset, body.len() as u64, damage.to_string());
                return Ok(false);
            }
        };
        let reason = if body.len() > LIMIT {
            Some(format!("a message of more than {LIMIT} bytes"))
        } else if let Err(damage) = unpacked(data) {
            Some(damage.to_string())
        } else {
            self.add_topic(header.channel_id, offset)?
        };
        if let Some(reason) = reason {
            self.settle();
            self.copied.file.leave_out(LeftOut {
                offset,
                bytes: body.len() as u64,
                reason,
                messages: Some(1),
                times: Some((header.log_time, header.log_time)),
            });
            return Ok(false);
        }
        self.output.message(header, data)?;
        self.copied.file.messages += 1;
        Ok(true)
    }

    /// Adds a channel's topic to the output, or says why that cannot be done.
    fn add_topic(&mut self, channel: u16, offset: u64) -> Result<Option<String>, RecoverError> {
        if self.output.has_topic(channel) {
            return Ok(None);
        }
        match self.definitions.topic(channel) {
            Ok((channel, schema, dropped)) => {
                self.output.add_topic(channel, schema)?;
                if let Some(dropped) = dropped {
                    self.leave_out(offset, 0, dropped);
                }
                Ok(None)
            }
            Err(reason) => Ok(Some(reason)),
        }
    }

    fn leave_out(&mut self, offset: u64, bytes: u64, reason: String) {
        self.settle();
        self.copied.file.leave_out(LeftOut {
            offset,
            bytes,
            reason,
            messages: None,
            times: None,
        });
    }

    /// Reports the chunk left out last, of which no record tells more.
    fn settle(&mut self) {
        if let Some(last) = self.last.take() {
            self.copied.file.leave_out(last);
        }
    }

    fn finish(mut self) -> Result<Copied, RecoverError> {
        self.settle();
        // Topics without messages.
        for channel in self.definitions.channels() {
            if let Some(reason) = self.add_topic(channel, 0)? {
                self.leave_out(0, 0, reason);
            }
        }
        let file = &mut self.copied.file;
        file.kept = file.complete || file.messages > 0;
        if file.kept {
            self.output.finish()?;
        } else {
            self.output.abandon()?;
        }
        Ok(self.copied)
    }
}

/// An attachment whose checksum matches.
fn attachment<'a>(record: Record<'a>, body: &[u8]) -> Option<mcap::Attachment<'a>> {
    let (before, checksum) = body.split_last_chunk()?;
    let saved = u32::from_le_bytes(*checksum);
    match record {
        Record::Attachment { header, data, .. }
            if saved != 0 && crc32fast::hash(before) == saved =>
        {
            Some(mcap::Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            })
        }
        _ => None,
    }
}
