//! Finds out what is in a file that does not tell: by reading it once, in memory of a chunk.

use mcap::records::op;

use super::{
    MAGIC_LENGTH, MAX_RECORD_LENGTH, chunk,
    contents::{Contents, Span},
    source::Source,
    walk::{self, Prefix, Records},
};
use crate::{
    BagError, Damage, REPEATED,
    records::{Channel, ChunkHeader, DataEnd, MessageHeader, Metadata, Schema},
};

/// Length from which on messages that lie outside of chunks are no longer read together.
const RUN_LENGTH: u64 = 1 << 20;

/// What is in a file, up to the first fault.
pub(crate) fn scan(source: &Source) -> (Contents, Option<BagError>) {
    let mut scan = Scan {
        source,
        contents: Contents {
            counts: Some(Default::default()),
            ..Contents::default()
        },
        run: None,
        definitions: 0,
    };
    let fault = scan.read().err();
    scan.end_run();
    (scan.contents, fault)
}

struct Scan<'a> {
    source: &'a Source,
    contents: Contents,
    /// Messages outside of chunks that are read together.
    run: Option<Span>,
    /// Bytes of all schemas and channels.
    definitions: usize,
}

impl Scan<'_> {
    fn read(&mut self) -> Result<(), BagError> {
        let source = self.source;
        let mut records = source.records(0, source.size)?;
        let magic = Prefix {
            opcode: 0,
            offset: 0,
            length: MAGIC_LENGTH,
        };
        records.start::<{ MAGIC_LENGTH as usize }>(magic)?;
        loop {
            // The checksum of the data section is of all before its end.
            let checksum = records.checksum();
            let Some(prefix) = records.next()? else {
                return Err(source.truncated("the data end record", source.size, Vec::new()));
            };
            let damaged = |damage| source.damaged(prefix.offset, damage);
            match prefix.opcode {
                op::SCHEMA | op::CHANNEL => {
                    let body = records.body(prefix)?;
                    self.define(prefix.opcode, body).map_err(damaged)?;
                }
                op::MESSAGE => {
                    prefix.limited(MAX_RECORD_LENGTH).map_err(damaged)?;
                    let (start, length) = records.start::<{ MessageHeader::LENGTH }>(prefix)?;
                    let (header, _) = MessageHeader::parse(&start[..length]).map_err(damaged)?;
                    records.skip(prefix)?;
                    self.count(&header, &mut None).map_err(damaged)?;
                    self.add_to_run(prefix, header.log_time);
                }
                op::CHUNK => {
                    self.end_run();
                    self.read_chunk(&mut records, prefix)?;
                }
                op::METADATA => {
                    let metadata = Metadata::parse(records.body(prefix)?).map_err(damaged)?;
                    if metadata.name == REPEATED {
                        self.contents.repeated = metadata.counts().map_err(damaged)?;
                    }
                }
                op::DATA_END => {
                    let end = DataEnd::parse(records.body(prefix)?).map_err(damaged)?;
                    let saved = end.checksum;
                    if saved == 0 || saved == checksum {
                        return Ok(());
                    }
                    return Err(source.damaged(
                        0,
                        Damage::Checksum {
                            of: "data section",
                            saved,
                            calculated: checksum,
                        },
                    ));
                }
                op::ATTACHMENT => {
                    self.end_run();
                    records.skip(prefix)?;
                }
                _ => records.skip(prefix)?,
            }
        }
    }

    fn define(&mut self, opcode: u8, body: &[u8]) -> Result<(), Damage> {
        if opcode == op::CHANNEL {
            let channel = Channel::parse(body)?;
            if self.contents.channels.contains_key(&channel.id) {
                return self.contents.add_channel(channel);
            }
            self.contents.add_channel(channel)?;
        } else {
            let schema = Schema::parse(body)?;
            if self.contents.schemas.contains_key(&schema.id) {
                return Ok(());
            }
            self.contents.schemas.insert(schema.id, schema);
        }
        self.definitions += body.len();
        if self.definitions > MAX_RECORD_LENGTH {
            return Err(Damage::TooLong {
                opcode,
                length: self.definitions as u64,
                limit: MAX_RECORD_LENGTH,
            });
        }
        Ok(())
    }

    /// Counts a message, whose channel has to be known, and widens the times to its own.
    fn count(
        &mut self,
        header: &MessageHeader,
        times: &mut Option<(u64, u64)>,
    ) -> Result<(), Damage> {
        let MessageHeader {
            channel, log_time, ..
        } = *header;
        if !self.contents.channels.contains_key(&channel) {
            return Err(Damage::UnknownChannel {
                sequence: header.sequence,
                channel,
            });
        }
        if let Some(counts) = &mut self.contents.counts {
            *counts.entry(channel).or_default() += 1;
        }
        self.contents.extend_times(log_time, log_time);
        let (first, last) = times.unwrap_or((log_time, log_time));
        *times = Some((first.min(log_time), last.max(log_time)));
        Ok(())
    }

    fn add_to_run(&mut self, prefix: Prefix, log_time: u64) {
        let run = self.run.get_or_insert(Span {
            start_time: log_time,
            end_time: log_time,
            offset: prefix.offset,
            length: 0,
            is_chunk: false,
            channels: None,
        });
        run.start_time = run.start_time.min(log_time);
        run.end_time = run.end_time.max(log_time);
        run.length = prefix.end() - run.offset;
        if run.length >= RUN_LENGTH {
            self.end_run();
        }
    }

    fn end_run(&mut self) {
        self.contents.spans.extend(self.run.take());
    }

    fn read_chunk(&mut self, records: &mut Records<'_>, prefix: Prefix) -> Result<(), BagError> {
        let damaged = |damage| self.source.damaged(prefix.offset, damage);
        let header = records.chunk_header(prefix)?;
        let unpacked = chunk::unpack(&header, &mut *records);
        records.skip(prefix)?;
        let bytes = unpacked.map_err(damaged)?;
        let times = self
            .read_records(&bytes)
            .map_err(|damage| self.source.damaged(prefix.offset, damage))?;
        let ChunkHeader {
            compression,
            packed_length,
            length,
            ..
        } = header;
        self.contents.add_chunk(&compression, packed_length, length);
        if let Some((start_time, end_time)) = times {
            self.contents.spans.push(Span {
                start_time,
                end_time,
                offset: prefix.offset,
                length: prefix.end() - prefix.offset,
                is_chunk: true,
                channels: None,
            });
        }
        Ok(())
    }

    /// Definitions and messages of a chunk; its times.
    fn read_records(&mut self, bytes: &[u8]) -> Result<Option<(u64, u64)>, Damage> {
        let mut times = None;
        let mut offset = 0;
        while offset < bytes.len() {
            let (opcode, start, end) = walk::split(bytes, offset)?;
            let body = &bytes[start..end];
            match opcode {
                op::SCHEMA | op::CHANNEL => self.define(opcode, body)?,
                op::MESSAGE => self.count(&MessageHeader::parse(body)?.0, &mut times)?,
                _ => {}
            }
            offset = end;
        }
        Ok(times)
    }
}
