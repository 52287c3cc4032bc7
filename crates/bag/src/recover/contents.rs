//! The records of a damaged file, of which those that can be read are copied.

use std::collections::BTreeMap;

use mcap::records::{MessageHeader, op};

use super::{LIMIT, RecoverError, chunk::Records, copy::Copy, original::Original, scan::Place};
use crate::{
    CUSTOM_DATA, REPEATED,
    metadata::RECORD,
    read,
    records::{Channel, Fields, Header, Schema},
};

/// How the names of this crate's versions begin in the headers of its files.
const LIBRARY: &str = "lgvi ";

/// What was found in a chunk.
pub(super) struct Seen {
    pub messages: u64,
    /// Bytes behind its last complete record.
    pub bytes: u64,
}

impl Copy<'_> {
    /// Copies the records of an unpacked chunk, which a checksum may cover.
    pub(super) fn records(
        &mut self,
        records: &[u8],
        chunk: u64,
        checked: bool,
    ) -> Result<Seen, RecoverError> {
        let before = self.counts.total();
        let mut iterator = Records(records);
        for (opcode, body) in &mut iterator {
            match opcode {
                op::MESSAGE => self.message(body, chunk)?,
                _ => {
                    let place = Place {
                        offset: chunk,
                        length: body.len() as u64,
                    };
                    self.definition(opcode, body, place, checked);
                }
            }
        }
        Ok(Seen {
            messages: self.counts.total() - before,
            bytes: iterator.0.len() as u64,
        })
    }

    /// Copies a record outside of chunks.
    pub(super) fn record(&mut self, opcode: u8, place: Place) -> Result<(), RecoverError> {
        if place.length > LIMIT as u64 {
            let reason = format!("a record of more than {LIMIT} bytes");
            self.losses.leave_out(place, reason);
            return Ok(());
        }
        if !matches!(
            opcode,
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::ATTACHMENT
        ) {
            return Ok(());
        }
        let body = self
            .source
            .view(place.offset, place.length as usize)?
            .to_vec();
        match opcode {
            op::MESSAGE => {
                self.losses.settle();
                let before = self.counts.total();
                self.message(&body, place.offset)?;
                self.loose += self.counts.total() - before;
                Ok(())
            }
            op::HEADER => {
                self.is_ours = is_ours(&body);
                if !self.is_ours {
                    self.definitions.forget_twins();
                }
                Ok(())
            }
            op::METADATA => self.metadata(&body, place),
            op::ATTACHMENT => match attachment(&body) {
                Some(attachment) => self.output.attachment(&attachment),
                None => {
                    let reason = "an attachment is damaged".to_owned();
                    self.losses.leave_out(place, reason);
                    Ok(())
                }
            },
            // Those of the summary have a checksum.
            _ if self.has_summary => Ok(()),
            _ => {
                self.definition(opcode, &body, place, false);
                Ok(())
            }
        }
    }

    fn metadata(&mut self, body: &[u8], place: Place) -> Result<(), RecoverError> {
        let mut fields = Fields::new("metadata", body);
        let parsed = fields.string().and_then(|name| {
            Ok((
                name,
                fields.map(|entry| Ok((entry.string()?, entry.string()?)))?,
            ))
        });
        match parsed {
            Ok((name, metadata)) if name == CUSTOM_DATA => {
                self.custom = Some(metadata);
                Ok(())
            }
            Ok((name, metadata)) if name == RECORD.0 => {
                if let Some(original) = Original::of_record(&metadata) {
                    self.original = Some(original);
                    self.custom = None;
                }
                Ok(())
            }
            Ok((name, metadata)) if name == REPEATED => {
                let counts = metadata
                    .into_iter()
                    .filter_map(|(topic, count)| Some((topic, count.parse().ok()?)));
                let counts: BTreeMap<_, u64> = counts.collect();
                if self.counts.total() == 0 {
                    self.repeated = Some(counts.clone());
                    self.output.begin_head(counts);
                }
                Ok(())
            }
            Ok((name, metadata)) => self
                .output
                .metadata(mcap::records::Metadata { name, metadata }),
            Err(damage) => {
                self.losses.leave_out(place, damage.to_string());
                Ok(())
            }
        }
    }

    /// Takes note of a schema or a channel, which a checksum may cover.
    pub(super) fn definition(&mut self, opcode: u8, body: &[u8], place: Place, checked: bool) {
        let losses = &mut self.losses;
        let damage = match opcode {
            op::SCHEMA => Schema::parse(body)
                .map(|schema| self.definitions.add_schema(schema, place, checked, losses))
                .err(),
            op::CHANNEL => match Channel::parse_most(body) {
                Ok((channel, damage)) => {
                    self.definitions
                        .add_channel(channel, place, checked, losses);
                    damage
                }
                Err(damage) => Some(damage),
            },
            _ => None,
        };
        if let Some(damage) = damage {
            losses.leave_out(place, damage.to_string());
        }
    }

    fn message(&mut self, body: &[u8], offset: u64) -> Result<(), RecoverError> {
        let mut fields = Fields::new("message", body);
        let mut header = || {
            Ok::<_, crate::Damage>(MessageHeader {
                channel_id: fields.u16()?,
                sequence: fields.u32()?,
                log_time: fields.u64()?,
                publish_time: fields.u64()?,
            })
        };
        let place = Place {
            offset,
            length: body.len() as u64,
        };
        if body.len() > LIMIT {
            let reason = format!("a message of more than {LIMIT} bytes");
            self.losses.leave_out(place, reason);
            if let Ok(header) = header() {
                self.losses.add_message(header.log_time);
            }
            return Ok(());
        }
        let header = match header() {
            Ok(header) => header,
            Err(damage) => {
                self.losses.leave_out(place, damage.to_string());
                return Ok(());
            }
        };
        let channel = header.channel_id;
        let Some(topic) = self.definitions.topic(channel, &mut self.losses) else {
            let reason = format!("the definition of channel {channel} is lost");
            self.losses.leave_out(place, reason);
            self.losses.add_message(header.log_time);
            return Ok(());
        };
        if let Err(damage) = read::unpacked(fields.left) {
            self.losses.leave_out(place, damage.to_string());
            self.losses.add_message(header.log_time);
            return Ok(());
        }
        self.output.add_topic(topic)?;
        self.output
            .message(&topic.channel.topic, header, fields.left)?;
        self.counts.add(channel, header.log_time);
        Ok(())
    }
}

/// Whether a file with this header was written by this crate.
pub(super) fn is_ours(header: &[u8]) -> bool {
    Header::parse(header).is_ok_and(|header| header.library.starts_with(LIBRARY))
}

/// An attachment whose checksum is right, or that has none.
fn attachment(body: &[u8]) -> Option<mcap::Attachment<'_>> {
    let (before, checksum) = body.split_last_chunk()?;
    let saved = u32::from_le_bytes(*checksum);
    if saved != 0 && crc32fast::hash(before) != saved {
        return None;
    }
    let mut fields = Fields::new("attachment", before);
    let mut parse = || {
        let (log_time, create_time) = (fields.u64()?, fields.u64()?);
        let (name, media_type) = (fields.string()?, fields.string()?);
        let length = fields.u64()?;
        Ok::<_, crate::Damage>((log_time, create_time, name, media_type, length))
    };
    let (log_time, create_time, name, media_type, length) = parse().ok()?;
    (length == fields.left.len() as u64).then(|| mcap::Attachment {
        log_time,
        create_time,
        name,
        media_type,
        data: fields.left.into(),
    })
}
