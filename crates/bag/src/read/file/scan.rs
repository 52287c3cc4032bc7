//! A file read once from its start, in memory of a chunk: of one that does not tell what is in it, or to check it.

use std::{mem, ops::ControlFlow};

use mcap::{
    records::{ChunkHeader, MessageHeader, Record, op},
    sans_io::linear_reader::LinearReaderOptions,
};

use super::{
    MAX_RECORD_LENGTH,
    chunk::unpack,
    contents::{Contents, Span},
    source::Source,
};
use crate::{
    BagError, Damage, REPEATED,
    damage::limited,
    record::{self, PREFIX, Records, parse},
    times::{around, widen},
};

/// Length from which on messages that lie outside of chunks are no longer read together.
const RUN_LENGTH: u64 = 1 << 20;

/// What is in the data section of a file, up to the first fault.
pub(crate) fn scan(source: &Source) -> (Contents, Option<BagError>) {
    let options = LinearReaderOptions::default().with_validate_data_section_crc(true);
    let mut scan = Scan::default();
    let walked = source.walk(None, options, |offset, opcode, body| {
        scan.record(offset, opcode, body)
            .map_err(|damage| source.damaged(offset, damage))?;
        Ok(match opcode {
            op::DATA_END => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        })
    });
    scan.end_run();
    scan.contents.counts.get_or_insert_default();
    (scan.contents, walked.err())
}

/// All damaged chunks of a file, or else the first thing that is wrong with it: in a checksum, a record, or in what the
/// summary tells, which is `known`.
pub(crate) fn check(source: &Source, known: &Contents) -> Vec<BagError> {
    let options = LinearReaderOptions::default()
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true);
    let mut faults = Vec::new();
    let mut scan = Scan::default();
    let walked = source.walk(None, options, |offset, opcode, body| {
        if opcode == op::CHUNK || faults.is_empty() {
            match scan.record(offset, opcode, body) {
                Err(damage) if opcode == op::CHUNK => {
                    faults.push(source.damaged(offset, damage));
                    // The chunk may have held definitions.
                    scan.contents.learn(known);
                }
                taken => taken.map_err(|damage| source.damaged(offset, damage))?,
            }
        }
        Ok(ControlFlow::Continue(()))
    });
    if faults.is_empty() {
        scan.end_run();
        let agreed = known.agree_with(&scan.contents);
        let agreed = agreed.map_err(|damage| source.damaged(0, damage));
        faults.extend(walked.and(agreed).err());
    }
    faults
}

#[derive(Default)]
struct Scan {
    contents: Contents,
    /// Messages outside of chunks that are read together.
    run: Option<Span>,
}

impl Scan {
    fn record(&mut self, offset: u64, opcode: u8, body: &[u8]) -> Result<(), Damage> {
        let length = (PREFIX + body.len()) as u64;
        if ![op::CHUNK, op::ATTACHMENT].contains(&opcode) {
            limited(opcode, body.len() as u64, MAX_RECORD_LENGTH)?;
        }
        let record = parse(opcode, body)?;
        match &record {
            Record::Message { header, .. } => {
                self.count(header)?;
                self.add_to_run(offset, length, header.log_time);
            }
            Record::Chunk { header, data } => {
                self.end_run();
                self.chunk(offset, length, header, data)?;
            }
            Record::Attachment { .. } => self.end_run(),
            Record::Metadata(metadata) if metadata.name == REPEATED => {
                self.contents.repeated = record::counts(metadata)?;
            }
            _ => {}
        }
        self.define(record, body.len())
    }

    /// Takes a record if it is a definition.
    fn define(&mut self, record: Record<'_>, length: usize) -> Result<(), Damage> {
        if let Record::Channel(channel) = &record
            && channel.schema_id != 0
            && !self.contents.schemas.contains_key(&channel.schema_id)
        {
            let (record, id) = ("schema", channel.schema_id);
            return Err(Damage::Undefined { record, id });
        }
        self.contents.define(record, length)
    }

    /// Counts a message, whose channel has to be known.
    fn count(&mut self, header: &MessageHeader) -> Result<(), Damage> {
        let (record, id) = ("channel", header.channel_id);
        if !self.contents.channels.contains_key(&id) {
            return Err(Damage::Undefined { record, id });
        }
        let counts = self.contents.counts.get_or_insert_default();
        *counts.entry(id).or_default() += 1;
        widen(&mut self.contents.times, header.log_time);
        Ok(())
    }

    fn add_to_run(&mut self, offset: u64, length: u64, log_time: u64) {
        let run = self.run.get_or_insert(Span {
            start_time: log_time,
            end_time: log_time,
            offset,
            length: 0,
            is_chunk: false,
            channels: None,
        });
        run.start_time = run.start_time.min(log_time);
        run.end_time = run.end_time.max(log_time);
        run.length = offset + length - run.offset;
        if run.length >= RUN_LENGTH {
            self.end_run();
        }
    }

    fn end_run(&mut self) {
        self.contents.spans.extend(self.run.take());
    }

    fn chunk(
        &mut self,
        offset: u64,
        length: u64,
        header: &ChunkHeader,
        packed: &[u8],
    ) -> Result<(), Damage> {
        let bytes = unpack(header, packed)?;
        let of_file = mem::take(&mut self.contents.times);
        let read = self.records(&bytes);
        let times = self.contents.times;
        self.contents.times = around(of_file.into_iter().chain(times));
        read?;
        let sizes = (header.compressed_size, header.uncompressed_size);
        self.contents
            .add_chunk(&header.compression, sizes.0, sizes.1);
        if let Some((start_time, end_time)) = times {
            self.contents.spans.push(Span {
                start_time,
                end_time,
                offset,
                length,
                is_chunk: true,
                channels: None,
            });
        }
        Ok(())
    }

    /// Takes the definitions and messages of a chunk.
    fn records(&mut self, bytes: &[u8]) -> Result<(), Damage> {
        for record in Records::new(bytes) {
            let (opcode, place) = record?;
            let body = &bytes[place];
            limited(opcode, body.len() as u64, MAX_RECORD_LENGTH)?;
            match opcode {
                op::SCHEMA | op::CHANNEL => self.define(parse(opcode, body)?, body.len())?,
                op::MESSAGE => {
                    let (header, _) = record::message(body)?;
                    self.count(&header)?;
                }
                _ => {}
            }
        }
        Ok(())
    }
}
